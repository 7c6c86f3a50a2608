#include "metrology/registration/angle_influence.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace sixpoint::metrology {
namespace {

using Axis = AngleInfluence::Axis;

double CommandOf(const ScanPortion& portion, Axis axis) {
  return axis == Axis::kA ? portion.commanded_a_rad : portion.commanded_b_rad;
}

bool SameCommand(double first_rad, double second_rad) { return std::abs(first_rad - second_rad) < kSameCommandRad; }

}  // namespace

std::vector<AngleInfluence> UncertainAngles(const std::vector<ScanPortion>& portions,
                                            const RotaryPositioning& positioning) {
  std::vector<AngleInfluence> angles;
  for (const Axis axis : {Axis::kA, Axis::kB}) {
    const AxisPositioning& positions = axis == Axis::kA ? positioning.a : positioning.b;
    if (!positions.table && !(positions.standard_uncertainty_rad > 0)) continue;
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

Eigen::MatrixXd MappingCovariance(const MachineCalibration& calibration, const std::vector<ScanPortion>& portions) {
  const Eigen::Index count = MappingParameterCount(portions.size());
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(count, count);
  covariance.topLeftCorner<kCalibrationParameterCount, kCalibrationParameterCount>() = CovarianceOf(calibration);
  const std::vector<AngleInfluence> angles = UncertainAngles(portions, calibration.positioning);
  if (angles.empty()) return covariance;
  const auto angle_count = static_cast<Eigen::Index>(angles.size());
  Eigen::MatrixXd taken_at = Eigen::MatrixXd::Zero(count, angle_count);  // each portion's a and b at which angle
  for (std::size_t p = 0; p < portions.size(); ++p)
    for (Eigen::Index i = 0; i < angle_count; ++i) {
      const AngleInfluence& angle = angles[static_cast<std::size_t>(i)];
      if (SameCommand(CommandOf(portions[p], angle.axis), angle.commanded_rad))
        taken_at(MappingParameterCount(p) + (angle.axis == Axis::kA ? 0 : 1), i) = 1;
    }
  return covariance + taken_at * ErrorCovariance(angles) * taken_at.transpose();
}

std::vector<AngleInfluence> InfluencesOf(std::vector<AngleInfluence> angles, const std::vector<ScanPortion>& portions,
                                         const PlacedPose& placed) {
  for (AngleInfluence& angle : angles) {
    angle.pose_per_rad.setZero();
    for (std::size_t p = 0; p < portions.size(); ++p)
      if (SameCommand(CommandOf(portions[p], angle.axis), angle.commanded_rad))
        angle.pose_per_rad +=
            placed.angle_sensitivity.col(2 * static_cast<Eigen::Index>(p) + (angle.axis == Axis::kA ? 0 : 1));
  }
  return angles;
}

}  // namespace sixpoint::metrology
