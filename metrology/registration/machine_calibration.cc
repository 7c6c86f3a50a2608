#include "metrology/registration/machine_calibration.h"

#include "refusal/refusal.h"

namespace sixpoint::metrology {

absl::Status CheckCovariances(const MachineCalibration& calibration) {
  const auto refused = [](const std::string& of) {
    return Refuse("calibration." + of + ".covariance", "no number", "one that was computed, or stated as zero");
  };
  if (!calibration.sensor.covariance.allFinite()) return refused("sensor");
  if (!calibration.axes_covariance.allFinite()) return refused("axes");
  for (const ErrorSource& source : calibration.further)
    if (!source.parameters_per_sigma.allFinite()) return refused(source.name);
  return absl::OkStatus();
}

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
