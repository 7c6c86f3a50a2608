// The rotary axes that carry the part, as identified lines in the machine frame at A = B = 0
// (docs/methods/frames.md, chain).
#pragma once

#include <Eigen/Geometry>

#include "metrology/kinematics/axis_line.h"
#include "metrology/kinematics/calibration_parameters.h"
#include "metrology/kinematics/joint_chain.h"

namespace sixpoint::metrology {

// The two rotary joints of a part side, from the bed outwards: a carries b. On the SARIX A turns about Y, B about X,
// nominally; the lines need not meet. It is a joint chain of fixed length, for kernels that turn many points.
struct RotaryAxes {
  AxisLine a{Eigen::Vector3d::UnitY(), Eigen::Vector3d::Zero()};
  AxisLine b{Eigen::Vector3d::UnitX(), Eigen::Vector3d::Zero()};

  // A part point at `zero` stands at machine_from_zero * p when the axes read (a, b).
  Eigen::Isometry3d MachineFromZero(double a_rad, double b_rad) const;

  // Change of the machine position of a zero point per axis parameter, in the order of kAxisParameters.
  Eigen::Matrix<double, 3, kAxisParameterCount> ParameterJacobian(const Eigen::Vector3d& point_in_zero_mm, double a_rad,
                                                                  double b_rad) const;

  // 3 x 2: the same per radian of a and of b.
  Eigen::Matrix<double, 3, 2> AngleJacobian(const Eigen::Vector3d& point_in_zero_mm, double a_rad, double b_rad) const;

  // The two rotary joints of the part's side, where there are just two; its linear joints at 0. FAILED_PRECONDITION else.
  static absl::StatusOr<RotaryAxes> Of(const JointChain& chain);

  // The axes after a perturbation in those parameters.
  RotaryAxes Perturbed(const Eigen::Matrix<double, kAxisParameterCount, 1>& perturbation) const;

  // How what they carry grows by warmth, at zero: about the axis that carries it, where the part is clamped.
  Eigen::Affine3d Growth(double ratio) const;

  // The point of the A axis nearest to the B axis.
  Eigen::Vector3d PointC() const;
};

}  // namespace sixpoint::metrology
