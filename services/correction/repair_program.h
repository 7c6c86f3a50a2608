// A machining model's one path, led along the laps of a repair instead (docs/methods/repair.md, program).
#pragma once

#include <absl/status/status.h>

#include "services/correction/adapt.h"
#include "services/correction/inputs.h"
#include "services/runtime/call.h"

namespace sixpoint::correction {

// Where the request names a repair: the inputs' paths are its laps, with what the model's path says of tolerances, mouth, steps and angles, and their
// template is written by the model's post-processor. Nothing where it names none. INVALID_ARGUMENT with field, value and wanted: a repair of another
// registration; a model with straight holes, with more than one path, without post-processor, or whose electrode is not the repair's mill. NOT_FOUND.
absl::Status GoAlongRepair(const ShapeStores& stores, const runtime::Caller& caller, Inputs* inputs);

}  // namespace sixpoint::correction
