#include "metrology/correction/start_uncertainty.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "metrology/kinematics/linear_axes.h"
#include "metrology/statistics/distance_quantile.h"
#include "metrology/statistics/standard_deviation.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

// What each source does to the chain's values, a column a draw: as they are found, less what the linear axes read of where they should be.
Eigen::MatrixXd ValuesPerSigma(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& values,
                               const ErrorSource& source) {
  Eigen::MatrixXd per_sigma = jacobian.leftCols(kPoseParameterCount) * source.pose_per_sigma +
                              jacobian.rightCols(kAxisParameterCount) *
                                  source.parameters_per_sigma.middleRows<kAxisParameterCount>(kFirstAxisParameter);
  const auto linear = source.parameters_per_sigma.middleRows<kLinearParameterCount>(kFirstLinearParameter);
  if (linear.isZero(0)) return per_sigma;
  for (Eigen::Index at = kBeforeStarts; at < values.size(); at += 3)
    per_sigma.middleRows<3>(at) -= LinearAxesJacobian(values.segment<3>(at)) * linear;
  return per_sigma;
}

// The hole's covariance from its parts, and what follows from it.
void SumUp(const std::vector<std::pair<const UncertaintyPart*, Eigen::Matrix3d>>& parts, CorrectedHole* hole) {
  constexpr double kUm2 = 1e6;
  hole->covariance_mm2.setZero();
  for (const auto& [part, covariance_mm2] : parts) {
    hole->covariance_mm2 += covariance_mm2;
    if (const double variance_um2 = kUm2 * covariance_mm2.trace(); variance_um2 > 0)
      hole->components.push_back({part->source, variance_um2, part->degrees_of_freedom});
  }
  std::stable_sort(hole->components.begin(), hole->components.end(),
                   [](const auto& one, const auto& other) { return one.variance > other.variance; });
  hole->degrees_of_freedom = EffectiveDegreesOfFreedom(hole->components);
  hole->expanded_uncertainty_um =
      1e3 * WideningOf(kStartProbability, hole->degrees_of_freedom, ComponentsOf(hole->covariance_mm2)) *
      DistanceQuantile(hole->covariance_mm2, kStartProbability);
}

}  // namespace

MovedChain Moved(const RegisteredPose& pose, const RotaryAxes& axes, const ChainParameters& change) {
  return {Perturbed(pose.zero_from_part, change.head<kPoseParameterCount>(), pose.noise.reference_mm),
          axes.Perturbed(change.tail<kAxisParameterCount>())};
}

absl::Status CheckFinite(const RegisteredPose& pose) {
  const bool sources_finite = std::all_of(pose.sources.begin(), pose.sources.end(), [](const ErrorSource& source) {
    return source.parameters_per_sigma.allFinite() && source.pose_per_sigma.allFinite() &&
           source.pose_per_sigma.cols() == source.parameters_per_sigma.cols();
  });
  if (pose.noise.values.allFinite() && sources_finite && pose.zero_from_part.matrix().allFinite())
    return absl::OkStatus();
  return Refuse("pose", "not finite", "a pose with finite covariances");
}

absl::StatusOr<Eigen::MatrixXd> ChainJacobian(
    Eigen::Index value_count, const std::function<absl::StatusOr<Eigen::VectorXd>(const ChainParameters&)>& chain) {
  Eigen::MatrixXd jacobian(value_count, kChainParameterCount);
  for (int k = 0; k < kChainParameterCount; ++k) {
    const bool angle =
        k < kPoseParameterCount
            ? k < 3
            : kAxisParameters[static_cast<std::size_t>(k - kPoseParameterCount)].unit == ParameterUnit::kRad;
    const double step = angle ? 1e-6 : 1e-4;
    ChainParameters change = ChainParameters::Zero();
    change[k] = step;
    const auto above = chain(change);
    const auto below = chain(-change);
    if (!above.ok()) return above.status();
    if (!below.ok()) return below.status();
    jacobian.col(k) = (*above - *below) / (2 * step);
  }
  return jacobian;
}

std::vector<UncertaintyPart> PartsOf(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& values,
                                     const RegisteredPose& pose) {
  const double known = std::numeric_limits<double>::infinity();
  const Eigen::MatrixXd per_pose = jacobian.leftCols(kPoseParameterCount);
  std::vector<UncertaintyPart> parts = {{"noise of the scans", known, per_pose, pose.noise.values}};
  if (!pose.angles.empty()) parts.push_back({"angles of the scans", known, per_pose, PoseCovarianceOf(pose.angles)});
  for (const ErrorSource& source : pose.sources) {
    const Eigen::Index draws = source.pose_per_sigma.cols();
    parts.push_back({source.name, source.degrees_of_freedom, ValuesPerSigma(jacobian, values, source),
                     Eigen::MatrixXd::Identity(draws, draws)});
  }
  return parts;
}

AngleUncertainty AngleUncertaintyOf(const std::vector<UncertaintyPart>& parts, const RotaryPositioning& positioning,
                                    const RotaryAngles& commanded) {
  const auto variance = [&](int row) {
    double sum = 0;
    for (const UncertaintyPart& part : parts) sum += part.Variance(row);
    return sum;
  };
  const Eigen::Vector2d turn_rad(positioning.a.StandardUncertaintyAt(commanded.a_rad),
                                 positioning.b.StandardUncertaintyAt(commanded.b_rad));
  AngleUncertainty result;
  result.turn_variance_rad2 = turn_rad.cwiseAbs2();
  result.a_rad = StandardDeviation(variance(0) + result.turn_variance_rad2[0]);
  result.b_rad = StandardDeviation(variance(1) + result.turn_variance_rad2[1]);
  result.tilt_rad = StandardDeviation(variance(2) + variance(3));
  return result;
}

void SumUpStart(const std::vector<UncertaintyPart>& parts, Eigen::Index first_row, const Drilling& drilling,
                const RotaryPositioning& positioning, const Eigen::Matrix<double, 3, 2>& moved_per_angle,
                const Eigen::Vector2d& turn_variance_rad2, CorrectedHole* hole) {
  const double known = std::numeric_limits<double>::infinity();
  const UncertaintyPart turning{"angles of the drilling", known, {}, {}};
  const UncertaintyPart tool{drilling.tool_offset_name, known, {}, {}};
  std::vector<std::pair<const UncertaintyPart*, Eigen::Matrix3d>> of_hole;
  of_hole.reserve(parts.size() + 2);
  for (const UncertaintyPart& part : parts) of_hole.emplace_back(&part, part.OfStart(first_row));
  if (drilling.tool_offset_mm > 0)
    of_hole.emplace_back(&tool, std::pow(drilling.tool_offset_mm, 2) * Eigen::Matrix3d::Identity());
  if (positioning.Uncertain())
    of_hole.emplace_back(&turning, moved_per_angle * turn_variance_rad2.asDiagonal() * moved_per_angle.transpose());
  SumUp(of_hole, hole);
}

}  // namespace sixpoint::metrology
