// What was found of holes beside their positions, as it is kept and as messages have it.
#pragma once

#include <absl/status/status.h>

#include <string>
#include <vector>

#include "metrology/inspection/blade_inspection.h"
#include "sixpoint/inspection/v1/inspection.pb.h"
#include "storage/inspections.h"

namespace sixpoint::inspection {

// Budget sources, the holes' budgets, values and pitches; the row's holes are those of the findings, in their order.
void SetHoleValues(const metrology::BladeFindings& findings, storage::InspectionRow* row);

// Values and pitches. DATA_LOSS: what is kept is none of the contract's, or a budget does not fit.
absl::Status HoleValuesToProto(const storage::InspectionRow& row, v1::Inspection* inspection);

}  // namespace sixpoint::inspection
