// What lists and questions ask for, as the stores take it.
#pragma once

#include <absl/status/statusor.h>

#include <string>

#include "sixpoint/calibration/v1/calibration.pb.h"
#include "sixpoint/calibration/v1/study.pb.h"
#include "storage/calibrations.h"
#include "storage/studies.h"

namespace sixpoint::calibration {

// "sensor", "rotation", "probe", "axis"; empty for UNSPECIFIED.
std::string KindText(v1::CalibrationKind kind);
// The subject that a request asks for: machine and kind, and the axis of kind AXIS, which no other has.
absl::StatusOr<storage::CalibrationSubject> SubjectOf(const std::string& machine, v1::CalibrationKind kind,
                                                      const std::string& axis);
// Of the subject any part may be empty.
absl::StatusOr<storage::CalibrationFilter> FilterOf(const v1::ListCalibrationsRequest& request);
absl::StatusOr<storage::StudyFilter> FilterOf(const v1::ListStudiesRequest& request);

}  // namespace sixpoint::calibration
