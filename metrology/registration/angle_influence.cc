#include "metrology/registration/angle_influence.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>

#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using Axis = AngleInfluence::Axis;

// How far a step moves the scans' fastest point, in what points scatter about the surface. Small beside the scatter of patches
// of many points, or the robust loss lets go of the scan that is moved alone. Large beside what points do that come to lie in
// another patch.
constexpr double kStepShare = 0.05;
constexpr double kLeastStepMm = 1e-5;

double CommandOf(const ScanPortion& portion, Axis axis) {
  return axis == Axis::kA ? portion.commanded_a_rad : portion.commanded_b_rad;
}

bool SameCommand(double first_rad, double second_rad) { return std::abs(first_rad - second_rad) < kSameCommandRad; }

// Scans whose angle is taken greater: those at one command of an axis, or all.
struct Turn {
  Axis axis = Axis::kA;
  std::optional<double> commanded_rad;

  bool Takes(const ScanPortion& portion) const {
    return !commanded_rad || SameCommand(CommandOf(portion, axis), *commanded_rad);
  }
};

// The portions as they would be mapped, were the angle of those that the turn takes greater by step_rad.
std::vector<ScanPortion> Turned(std::vector<ScanPortion> portions, const Turn& turn, double step_rad,
                                const RotaryAxes& axes) {
  for (ScanPortion& portion : portions) {
    if (!turn.Takes(portion)) continue;
    const Eigen::Isometry3d machine_from_zero = axes.MachineFromZero(portion.a_rad, portion.b_rad);
    (turn.axis == Axis::kA ? portion.a_rad : portion.b_rad) += step_rad;
    const Eigen::Isometry3d turned_from_zero =
        axes.MachineFromZero(portion.a_rad, portion.b_rad).inverse(Eigen::Isometry) * machine_from_zero;
    portion.zero_from_sensor = turned_from_zero * portion.zero_from_sensor;
    for (Eigen::Vector3d& point : portion.dense_zero_mm) point = turned_from_zero * point;
  }
  return portions;
}

// How fast the fastest point moves with the angle.
double FastestMmPerRad(const std::vector<ScanPortion>& portions, const Turn& turn, const RotaryAxes& axes) {
  double fastest = 0;
  for (const ScanPortion& portion : portions) {
    if (!turn.Takes(portion)) continue;
    for (std::size_t i = 0; i < portion.sensor.size(); ++i) {
      const auto speeds = axes.AngleJacobian(portion.zero_mm(i), portion.a_rad, portion.b_rad);
      fastest = std::max(fastest, speeds.col(turn.axis == Axis::kA ? 0 : 1).norm());
    }
  }
  return fastest;
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
  if (!fit.placed) return Refuse("angles", "a pose that has not converged", "one that has");
  const PlacedPose& placed = *fit.placed;
  const double step_mm = std::max(kLeastStepMm, kStepShare * fit.evidence.residual_sigma_mm);
  const auto influence_of = [&](const Turn& turn) -> absl::StatusOr<Vector6d> {
    const double fastest_mm_per_rad = FastestMmPerRad(portions, turn, calibration.axes);
    if (fastest_mm_per_rad == 0) return Vector6d(Vector6d::Zero());  // all on the axis
    const double step_rad = step_mm / fastest_mm_per_rad;
    const absl::StatusOr<PoseFit> moved = refit(Turned(portions, turn, step_rad, calibration.axes));
    if (!moved.ok()) return moved.status();
    if (!moved->placed)
      return absl::FailedPreconditionError(
          std::string(turn.axis == Axis::kA ? "a" : "b") +
          "_deg: " + (turn.commanded_rad ? std::to_string(*turn.commanded_rad * 180 / M_PI) : "all") +
          ", want a pose that stands when this angle is taken greater by " + Rounded(step_rad * 180 / M_PI) + " deg");
    return Vector6d(
        ChangeBetween(placed.zero_from_part, moved->placed->zero_from_part, placed.covariance.reference_mm) / step_rad);
  };
  std::vector<AngleInfluence> angles = TabledAngles(portions, calibration.positioning);
  for (const Axis axis : {Axis::kA, Axis::kB}) {
    Vector6d sum = Vector6d::Zero();
    std::vector<AngleInfluence*> of_axis;
    for (AngleInfluence& angle : angles) {
      if (angle.axis != axis) continue;
      const absl::StatusOr<Vector6d> influence = influence_of({axis, angle.commanded_rad});
      if (!influence.ok()) return influence.status();
      angle.pose_per_rad = *influence;
      sum += *influence;
      of_axis.push_back(&angle);
    }
    if (of_axis.size() < 2) continue;
    // Turned alike the scans go on agreeing, so this is the better known of the two.
    const absl::StatusOr<Vector6d> together = influence_of({axis, std::nullopt});
    if (!together.ok()) return together.status();
    for (AngleInfluence* angle : of_axis)
      angle->pose_per_rad += (*together - sum) / static_cast<double>(of_axis.size());
  }
  return angles;
}

}  // namespace sixpoint::metrology
