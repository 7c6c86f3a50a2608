// What is known of how the two rotary axes position, for poses that are made from their commands
// (docs/methods/uncertainty.md, angles of scans).
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "metrology/frames/pose.h"
#include "metrology/kinematics/angle_table.h"

namespace sixpoint::metrology {

// One axis. Without a table it is taken to stand where it is commanded, as uncertain as its errors are. Where nobody states how it comes
// to its poses the mean of both ways is taken, and half of their difference stays uncertain.
struct AxisPositioning {
  std::optional<AngleTable> table = std::nullopt;
  // Of a reached angle whose travel is known: the table's and the scatter about it; without a table all that the axis is off.
  double standard_uncertainty_rad = 0;
  Travel approach = Travel::kUnknown;  // how it comes to every pose

  double Reached(double commanded_rad) const;
  // The command that reaches an angle.
  double CommandFor(double reached_rad) const;
  // Half of what coming forward differs from coming backward there; 0 without a table, and where the approach is known.
  double HalfReversalAt(double commanded_rad) const;
  // Of the angle that a command reaches.
  double StandardUncertaintyAt(double commanded_rad) const;
};

// Commands nearer than this are one: they have been through degrees.
inline constexpr double kSameCommandRad = 1e-9;

// Of RotaryAxes::a and b.
struct RotaryPositioning {
  AxisPositioning a, b;
  bool Applies() const { return a.table || b.table; }  // any table
  bool Uncertain() const { return Applies() || a.standard_uncertainty_rad > 0 || b.standard_uncertainty_rad > 0; }
};

// An angle that scans of a pose were taken at, where it is uncertain. Scans at one command share its error.
struct AngleInfluence {
  enum class Axis { kA, kB };
  Axis axis = Axis::kA;
  double commanded_rad = 0;
  double reached_rad = 0;
  double standard_uncertainty_rad = 0;  // of reached_rad, its travel known
  double half_reversal_rad = 0;
  // Change of the pose (order of PoseCovariance, about its reference) per radian that the angle is taken greater.
  Vector6d pose_per_rad = Vector6d::Zero();
};

// Of the angles' errors, in rad^2 and their order. Each scatters for itself; the reversal is common to an axis: one works
// round a part one way, and then all its angles are off alike.
Eigen::MatrixXd ErrorCovariance(const std::vector<AngleInfluence>& angles);
// What they make uncertain of the pose.
Matrix6d PoseCovarianceOf(const std::vector<AngleInfluence>& angles);

}  // namespace sixpoint::metrology
