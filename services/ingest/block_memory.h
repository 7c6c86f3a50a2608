// How the allocator treats what a block takes.
#pragma once

#include <malloc.h>

namespace sixpoint::ingest {

// Encoding a block takes a dozen vectors of about a megabyte. glibc would map and unmap each of them, and the page faults
// cost a third of a block's CPU time (bench/run ingest, profile). So an arena keeps up to this much that is free.
inline constexpr int kKeptBytesPerArena = 16 << 20;

// Once, before the first thread.
inline void KeepBlockMemory() {
  mallopt(M_MMAP_THRESHOLD, kKeptBytesPerArena);
  mallopt(M_TRIM_THRESHOLD, kKeptBytesPerArena);
}

}  // namespace sixpoint::ingest
