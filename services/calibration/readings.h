// What was measured and sent with a request, as the kernels take it. A refusal names the field.
#pragma once

#include <absl/status/statusor.h>
#include <google/protobuf/repeated_ptr_field.h>

#include <string>
#include <vector>

#include "metrology/calibration/axis_characterisation.h"
#include "metrology/calibration/feature_centres.h"
#include "metrology/calibration/probe_calibration.h"
#include "metrology/calibration/rotation_calibration.h"
#include "sixpoint/calibration/v1/calibration.pb.h"

namespace sixpoint::calibration {

absl::StatusOr<metrology::Points> PointsOf(const std::string& field,
                                           const google::protobuf::RepeatedPtrField<geometry::v1::Point>& in);
absl::StatusOr<metrology::ArtefactTouch> TouchOf(const v1::TouchData& touch);

absl::StatusOr<std::vector<metrology::SpherePose>> PosesOf(const v1::CalibrateRotationRequest& request);
absl::StatusOr<metrology::StandardProbing> ProbingOf(const v1::StandardProbing& in);

struct ProbeReadings {
  std::vector<metrology::ProbedFace> faces, moved_faces;
  std::vector<metrology::ProbeReading> readings, moved_readings;
  metrology::ProbeOptions options;
};
absl::StatusOr<ProbeReadings> ProbeReadingsOf(const v1::CalibrateProbeRequest& request);

absl::StatusOr<std::vector<metrology::AxisReading>> ReadingsOf(const v1::AxisRun& run);

}  // namespace sixpoint::calibration
