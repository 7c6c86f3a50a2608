// Recorded results as other systems' formats have them (exchange/).
#pragma once

#include <absl/status/statusor.h>

#include <optional>

#include "exchange/inspected_part.h"
#include "sixpoint/plant/v1/machine.pb.h"
#include "storage/assessments.h"
#include "storage/deviations.h"
#include "storage/inspections.h"

namespace sixpoint::inspection {

// None: the row has nothing that leaves. DATA_LOSS: a verdict that this release does not know. machine: of the row's revision; null: not known.
using ExportedPart = absl::StatusOr<std::optional<exchange::InspectedPart>>;
ExportedPart Exported(const storage::InspectionRow& row, const plant::v1::Machine* machine);
// Its profile tolerances.
ExportedPart Exported(const storage::DeviationMapRow& row, const plant::v1::Machine* machine);
// Each finding as "balloon" or "balloon/feature". Lengths in mm, whatever the drawing has them in.
ExportedPart Exported(const storage::AssessmentRow& row, const plant::v1::Machine* machine);

}  // namespace sixpoint::inspection
