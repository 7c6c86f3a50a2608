// Writers of the journal that outlive whatever happens to the database: what `bench/run record --only events` is told of.
#pragma once

#include <string>

namespace sixpoint::bench {

// So many threads append blades with such pauses between them, until standard input ends; then prints when each was acknowledged.
// What fails is tried again as another blade.
void WriteEvents(const std::string& conninfo, int writer_count, int pause_ms);

}  // namespace sixpoint::bench
