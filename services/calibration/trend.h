// Calibrated parameters over time.
#pragma once

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "sixpoint/calibration/v1/calibration.pb.h"
#include "storage/calibrations.h"

namespace sixpoint::calibration {

inline constexpr int kUsualTrendCount = 50;  // of calibrations

// One scalar of a calibration with its standard uncertainty; the unit is in the name.
struct CalibratedParameter {
  std::string name;
  double value = 0;
  double standard_uncertainty = 0;
};
std::vector<CalibratedParameter> ParametersOf(const storage::CalibrationRow& row);

// history: of one subject, at least one, by the time from which they are valid. INVALID_ARGUMENT: a parameter that they have
// not, or a limit that is none.
absl::StatusOr<v1::CalibrationTrend> TrendOf(const v1::GetCalibrationTrendRequest& request,
                                             const std::vector<storage::CalibrationRow>& history);

}  // namespace sixpoint::calibration
