// Pure checks of what clients register. Each refusal names the field, its value and what was wanted; what passes comes back
// as the row to store, with directions of exactly unit length.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <string>

#include "sixpoint/plant/v1/plant.pb.h"
#include "storage/machining_models.h"
#include "storage/plant_registry.h"

namespace sixpoint::plant {

absl::StatusOr<storage::MachineRow> Validated(const v1::CreateMachineRequest& request);
absl::StatusOr<storage::ArtefactRow> Validated(const v1::CreateArtefactRequest& request);
// Without its tessellation.
absl::StatusOr<storage::PartRow> Validated(const v1::CreatePartRequest& request);

// By itself, without a revision of its part.
absl::StatusOr<storage::MachiningModelRow> Validated(const v1::CreateMachiningModelRequest& request);

// Groups, electrodes and what is marked in the template, against the part's holes. Where the model has a post-processor instead of a
// template, that is written, and counts as described.
absl::Status FitToPart(const storage::PartRow& part, v1::MachiningModel described, storage::MachiningModelRow* model);
// Holes and datum points have to be near the part: this finds CAD in other units or another frame.
absl::Status CheckInsideBox(const storage::PartRow& part);
// No place of a part may be one at two stations: what the box is off between them, wherever each stands, is more than either may be off.
absl::Status CheckStationsApart(const storage::PartRow& part);

}  // namespace sixpoint::plant
