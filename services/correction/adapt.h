// A machining model's paths on the shape that a reconstruction found (docs/methods/reconstruction.md, path).
#pragma once

#include <absl/status/status.h>

#include <memory>

#include "services/correction/inputs.h"
#include "services/runtime/call.h"
#include "storage/machining_passes.h"
#include "storage/reconstructions.h"
#include "storage/repairs.h"

namespace sixpoint::correction {

struct ShapeStores {
  std::shared_ptr<storage::ReconstructionStore> reconstructions;
  std::shared_ptr<storage::MachiningPassStore> passes;
  std::shared_ptr<storage::RepairStore> repairs;
};

// Where the request names a reconstruction, or a machining pass: every path of the inputs goes with the shape, commanded by what the pass left, what
// is kept clear of is the shape, and each path says what it would cut otherwise than its template. Nothing where it names neither. INVALID_ARGUMENT
// with field, value and wanted: one that found no shape, that is a try, or is of another registration; a pass that is not followed by another; a
// model without paths, or with straight holes, which stand by the drawing. NOT_FOUND.
absl::Status AdaptToShape(const ShapeStores& stores, const clients::BladePeers& peers, int threads,
                          const runtime::Caller& caller, Inputs* inputs);

}  // namespace sixpoint::correction
