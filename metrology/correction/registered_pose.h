// A registered blade's pose with everything that made it uncertain, as correction and inspection propagate it
// (docs/methods/uncertainty.md, covariance of a pose).
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "metrology/frames/pose.h"
#include "metrology/kinematics/axis_positioning.h"
#include "metrology/kinematics/calibration_parameters.h"

namespace sixpoint::metrology {

// Where the blade stands at A = B = 0, and how well that is known. None by default: only a registration that converged makes
// one.
struct RegisteredPose {
  RegisteredPose(const Eigen::Isometry3d& zero_from_part_in, const PoseCovariance& noise_in,
                 const PoseSensitivity& sensitivity, const Eigen::Vector3d& sensitivity_reference_in_mm,
                 const CalibrationCovariance& calibrations)
      : zero_from_part(zero_from_part_in),
        noise(noise_in),
        calibration_sensitivity(sensitivity),
        sensitivity_reference_mm(sensitivity_reference_in_mm),
        calibration_covariance(calibrations) {}

  Eigen::Isometry3d zero_from_part;
  PoseCovariance noise;                     // from the scanner's noise and the model error
  PoseSensitivity calibration_sensitivity;  // about the reference
  Eigen::Vector3d sensitivity_reference_mm;
  CalibrationCovariance calibration_covariance;
  // The tables that its scans' angles were taken with, and those angles; about noise.reference_mm.
  RotaryPositioning positioning;
  std::vector<AngleInfluence> angles;
};

}  // namespace sixpoint::metrology
