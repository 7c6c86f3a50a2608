// A registered blade's pose with everything that made it uncertain, as correction and inspection propagate it
// (docs/methods/uncertainty.md, covariance of a pose).
#pragma once

#include <Eigen/Geometry>
#include <utility>
#include <vector>

#include "metrology/frames/pose.h"
#include "metrology/kinematics/axis_positioning.h"
#include "metrology/uncertainty/error_source.h"

namespace sixpoint::metrology {

// Where the blade stands at A = B = 0, and how well that is known. None by default: only a registration that converged makes
// one.
struct RegisteredPose {
  RegisteredPose(const Eigen::Isometry3d& zero_from_part_in, const PoseCovariance& noise_in,
                 std::vector<ErrorSource> sources_in)
      : zero_from_part(zero_from_part_in), noise(noise_in), sources(std::move(sources_in)) {}

  Eigen::Isometry3d zero_from_part;
  PoseCovariance noise;              // from the scanner's noise and the model error
  std::vector<ErrorSource> sources;  // what they do to the pose: about noise.reference_mm
  // The tables that its scans' angles were taken with, and those angles; about noise.reference_mm.
  RotaryPositioning positioning;
  std::vector<AngleInfluence> angles;
};

}  // namespace sixpoint::metrology
