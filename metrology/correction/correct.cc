#include "metrology/correction/correct.h"

#include <absl/status/status.h>

#include <cstdio>

#include "metrology/correction/start_uncertainty.h"
#include "metrology/frames/angles.h"

namespace sixpoint::metrology {
namespace {

// The estimates as they would be, had pose and axes been found moved by these parameters.
struct MovedEstimates {
  const NominalHoleGroup& group;
  const RegisteredPose& pose;
  const RotaryAxes& axes;
  Eigen::Affine3d growth;  // of the part, at zero

  // a, b, x and y of the turned direction, and then x, y, z of every start.
  absl::StatusOr<Eigen::VectorXd> operator()(const ChainParameters& change, const RotaryAngles& near,
                                             const RotaryLimits& limits) const {
    const auto [zero_from_part, moved] = Moved(pose, axes, change);
    const Eigen::Vector3d direction = zero_from_part.linear() * group.axis_in_part;
    const auto angles = Orient(moved, direction, near, limits, AllowedTiltOf(group.inclination_tolerance_rad));
    if (!angles.ok()) return angles.status();
    const Eigen::Isometry3d machine_from_zero = moved.MachineFromZero(angles->a_rad, angles->b_rad);
    Eigen::VectorXd values(kBeforeStarts + 3 * group.holes.size());
    values.head<2>() << angles->a_rad, angles->b_rad;
    values.segment<2>(2) = (machine_from_zero.linear() * direction).head<2>();
    for (std::size_t i = 0; i < group.holes.size(); ++i)
      values.segment<3>(kBeforeStarts + 3 * i) =
          machine_from_zero * (growth * (zero_from_part * group.holes[i].start_in_part_mm));
    return values;
  }
};

// OUT_OF_RANGE where a table takes a command beyond the limits that the angle itself keeps.
absl::Status CheckCommand(const char* axis, double command_rad, double minimum_rad, double maximum_rad) {
  constexpr double kSlackRad = 1e-12;  // as Orient's
  if (command_rad >= minimum_rad - kSlackRad && command_rad <= maximum_rad + kSlackRad) return absl::OkStatus();
  char text[160];
  std::snprintf(text, sizeof text, "%s_deg: %.6f by its axis table, want within %g..%g", axis, command_rad * kDegPerRad,
                minimum_rad * kDegPerRad, maximum_rad * kDegPerRad);
  return absl::OutOfRangeError(text);
}

// Limits do not bind here: the branch is the one found.
absl::StatusOr<Eigen::MatrixXd> JacobianOf(const MovedEstimates& chain, const RotaryAngles& reached,
                                           Eigen::Index value_count) {
  const double free = 4 * kPi;
  const RotaryLimits unlimited{-free, free, -free, free};
  return ChainJacobian(value_count, [&](const ChainParameters& change) { return chain(change, reached, unlimited); });
}

absl::Status Named(const std::string& group, const absl::Status& status) {
  return absl::Status(status.code(), "group " + group + ": " + std::string(status.message()));
}

}  // namespace

absl::StatusOr<CorrectedHoleGroup> CorrectGroup(const NominalHoleGroup& group, const RegisteredPose& pose,
                                                const Eigen::Isometry3d& zero_from_part_nominal, const RotaryAxes& axes,
                                                const RotaryAxes& nominal_axes, const RotaryLimits& limits,
                                                const Drilling& drilling) {
  if (absl::Status status = CheckFinite(pose); !status.ok()) return status;
  const MovedEstimates chain{group, pose, axes, axes.Growth(drilling.stretch)};
  const auto values = chain(ChainParameters::Zero(), group.nominal, limits);
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
  const auto ideal =
      Orient(nominal_axes, direction, group.nominal, limits, AllowedTiltOf(group.inclination_tolerance_rad));
  if (!ideal.ok()) return Named(group.name, ideal.status());
  result.ideal = *ideal;

  const auto jacobian = JacobianOf(chain, result.reached, values->size());
  if (!jacobian.ok()) return Named(group.name, jacobian.status());
  const std::vector<UncertaintyPart> parts = PartsOf(*jacobian, *values, pose);
  const AngleUncertainty angles = AngleUncertaintyOf(parts, positioning, result.corrected);
  result.a_standard_uncertainty_rad = angles.a_rad;
  result.b_standard_uncertainty_rad = angles.b_rad;
  result.tilt_standard_uncertainty_rad = angles.tilt_rad;
  const Eigen::Isometry3d nominal_machine_from_zero = axes.MachineFromZero(group.nominal.a_rad, group.nominal.b_rad);
  for (std::size_t i = 0; i < group.holes.size(); ++i) {
    CorrectedHole hole;
    hole.name = group.holes[i].name;
    hole.start_mm = values->segment<3>(kBeforeStarts + 3 * i);
    hole.nominal_start_mm =
        nominal_machine_from_zero * (chain.growth * (zero_from_part_nominal * group.holes[i].start_in_part_mm));
    const Eigen::Matrix<double, 3, 2> moved_per_angle = axes.AngleJacobian(
        pose.zero_from_part * group.holes[i].start_in_part_mm, result.reached.a_rad, result.reached.b_rad);
    SumUpStart(parts, kBeforeStarts + 3 * static_cast<Eigen::Index>(i), drilling, positioning, moved_per_angle,
               angles.turn_variance_rad2, &hole);
    result.holes.push_back(hole);
  }
  return result;
}

}  // namespace sixpoint::metrology
