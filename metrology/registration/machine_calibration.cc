#include "metrology/registration/machine_calibration.h"

namespace sixpoint::metrology {

std::vector<ErrorSource> SourcesOf(const MachineCalibration& calibration) {
  std::vector<ErrorSource> sources = {
      SensorCalibrationSource(calibration.sensor.covariance, calibration.sensor.degrees_of_freedom,
                              calibration.sensor_name),
      RotationCalibrationSource(calibration.axes_covariance, calibration.axes_degrees_of_freedom,
                                calibration.axes_name)};
  sources.insert(sources.end(), calibration.further.begin(), calibration.further.end());
  return sources;
}

CalibrationCovariance CovarianceOf(const MachineCalibration& calibration) {
  return JointCovariance(calibration.sensor.covariance, calibration.axes_covariance) +
         CovarianceOf(calibration.further);
}

}  // namespace sixpoint::metrology
