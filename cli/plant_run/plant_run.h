// A whole plant from files: registers machine, artefact, part and blades, uploads every scan, calibrates, registers,
// corrects and inspects, by the same calls that anyone may make.
#pragma once

#include <absl/status/statusor.h>

#include <string>

#include "cli/plant_run/dataset.h"
#include "cli/plant_run/results.h"
#include "cli/session.h"

namespace sixpoint::cli {

// A status where the plant itself could not be registered; a step that failed later is in the result's failures, and the
// others are done all the same. Running the same files again stores no scan twice.
absl::StatusOr<PlantRunResult> RunPlant(Session* session, const std::string& folder, const Dataset& dataset);

}  // namespace sixpoint::cli
