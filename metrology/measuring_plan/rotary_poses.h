// Rotary angles that turn directions of the part towards the scanner, within the axes' limits: the inverse of the machine's chain
// (docs/methods/frames.md).
//
// Frames: zero. Units: radians. Pure and thread-safe; the same inputs give the same poses.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "metrology/kinematics/chain_solver.h"

namespace sixpoint::metrology {

// As commanded: of the joint on the bed, and of the one that it carries.
struct RotaryPose {
  double a_rad = 0, b_rad = 0;
};

// Of each direction both branches that are within the limits; where neither is, the angles within them that come nearest, where no more than the greatest
// tilt is left. In the order of the directions; those that stand like one before (within half a degree each) are left out.
std::vector<RotaryPose> PosesTowards(const ChainSolver& solver, const std::vector<Eigen::Vector3d>& directions_in_zero,
                                     double greatest_tilt_rad);

// How far the nearest angles leave the direction from the scanner's axis, whatever the limits.
double TiltWithoutLimits(const ChainSolver& solver, const Eigen::Vector3d& direction_in_zero);

// About `count` directions, evenly all around (Fibonacci's spiral).
std::vector<Eigen::Vector3d> DirectionsAround(int count);

}  // namespace sixpoint::metrology
