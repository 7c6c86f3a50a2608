#include "metrology/registration/machine_calibration.h"

namespace sixpoint::metrology {

std::vector<ErrorSource> SourcesOf(const MachineCalibration& calibration) {
  std::vector<ErrorSource> sources = CalibrationSources(calibration.sensor.covariance, calibration.sensor_name,
                                                        calibration.axes_covariance, calibration.axes_name);
  sources.insert(sources.end(), calibration.further.begin(), calibration.further.end());
  return sources;
}

CalibrationCovariance CovarianceOf(const MachineCalibration& calibration) {
  return JointCovariance(calibration.sensor.covariance, calibration.axes_covariance) +
         CovarianceOf(calibration.further);
}

}  // namespace sixpoint::metrology
