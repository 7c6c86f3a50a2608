// How a process that fits large scans keeps its memory.
#pragma once

#include <malloc.h>

namespace sixpoint::registration {

// Large vectors of a fit go back to the system at its end. glibc would keep them in an arena of each thread that ever fitted:
// a gigabyte after some dozens of registrations of five million points. Once, before the first thread.
inline void ReturnFreedMemory() {
  mallopt(M_ARENA_MAX, 4);
  mallopt(M_MMAP_THRESHOLD, 1 << 20);
  mallopt(M_TRIM_THRESHOLD, 4 << 20);
}

}  // namespace sixpoint::registration
