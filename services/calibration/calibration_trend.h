// Calibrated parameters over time.
#pragma once

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "sixpoint/calibration/v1/calibration.pb.h"
#include "storage/calibration_store.h"

namespace sixpoint::calibration {

// One scalar of a calibration with its standard uncertainty; the unit is in the name.
struct CalibratedParameter {
  std::string name;
  double value = 0;
  double standard_uncertainty = 0;
};
std::vector<CalibratedParameter> ParametersOf(const storage::CalibrationRow& row);

absl::StatusOr<v1::CalibrationTrend> TrendOf(const storage::CalibrationReader& calibrations, storage::Deadline deadline,
                                             const v1::GetCalibrationTrendRequest& request);

}  // namespace sixpoint::calibration
