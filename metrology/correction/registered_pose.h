// A registered blade's pose with everything that made it uncertain, as correction and inspection propagate it
// (docs/methods/uncertainty.md, covariance of a pose).
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "metrology/frames/pose.h"
#include "metrology/kinematics/axis_positioning.h"

namespace sixpoint::metrology {

// Order: sensor rotation vector (3, rad), T_sm (3, mm), the 8 axis parameters of RotaryAxes::ParameterJacobian.
using Matrix14d = Eigen::Matrix<double, 14, 14>;
using CalibrationSensitivity = Eigen::Matrix<double, 6, 14>;

// Where the blade stands at A = B = 0, and how well that is known.
struct RegisteredPose {
  Eigen::Isometry3d zero_from_part = Eigen::Isometry3d::Identity();
  PoseCovariance noise;  // from the scanner's noise alone
  // Change of the pose per change of the calibration parameters, in the order of PoseCovariance about the reference.
  CalibrationSensitivity calibration_sensitivity = CalibrationSensitivity::Zero();
  Eigen::Vector3d sensitivity_reference_mm = Eigen::Vector3d::Zero();
  Matrix14d calibration_covariance = Matrix14d::Zero();
  // The tables that its scans' angles were taken with, and those angles; about noise.reference_mm.
  RotaryPositioning positioning;
  std::vector<AngleInfluence> angles;
};

}  // namespace sixpoint::metrology
