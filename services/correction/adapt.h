// A machining model's paths on the shape that a reconstruction found (docs/methods/reconstruction.md, path).
#pragma once

#include <absl/status/status.h>

#include <string>

#include "services/correction/inputs.h"
#include "services/runtime/call.h"
#include "storage/reconstructions.h"

namespace sixpoint::correction {

// Where the request names a reconstruction: every path of the inputs goes with the shape, what is kept clear of is the shape, and each path says
// what it would cut otherwise than its template. Nothing where it names none. INVALID_ARGUMENT with field, value and wanted: one that found no
// shape, that is a try, or is of another registration; a model without paths, or with straight holes, which stand by the drawing. NOT_FOUND.
absl::Status AdaptToShape(const storage::ReconstructionStore& reconstructions, const clients::BladePeers& peers,
                          int threads, const runtime::Caller& caller, Inputs* inputs);

}  // namespace sixpoint::correction
