#include "tests/support/sample_calibrations.h"

#include <vector>

namespace sixpoint::testing {

storage::CalibrationRow SampleSensorCalibration() {
  storage::CalibrationRow row;
  row.method = "JOINT";
  row.sensor.emplace();
  row.sensor->machine_from_sensor_rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  row.sensor->t_sm_mm = {1, 2, 3};
  row.sensor->covariance = std::vector<double>(36, 1);
  row.sensor->alpha_standard_uncertainty_deg = row.sensor->beta_standard_uncertainty_deg = 0.1;
  row.sensor->gamma_standard_uncertainty_deg = 0.1;
  row.sensor->noise_um = row.sensor->touch_rms_um = row.sensor->residual_rms_um = 0;
  row.sensor->condition_number = 1;
  row.sensor->points_used = 1;
  return row;
}

storage::CalibrationRow SampleRotationCalibration() {
  storage::CalibrationRow row;
  row.method = "LINES";
  row.rotation.emplace();
  row.rotation->a_direction = {0, 1, 0};
  row.rotation->b_direction = {1, 0, 0};
  row.rotation->a_point_mm = row.rotation->b_point_mm = row.rotation->point_c_mm = {1, 2, 3};
  row.rotation->point_c_standard_uncertainty_mm = {0.1, 0.1, 0.1};
  row.rotation->covariance = std::vector<double>(64, 0);
  row.rotation->condition_number = 1;
  row.rotation->poses = {{10, 20, 1.5, false, 2.5}};
  return row;
}

}  // namespace sixpoint::testing
