// The point laser probe's request into what its kernel takes, and its result into rows and messages.
#pragma once

#include <absl/status/statusor.h>

#include <vector>

#include "metrology/calibration/probe_calibration.h"
#include "sixpoint/calibration/v1/calibration.pb.h"
#include "storage/calibrations.h"

namespace sixpoint::calibration {

struct ProbeInputs {
  std::vector<metrology::ProbedFace> faces, moved_faces;
  std::vector<metrology::ProbeReading> readings, moved_readings;
  metrology::ProbeOptions options;
};

// Names, counts and method; the kernel looks at the numbers.
absl::Status CheckProbeRequest(const v1::CalibrateProbeRequest& request);
absl::StatusOr<ProbeInputs> ProbeInputsOf(const v1::CalibrateProbeRequest& request);

storage::ProbeCalibrationRow RowOf(const metrology::ProbeCalibration& result,
                                   const std::vector<metrology::ProbeFaceCheck>& checks,
                                   const v1::CalibrateProbeRequest& request);
void ProbeToProto(const storage::ProbeCalibrationRow& row, v1::ProbeCalibration* out);

}  // namespace sixpoint::calibration
