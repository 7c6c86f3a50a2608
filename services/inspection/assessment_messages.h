// A recorded assessment as its message.
#pragma once

#include <absl/status/statusor.h>

#include "sixpoint/inspection/v1/assessment.pb.h"
#include "storage/assessments.h"

namespace sixpoint::inspection {

// DATA_LOSS where a stored text names no value of the contract, or a finding a result that is not there.
absl::StatusOr<v1::Assessment> ToProto(const storage::AssessmentRow& row);

// What a list's BASIC view has of it.
void LeaveBasic(v1::Assessment* assessment);

}  // namespace sixpoint::inspection
