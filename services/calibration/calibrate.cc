#include "services/calibration/calibrate.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "services/calibration/refusals.h"
#include "services/runtime/errors.h"
#include "services/runtime/units.h"

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

// The one whose scans stand farthest apart along machine Z; of several the one with most scans, then the first.
std::string SeriesToCalibrateBy(const SensorInputs& inputs) {
  struct Seen {
    double low_mm = 0, high_mm = 0;
    int count = 0;
  };
  std::map<std::string, Seen> by_series;
  for (std::size_t i = 0; i < inputs.scans.size(); ++i) {
    const double z_mm = inputs.scans[i].v0_mm.z();
    const auto [found, is_new] = by_series.try_emplace(inputs.series_of_scans[i], Seen{z_mm, z_mm, 0});
    found->second.low_mm = std::min(found->second.low_mm, z_mm);
    found->second.high_mm = std::max(found->second.high_mm, z_mm);
    ++found->second.count;
  }
  const auto best = std::max_element(by_series.begin(), by_series.end(), [](const auto& one, const auto& other) {
    const Seen &a = one.second, &b = other.second;
    return std::pair(a.high_mm - a.low_mm, a.count) < std::pair(b.high_mm - b.low_mm, b.count);
  });
  return best->first;
}

std::vector<metrology::LineScan> ScansOf(const std::string& series, const SensorInputs& inputs) {
  std::vector<metrology::LineScan> scans;
  for (std::size_t i = 0; i < inputs.scans.size(); ++i)
    if (inputs.series_of_scans[i] == series) scans.push_back(inputs.scans[i]);
  return scans;
}

// Every scan fitted in the same way, the artefact standing as calibrated; those of the other series beside the calibration's own.
absl::Status MoveToMeanOfSwings(const SensorInputs& inputs, const std::string& series,
                                const std::vector<metrology::LineScan>& of_series, CalibratedSensor* calibrated) {
  metrology::SensorCalibration& calibration = calibrated->calibration;
  metrology::SensorPose start = calibration.sensor;
  start.field = inputs.options.field;
  const auto fit = [&](metrology::LineScan scan) {
    for (Eigen::Vector3d& p : scan.points_mm) p = start.WithoutField(p);
    return metrology::FitSensorPose(scan, inputs.artefact, inputs.options.optics, start,
                                    calibration.machine_from_artefact);
  };
  std::vector<metrology::ArtefactFit> own;
  for (const metrology::LineScan& scan : of_series) {
    auto fitted = fit(scan);
    if (!fitted.ok()) return fitted.status();
    own.push_back(*std::move(fitted));
  }
  std::vector<metrology::SwungScan> swung;
  for (std::size_t i = 0; i < inputs.scans.size(); ++i) {
    if (inputs.series_of_scans[i] == series) continue;
    if (inputs.options.keep_going && !inputs.options.keep_going())
      return absl::CancelledError("sensor calibration stopped");
    const auto fitted = fit(inputs.scans[i]);
    if (!fitted.ok()) return fitted.status();
    swung.push_back(metrology::Apart(inputs.series_of_scans[i], *fitted, own));
  }
  auto mean = metrology::FindMeanOfSwings(series, swung, *inputs.arm);
  if (!mean.ok()) return mean.status();
  calibration.sensor.field_response = calibration.field_response.value_or(metrology::FieldResponse::Zero());
  calibration.sensor = metrology::Moved(calibration.sensor, *mean);
  if (calibration.field_response) calibration.field_response = calibration.sensor.field_response;
  calibration.angles = metrology::CardanFromRotation(calibration.sensor.rotation);
  calibration.angle_uncertainty =
      metrology::CardanUncertainty(calibration.angles, calibration.sensor.covariance.topLeftCorner<3, 3>());
  calibrated->arm_shares = std::move(mean->shares);
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<CalibratedSensor> Calibrate(const v1::CalibrateSensorRequest& request, const SensorInputs& inputs) {
  const std::string series = inputs.arm ? SeriesToCalibrateBy(inputs) : "";
  std::vector<metrology::LineScan> of_series;
  if (inputs.arm) of_series = ScansOf(series, inputs);
  const std::vector<metrology::LineScan>& scans = inputs.arm ? of_series : inputs.scans;
  absl::StatusOr<metrology::SensorCalibration> result =
      request.method() == v1::SENSOR_METHOD_SEQUENTIAL
          ? metrology::CalibrateSensorSequentially(scans, inputs.artefact, inputs.touch, inputs.options)
          : metrology::CalibrateSensor(scans, inputs.artefact, inputs.touch, inputs.options);
  if (!result.ok()) return WithReason(result.status());
  if (!result->converged)
    return NotConverged("the fit did not settle in " + std::to_string(result->iterations) +
                        " iterations; scan the artefact again");
  CalibratedSensor calibrated{*std::move(result), {}};
  if (!inputs.arm) return calibrated;
  if (absl::Status s = MoveToMeanOfSwings(inputs, series, of_series, &calibrated); !s.ok()) return WithReason(s);
  return calibrated;
}

absl::StatusOr<StatedSensor> Calibrate(const v1::StateSensorPoseRequest& request, const StatedInputs& inputs) {
  // Where beta is a right angle alpha and gamma turn about one line, and neither is known by itself.
  constexpr double kUnknownRad = 179 * runtime::kRadPerDeg;
  const double turn_rad = request.turn_standard_uncertainty_deg() * runtime::kRadPerDeg;
  const double shift_mm = request.shift_standard_uncertainty_um() * runtime::kMmPerUm;
  StatedSensor stated;
  stated.sensor.cloud = metrology::CloudKind::kSnapshot;
  stated.sensor.rotation = inputs.machine_from_sensor.linear();
  stated.sensor.t_sm_mm = inputs.machine_from_sensor.translation();
  stated.sensor.covariance.setZero();
  stated.sensor.covariance.diagonal() << Eigen::Vector3d::Constant(turn_rad * turn_rad),
      Eigen::Vector3d::Constant(shift_mm * shift_mm);
  stated.angles = metrology::CardanFromRotation(stated.sensor.rotation);
  stated.angle_uncertainty =
      metrology::CardanUncertainty(stated.angles, stated.sensor.covariance.topLeftCorner<3, 3>());
  for (double* const sigma : {&stated.angle_uncertainty.alpha, &stated.angle_uncertainty.gamma})
    if (!(*sigma < kUnknownRad)) *sigma = kUnknownRad;
  return stated;
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
