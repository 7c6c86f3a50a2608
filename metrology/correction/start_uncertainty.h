// How uncertain a corrected start is, whatever computed it: the whole chain from the pose and the axes to it, differentiated and spread by
// its sources (docs/methods/uncertainty.md, hole start).
//
// Frames: zero, machine. Units: mm and radians. Pure; the same inputs give the same bits.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "metrology/correction/correct.h"

namespace sixpoint::metrology {

// What moves the estimates: the pose (order of PoseCovariance) and the axes (kAxisParameters).
inline constexpr int kPoseParameterCount = 6;
inline constexpr int kChainParameterCount = kPoseParameterCount + kAxisParameterCount;
using ChainParameters = Eigen::Matrix<double, kChainParameterCount, 1>;

// Of a chain's values the first: a and b as reached, x and y of the turned direction. Then x, y, z of every start, machine.
inline constexpr Eigen::Index kBeforeStarts = 4;

// A quarter: of the gate's third, the rest is left for what uncertainty adds.
inline double AllowedTiltOf(double inclination_tolerance_rad) { return inclination_tolerance_rad / 4; }

// Pose and axes, had they been found moved by these parameters.
struct MovedChain {
  Eigen::Isometry3d zero_from_part;
  RotaryAxes axes;
};
MovedChain Moved(const RegisteredPose& pose, const RotaryAxes& axes, const ChainParameters& change);

// INVALID_ARGUMENT: a pose or a source that is not finite.
absl::Status CheckFinite(const RegisteredPose& pose);

// values.size() x kChainParameterCount, by central differences of the whole chain: it is so nearly linear over these steps that their
// error (about 1e-10) is nothing beside the covariances. The chain's statuses.
absl::StatusOr<Eigen::MatrixXd> ChainJacobian(
    Eigen::Index value_count, const std::function<absl::StatusOr<Eigen::VectorXd>(const ChainParameters&)>& chain);

// A named cause's part of the values' covariance: slope * causes * slope^T. Never made as a whole: there may be thousands of starts.
struct UncertaintyPart {
  std::string source;
  double degrees_of_freedom;
  Eigen::MatrixXd slope, causes;

  double Variance(Eigen::Index row) const { return (slope.row(row) * causes * slope.row(row).transpose()).value(); }
  Eigen::Matrix3d OfStart(Eigen::Index first_row) const {
    return slope.middleRows<3>(first_row) * causes * slope.middleRows<3>(first_row).transpose();
  }
};
std::vector<UncertaintyPart> PartsOf(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& values,
                                     const RegisteredPose& pose);

// Of the reached angles, and of the tilt that they leave.
struct AngleUncertainty {
  Eigen::Vector2d turn_variance_rad2 = Eigen::Vector2d::Zero();  // of what the commands reach, by positioning alone
  double a_rad = 0, b_rad = 0, tilt_rad = 0;
};
AngleUncertainty AngleUncertaintyOf(const std::vector<UncertaintyPart>& parts, const RotaryPositioning& positioning,
                                    const RotaryAngles& commanded);

inline constexpr double kStartProbability = 0.95;  // of its expanded uncertainty
// The start whose values begin at first_row: its covariance, budget and expanded uncertainty, with what drilling adds.
void SumUpStart(const std::vector<UncertaintyPart>& parts, Eigen::Index first_row, const Drilling& drilling,
                const RotaryPositioning& positioning, const Eigen::Matrix<double, 3, 2>& moved_per_angle,
                const Eigen::Vector2d& turn_variance_rad2, CorrectedHole* hole);

}  // namespace sixpoint::metrology
