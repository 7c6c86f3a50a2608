// Findings as rows, and a stored inspection as its message.
#pragma once

#include <absl/status/statusor.h>

#include <vector>

#include "metrology/inspection/blade_inspection.h"
#include "sixpoint/inspection/v1/inspection.pb.h"
#include "storage/inspections.h"

namespace sixpoint::inspection {

// Verdicts, decision rule, holes and deviation. The holes are those that the findings were made for, in their order.
void SetFindings(const std::vector<metrology::InspectedHole>& holes, const metrology::BladeFindings& findings,
                 storage::InspectionRow* row);

// DATA_LOSS where a stored text names no value of the contract.
absl::StatusOr<v1::Inspection> ToProto(const storage::InspectionRow& row);

}  // namespace sixpoint::inspection
