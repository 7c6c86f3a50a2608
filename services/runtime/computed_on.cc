#include "services/runtime/computed_on.h"

#include <unistd.h>

namespace sixpoint::runtime {
namespace {

// The greatest step of those by which kernels and the C library choose.
std::string Processor() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq"))
    return "x86-64 AVX-512";
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return "x86-64 AVX2";
  return "x86-64";
#elif defined(__aarch64__)
  return "aarch64";
#else
  return "another processor";
#endif
}

// "glibc 2.36".
std::string CLibrary() {
  char text[64] = "";
  return confstr(_CS_GNU_LIBC_VERSION, text, sizeof text) > 0 ? text : "another C library";
}

}  // namespace

const std::string& ComputedOn() {
  static const std::string* const computed_on = new std::string(Processor() + ", " + CLibrary());
  return *computed_on;
}

}  // namespace sixpoint::runtime
