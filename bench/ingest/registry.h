// What a plant knows before its machines scan: machines/bench-0.., a part with a small STL, blades/bench.
#pragma once

#include <absl/status/status.h>

#include "bench/ingest/upload_stream.h"

namespace sixpoint::bench {

// What is there already stays; waits until the plant answers.
absl::Status Register(const Endpoint& plant, int machine_count);

}  // namespace sixpoint::bench
