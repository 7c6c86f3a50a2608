// A recorded inspection as its message.
#pragma once

#include <absl/status/statusor.h>

#include "sixpoint/inspection/v1/inspection.pb.h"
#include "storage/inspections.h"

namespace sixpoint::inspection {

// DATA_LOSS where a stored text names no value of the contract.
absl::StatusOr<v1::Inspection> ToProto(const storage::InspectionRow& row);
absl::StatusOr<v1::Disposition> DispositionOf(const storage::DispositionRow& row);

// What a list's BASIC view has of it.
void LeaveBasic(v1::Inspection* inspection);

}  // namespace sixpoint::inspection
