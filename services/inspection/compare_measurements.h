// Our values beside another instrument's, as a message.
#pragma once

#include <absl/status/statusor.h>

#include <vector>

#include "services/inspection/paired_values.h"
#include "sixpoint/inspection/v1/measurement.pb.h"

namespace sixpoint::inspection {

// Both newest first. INVALID_ARGUMENT: more pairs than an answer holds.
absl::StatusOr<v1::CompareMeasurementsResponse> ComparedMeasurements(
    const plant::v1::Drawing& drawing, const std::vector<OurValue>& ours,
    const std::vector<storage::MeasurementRow>& theirs);

}  // namespace sixpoint::inspection
