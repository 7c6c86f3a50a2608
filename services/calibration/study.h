// The work of the studies: one kernel each, of what was fetched, and its verdict. Pure.
#pragma once

#include <absl/status/statusor.h>

#include "services/calibration/study_inputs.h"
#include "sixpoint/calibration/v1/study.pb.h"

namespace sixpoint::calibration {

// Kind, machine, inputs, verdict and result. FAILED_PRECONDITION (STUDY_UNDETERMINED): the data do not say.
absl::StatusOr<v1::Study> Study(const v1::RunGaugeStudyRequest& request, const GaugeInputs& inputs);
absl::StatusOr<v1::Study> Study(const v1::RunArmStudyRequest& request, const ArmInputs& inputs);
absl::StatusOr<v1::Study> Study(const v1::RunRepeatStudyRequest& request, const RepeatInputs& inputs);
absl::StatusOr<v1::Study> Study(const v1::RunGaugeRrRequest& request, const GaugeRrInputs& inputs);
absl::StatusOr<v1::Study> Study(const v1::RunSphereCheckRequest& request, const SphereInputs& inputs);
absl::StatusOr<v1::Study> Study(const v1::RunInterimCheckRequest& request, const InterimInputs& inputs);

}  // namespace sixpoint::calibration
