// What a worker does to itself before it reads a byte from outside. Whatever takes it over afterwards computes, reads its
// input and writes its output: it has no file, no socket, no program, no other process, and no rights to get one.
#pragma once

#include <sys/resource.h>

namespace sixpoint::sandbox {

// The exit code of a worker that could not confine itself; the reason is on its standard error.
inline constexpr int kNotConfined = 3;

// A sanitizer's runtime maps terabytes, reads /proc and starts helpers: under one, only the limits of CPU time and of
// files hold.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kApplied = false;
#else
inline constexpr bool kApplied = true;
#endif

struct Confinement {
  // 0 is read; the others are written; all beyond are closed.
  int descriptor_count = 3;
  rlim_t memory_bytes = 0;  // of address space
  rlim_t file_bytes = 0;    // greatest size of a file that it writes
  rlim_t cpu_s = RLIM_INFINITY;
  // Ends with the thread that started it.
  bool ends_with_starter = false;
};

// Ends the process with kNotConfined where any part fails, save that a kernel may lack Landlock.
void Confine(const Confinement& confinement);

}  // namespace sixpoint::sandbox
