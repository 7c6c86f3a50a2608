#include "metrology/correction/correct.h"

#include <absl/status/status.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "metrology/statistics/distance_quantile.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr int kNoise = 6, kCalibration = kCalibrationParameterCount, kParameters = kNoise + kCalibration;
using Parameters = Eigen::Matrix<double, kParameters, 1>;

constexpr std::size_t kBeforeStarts = 4;  // values of the chain

// A quarter: of the gate's third, the rest is left for what uncertainty adds.
double AllowedTilt(const NominalHoleGroup& group) { return group.inclination_tolerance_rad / 4; }

// The estimates as they would be, had noise and calibration moved them by these parameters.
struct Chain {
  const NominalHoleGroup& group;
  const RegisteredPose& pose;
  const RotaryAxes& axes;

  // a, b, x and y of the turned direction, and then x, y, z of every start.
  absl::StatusOr<Eigen::VectorXd> operator()(const Parameters& change, const RotaryAngles& near,
                                             const RotaryLimits& limits) const {
    const CalibrationVector calibration = change.tail<kCalibration>();
    Eigen::Isometry3d zero_from_part =
        Perturbed(pose.zero_from_part, pose.calibration_sensitivity * calibration, pose.sensitivity_reference_mm);
    zero_from_part = Perturbed(zero_from_part, change.head<kNoise>(), pose.noise.reference_mm);
    const RotaryAxes moved = axes.Perturbed(calibration.tail<kAxisParameterCount>());
    const Eigen::Vector3d direction = zero_from_part.linear() * group.axis_in_part;
    const auto angles = Orient(moved, direction, near, limits, AllowedTilt(group));
    if (!angles.ok()) return angles.status();
    const Eigen::Isometry3d machine_from_zero = moved.MachineFromZero(angles->a_rad, angles->b_rad);
    Eigen::VectorXd values(kBeforeStarts + 3 * group.holes.size());
    values.head<2>() << angles->a_rad, angles->b_rad;
    values.segment<2>(2) = (machine_from_zero.linear() * direction).head<2>();
    for (std::size_t i = 0; i < group.holes.size(); ++i)
      values.segment<3>(kBeforeStarts + 3 * i) = machine_from_zero * (zero_from_part * group.holes[i].start_in_part_mm);
    return values;
  }
};

// OUT_OF_RANGE where a table takes a command beyond the limits that the angle itself keeps.
absl::Status CheckCommand(const char* axis, double command_rad, double minimum_rad, double maximum_rad) {
  constexpr double kSlackRad = 1e-12;  // as Orient's
  if (command_rad >= minimum_rad - kSlackRad && command_rad <= maximum_rad + kSlackRad) return absl::OkStatus();
  char text[160];
  std::snprintf(text, sizeof text, "%s_deg: %.6f by its axis table, want within %g..%g", axis, command_rad * 180 / kPi,
                minimum_rad * 180 / kPi, maximum_rad * 180 / kPi);
  return absl::OutOfRangeError(text);
}

absl::Status Named(const std::string& group, const absl::Status& status) {
  return absl::Status(status.code(), "group " + group + ": " + std::string(status.message()));
}

}  // namespace

absl::StatusOr<CorrectedHoleGroup> CorrectGroup(const NominalHoleGroup& group, const RegisteredPose& pose,
                                                const Eigen::Isometry3d& zero_from_part_nominal, const RotaryAxes& axes,
                                                const RotaryAxes& nominal_axes, const RotaryLimits& limits) {
  if (!pose.noise.values.allFinite() || !pose.calibration_covariance.allFinite() ||
      !pose.calibration_sensitivity.allFinite() || !pose.zero_from_part.matrix().allFinite())
    return Refuse("pose", "not finite", "a pose with finite covariances");
  const Chain chain{group, pose, axes};
  const auto values = chain(Parameters::Zero(), group.nominal, limits);
  if (!values.ok()) return Named(group.name, values.status());

  CorrectedHoleGroup result;
  result.name = group.name;
  result.nominal = group.nominal;
  result.reached = {(*values)[0], (*values)[1]};
  const RotaryPositioning& positioning = pose.positioning;
  result.corrected = {positioning.a.CommandFor(result.reached.a_rad), positioning.b.CommandFor(result.reached.b_rad)};
  for (const absl::Status& status :
       {CheckCommand("a", result.corrected.a_rad, limits.a_minimum_rad, limits.a_maximum_rad),
        CheckCommand("b", result.corrected.b_rad, limits.b_minimum_rad, limits.b_maximum_rad)})
    if (!status.ok()) return Named(group.name, status);
  const Eigen::Vector3d direction = pose.zero_from_part.linear() * group.axis_in_part;
  result.tilt_rad = TiltOf(axes, direction, result.reached);
  const auto ideal = Orient(nominal_axes, direction, group.nominal, limits, AllowedTilt(group));
  if (!ideal.ok()) return Named(group.name, ideal.status());
  result.ideal = *ideal;

  // Central differences of the whole chain: it is so nearly linear over these steps that their error (about 1e-10) is
  // nothing beside the covariances. Limits do not bind here: the branch is the one found.
  const double free = 4 * kPi;
  const RotaryLimits unlimited{-free, free, -free, free};
  Eigen::MatrixXd jacobian(values->size(), kParameters);
  for (int k = 0; k < kParameters; ++k) {
    const bool angle = k < kNoise ? k < 3 : CalibrationParameterAt(k - kNoise).unit == ParameterUnit::kRad;
    const double step = angle ? 1e-6 : 1e-4;
    Parameters change = Parameters::Zero();
    change[k] = step;
    const auto above = chain(change, result.reached, unlimited);
    const auto below = chain(-change, result.reached, unlimited);
    if (!above.ok()) return Named(group.name, above.status());
    if (!below.ok()) return Named(group.name, below.status());
    jacobian.col(k) = (*above - *below) / (2 * step);
  }
  Eigen::Matrix<double, kParameters, kParameters> covariance;
  covariance.setZero();
  covariance.topLeftCorner<kNoise, kNoise>() = pose.noise.values + PoseCovarianceOf(pose.angles);
  covariance.bottomRightCorner<kCalibration, kCalibration>() = pose.calibration_covariance;

  const auto variance = [&](int row) {
    return (jacobian.row(row) * covariance * jacobian.row(row).transpose()).value();
  };
  const Eigen::Vector2d turn_rad(positioning.a.StandardUncertaintyAt(result.corrected.a_rad),
                                 positioning.b.StandardUncertaintyAt(result.corrected.b_rad));
  const Eigen::Vector2d turn_variance_rad2 = turn_rad.cwiseAbs2();
  result.a_standard_uncertainty_rad = std::sqrt(std::max(0.0, variance(0) + turn_variance_rad2[0]));
  result.b_standard_uncertainty_rad = std::sqrt(std::max(0.0, variance(1) + turn_variance_rad2[1]));
  result.tilt_standard_uncertainty_rad = std::sqrt(std::max(0.0, variance(2) + variance(3)));
  const Eigen::Isometry3d nominal_machine_from_part =
      axes.MachineFromZero(group.nominal.a_rad, group.nominal.b_rad) * zero_from_part_nominal;
  for (std::size_t i = 0; i < group.holes.size(); ++i) {
    CorrectedHole hole;
    hole.name = group.holes[i].name;
    hole.start_mm = values->segment<3>(kBeforeStarts + 3 * i);
    hole.nominal_start_mm = nominal_machine_from_part * group.holes[i].start_in_part_mm;
    const Eigen::Matrix<double, 3, kParameters> rows = jacobian.middleRows<3>(kBeforeStarts + 3 * i);
    hole.covariance_mm2 = rows * covariance * rows.transpose();
    if (positioning.Applies()) {
      const Eigen::Matrix<double, 3, 2> turned = axes.AngleJacobian(
          pose.zero_from_part * group.holes[i].start_in_part_mm, result.reached.a_rad, result.reached.b_rad);
      hole.covariance_mm2 += turned * turn_variance_rad2.asDiagonal() * turned.transpose();
    }
    hole.expanded_uncertainty_um = 1e3 * DistanceQuantile(hole.covariance_mm2, 0.95);
    result.holes.push_back(hole);
  }
  return result;
}

}  // namespace sixpoint::metrology
