// Blades drilled by a machine whose faults are known: the tool stands where it stands, and the part really turned by other angles than were
// commanded. Nothing is linearised, so that the kernel's model is held against what it approximates.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "metrology/efficacy/efficacy.h"

namespace sixpoint::metrology {

struct CutWorld {
  int blade_count = 12, holes_a_group = 4;
  Eigen::Vector3d offset_mm = Eigen::Vector3d::Zero();  // of the tool, machine frame
  double a_zero_rad = 0, b_zero_rad = 0;                // reached less commanded
  double blade_mm = 0.008, hole_mm = 0.006;             // standard deviations of a component
  double blade_rad = 2e-4, hole_rad = 8e-4;
  double drift_mm_a_day = 0;
  // Harsher than the model: blades' effects of Student's t with 4 degrees of freedom, holes noisier than others, their own systematic
  // effects, one in 40 six times as wild, one in seven not measured, blades of fewer groups.
  bool harsh = false;
  Eigen::Isometry3d part_from_other = Eigen::Isometry3d::Identity();  // the part's frame is another
};

std::vector<BladeOutcome> Cut(const CutWorld& world, std::uint64_t seed);

}  // namespace sixpoint::metrology
