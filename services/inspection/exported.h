// Recorded results as other systems' formats have them (exchange/).
#pragma once

#include <optional>

#include "exchange/inspected_part.h"
#include "sixpoint/plant/v1/machine.pb.h"
#include "storage/assessments.h"
#include "storage/deviations.h"
#include "storage/inspections.h"

namespace sixpoint::inspection {

// machine: of the row's revision; null: not known.
exchange::InspectedPart Exported(const storage::InspectionRow& row, const plant::v1::Machine* machine);
// Its profile tolerances; none: it has none.
std::optional<exchange::InspectedPart> Exported(const storage::DeviationMapRow& row, const plant::v1::Machine* machine);
// Each finding as "balloon" or "balloon/feature". Lengths in mm, whatever the drawing has them in.
exchange::InspectedPart Exported(const storage::AssessmentRow& row, const plant::v1::Machine* machine);

}  // namespace sixpoint::inspection
