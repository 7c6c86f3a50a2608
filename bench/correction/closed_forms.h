// The inverse of two machines in closed form, written out from the papers: nothing here is the product's.
#pragma once

#include <Eigen/Core>
#include <array>

namespace sixpoint::bench {

using Commands = Eigen::Matrix<double, 5, 1>;

// A about Y carries B about X, both through c; X, Y, Z move the tool (CONF 3.5). A, B, X, Y, Z of both branches.
std::array<Commands, 2> OfAbTable(const Eigen::Vector3d& c_mm, const Eigen::Vector3d& tip_mm,
                                  const Eigen::Vector3d& axis);
// The one of them nearest to nominal, by whole turns.
Commands NearestOfAbTable(const Eigen::Vector3d& c_mm, const Eigen::Vector3d& tip_mm, const Eigen::Vector3d& axis,
                          double nominal_a_rad, double nominal_b_rad);

// X carries Y carries B (about Y, z12 below the origin) carries C (about Z); Z moves the tool (NRC, equation 3). X, Y, B, C, Z of both.
std::array<Commands, 2> OfTiltRotaryTable(double z12_mm, const Eigen::Vector3d& tip_mm, const Eigen::Vector3d& axis);

}  // namespace sixpoint::bench
