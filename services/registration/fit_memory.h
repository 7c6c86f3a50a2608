// How a process that fits large scans keeps its memory.
#pragma once

#include <malloc.h>

namespace sixpoint::registration {

// Large vectors of a fit go back to the system at its end. glibc would keep them in an arena of each thread that ever fitted:
// a gigabyte after some dozens of registrations of five million points. What blocks are decoded into, two megabytes each and several at a
// time, stays: mapped anew for every block it would be a tenth of an inspection's registration. Once, before the first thread.
inline void ReturnFreedMemory() {
  mallopt(M_ARENA_MAX, 4);
  mallopt(M_MMAP_THRESHOLD, 4 << 20);
  mallopt(M_TRIM_THRESHOLD, 24 << 20);
}

}  // namespace sixpoint::registration
