// What OpenCASCADE's writers write: they know files only.
#pragma once

#include <functional>
#include <string>

namespace sixpoint::testing {

// The bytes that are at the path which write() is given.
std::string Written(const std::function<void(const std::string& path)>& write);

}  // namespace sixpoint::testing
