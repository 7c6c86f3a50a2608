// Calibrations between kernel results, their rows and their messages.
#pragma once

#include <string>
#include <vector>

#include "metrology/calibration/rotation_calibration.h"
#include "metrology/calibration/sensor_calibration.h"
#include "sixpoint/calibration/v1/calibration.pb.h"
#include "storage/calibrations.h"

namespace sixpoint::calibration {

storage::SensorCalibrationRow RowOf(const metrology::SensorCalibration& result);
storage::RotationCalibrationRow RowOf(const metrology::RotationCalibration& result,
                                      const std::vector<metrology::SpherePose>& poses,
                                      const metrology::RotationOptions& options);

storage::EnvironmentRow RowOf(const v1::Environment& environment);

v1::Calibration ToProto(const storage::CalibrationRow& row);

// A few figures for the journal, as JSON.
std::string SummaryOf(const storage::CalibrationRow& row);

}  // namespace sixpoint::calibration
