#include "metrology/registration/angle_influence.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace sixpoint::metrology {
namespace {

using Axis = AngleInfluence::Axis;

// Small beside the noise of a scan, or the robust loss would let go of the scan that is moved alone: all angles of an axis
// together must move the pose as far as they do. Large beside where a fit stops: 0.1 um at 100 mm at the least.
constexpr double kStepShare = 0.1;
constexpr double kLeastStepRad = 1e-6;

double CommandOf(const ScanPortion& portion, Axis axis) {
  return axis == Axis::kA ? portion.commanded_a_rad : portion.commanded_b_rad;
}

bool SameCommand(double first_rad, double second_rad) { return std::abs(first_rad - second_rad) < kSameCommandRad; }

// The portions as they would be mapped, were that angle greater by step_rad.
std::vector<ScanPortion> Turned(std::vector<ScanPortion> portions, const AngleInfluence& angle, double step_rad,
                                const RotaryAxes& axes) {
  for (ScanPortion& portion : portions) {
    if (!SameCommand(CommandOf(portion, angle.axis), angle.commanded_rad)) continue;
    const Eigen::Isometry3d machine_from_zero = axes.MachineFromZero(portion.a_rad, portion.b_rad);
    (angle.axis == Axis::kA ? portion.a_rad : portion.b_rad) += step_rad;
    const Eigen::Isometry3d turned_from_zero =
        axes.MachineFromZero(portion.a_rad, portion.b_rad).inverse(Eigen::Isometry) * machine_from_zero;
    portion.zero_from_sensor = turned_from_zero * portion.zero_from_sensor;
    for (Eigen::Vector3d& point : portion.dense_zero_mm) point = turned_from_zero * point;
  }
  return portions;
}

// The perturbation about the reference that takes one pose to the other.
Vector6d ChangeBetween(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to,
                       const Eigen::Vector3d& reference_mm) {
  const Eigen::Isometry3d change = to * from.inverse(Eigen::Isometry);
  Vector6d perturbation;
  perturbation << VectorFromRotation(change.linear()), change * reference_mm - reference_mm;
  return perturbation;
}

}  // namespace

std::vector<AngleInfluence> TabledAngles(const std::vector<ScanPortion>& portions,
                                         const RotaryPositioning& positioning) {
  std::vector<AngleInfluence> angles;
  for (const Axis axis : {Axis::kA, Axis::kB}) {
    const AxisPositioning& positions = axis == Axis::kA ? positioning.a : positioning.b;
    if (!positions.table) continue;
    for (const ScanPortion& portion : portions) {
      const double command = CommandOf(portion, axis);
      const bool known = std::any_of(angles.begin(), angles.end(), [&](const AngleInfluence& angle) {
        return angle.axis == axis && SameCommand(angle.commanded_rad, command);
      });
      if (known) continue;
      AngleInfluence& angle = angles.emplace_back();
      angle.axis = axis;
      angle.commanded_rad = command;
      angle.reached_rad = positions.Reached(command);
      angle.standard_uncertainty_rad = positions.standard_uncertainty_rad;
      angle.half_reversal_rad = positions.HalfReversalAt(command);
    }
  }
  return angles;
}

absl::StatusOr<std::vector<AngleInfluence>> InfluencesOf(const std::vector<ScanPortion>& portions,
                                                         const MachineCalibration& calibration, const PoseFit& fit,
                                                         const Refit& refit) {
  std::vector<AngleInfluence> angles = TabledAngles(portions, calibration.positioning);
  for (AngleInfluence& angle : angles) {
    const double step_rad =
        std::max(kLeastStepRad, kStepShare * std::hypot(angle.standard_uncertainty_rad, angle.half_reversal_rad));
    const absl::StatusOr<PoseFit> moved = refit(Turned(portions, angle, step_rad, calibration.axes));
    if (!moved.ok()) return moved.status();
    if (moved->outcome != Outcome::kConverged)
      return absl::FailedPreconditionError(std::string(angle.axis == Axis::kA ? "a" : "b") +
                                           "_deg: " + std::to_string(angle.commanded_rad * 180 / M_PI) +
                                           ", want a pose that stands when this angle is taken greater by " +
                                           std::to_string(step_rad * 180 / M_PI) +
                                           " deg, a tenth of its standard uncertainty");
    angle.pose_per_rad =
        ChangeBetween(fit.zero_from_part, moved->zero_from_part, fit.covariance.reference_mm) / step_rad;
  }
  return angles;
}

}  // namespace sixpoint::metrology
