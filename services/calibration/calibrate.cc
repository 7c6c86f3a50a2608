#include "services/calibration/calibrate.h"

#include <string>
#include <utility>

#include "services/calibration/refusals.h"
#include "services/runtime/errors.h"

namespace sixpoint::calibration {
namespace {

absl::Status NotConverged(const std::string& what) {
  return runtime::Failure(errors::v1::CALIBRATION_NOT_CONVERGED, what);
}

absl::StatusOr<metrology::RotationCalibration> FindAxes(v1::RotationMethod method, const RotationInputs& inputs) {
  if (method == v1::ROTATION_METHOD_STANDARD)
    return metrology::CalibrateStandardCentre(inputs.standard, inputs.poses, inputs.options);
  return method == v1::ROTATION_METHOD_POINT_C ? metrology::CalibratePointC(inputs.poses, inputs.options)
                                               : metrology::CalibrateRotation(inputs.poses, inputs.options);
}

}  // namespace

absl::StatusOr<metrology::SensorCalibration> Calibrate(const v1::CalibrateSensorRequest& request,
                                                       const SensorInputs& inputs) {
  absl::StatusOr<metrology::SensorCalibration> result =
      request.method() == v1::SENSOR_METHOD_SEQUENTIAL
          ? metrology::CalibrateSensorSequentially(inputs.scans, inputs.artefact, inputs.touch, inputs.options)
          : metrology::CalibrateSensor(inputs.scans, inputs.artefact, inputs.touch, inputs.options);
  if (!result.ok()) return WithReason(result.status());
  if (!result->converged)
    return NotConverged("the fit did not settle in " + std::to_string(result->iterations) +
                        " iterations; scan the artefact again");
  return result;
}

absl::StatusOr<metrology::RotationCalibration> Calibrate(const v1::CalibrateRotationRequest& request,
                                                         const RotationInputs& inputs) {
  absl::StatusOr<metrology::RotationCalibration> result = FindAxes(request.method(), inputs);
  if (!result.ok()) return WithReason(result.status());
  if (!result->converged) return NotConverged("the fit did not settle; probe the sphere at more poses");
  return result;
}

absl::StatusOr<CalibratedProbe> Calibrate(const v1::CalibrateProbeRequest& request, const ProbeInputs& inputs) {
  const ProbeReadings& in = inputs.measured;
  absl::StatusOr<metrology::ProbeCalibration> result =
      request.method() == v1::PROBE_METHOD_LINEAR ? metrology::CalibrateProbeLinearly(in.faces, in.readings, in.options)
                                                  : metrology::CalibrateProbe(in.faces, in.readings, in.options);
  if (!result.ok()) return WithReason(result.status());
  if (!result->converged) return NotConverged("the fit did not settle; measure each face at more displacements");
  absl::StatusOr<std::vector<metrology::ProbeFaceCheck>> checks =
      metrology::CheckProbe(*result, in.moved_faces, in.moved_readings, in.options);
  if (!checks.ok()) return WithReason(checks.status());
  return CalibratedProbe{*std::move(result), *std::move(checks)};
}

absl::StatusOr<metrology::AxisCharacterisation> Calibrate(const v1::CharacteriseAxisRequest&,
                                                          const AxisInputs& inputs) {
  absl::StatusOr<metrology::AxisCharacterisation> result = metrology::CharacteriseAxis(inputs.readings);
  if (!result.ok()) return WithReason(result.status());
  return result;
}

}  // namespace sixpoint::calibration
