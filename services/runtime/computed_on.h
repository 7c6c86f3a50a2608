// On what results are computed. Bits may come out otherwise on another: the C library's functions choose by the processor.
#pragma once

#include <string>

namespace sixpoint::runtime {

// "x86-64 AVX-512, glibc 2.36", as stored with every result that is computed.
const std::string& ComputedOn();

}  // namespace sixpoint::runtime
