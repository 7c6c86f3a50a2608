// A section as the envelope of circles on a camber line, closed by its ends (docs/methods/repair.md).
//
// Section frame, mm. Thread-safe.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "metrology/repair/section_deviation.h"

namespace sixpoint::metrology {

// A circle of the target, with what is uncertain of it: standard deviations of its centre across the camber line and of its radius.
struct TargetCircle {
  Eigen::Vector2d centre_mm = Eigen::Vector2d::Zero();
  double radius_mm = 0;
  double across_sigma_mm = 0, radius_sigma_mm = 0;
};

struct TargetSection {
  double z_mm = 0;
  Outline outline;
  std::vector<double> standard_mm;  // of each node: standard uncertainty along its normal
};

// How far an end reaches beyond the nominal one.
struct TargetEnd {
  double outward_mm = 0, sigma_mm = 0;
};

// Circles from leading to trailing, at the nominal section's stations. Beyond the first and the last one stands the nominal end, moved and grown as
// its contacts with those circles and its tip are.
TargetSection EnvelopeWithEnds(const std::vector<TargetCircle>& circles, const BladeSection& nominal,
                               const TargetEnd& leading, const TargetEnd& trailing);

// The section moved as a whole; the motion's standard deviations are added to its nodes'.
TargetSection MovedWhole(const TargetSection& section, const PlaneMotion& motion, const PlaneMotion& sigma,
                         const Eigen::Vector2d& pivot_mm);

// Closed by the arcs of the first and the last circle: as published. end_sigma_mm: of how far they reach.
TargetSection EnvelopeWithArcs(const std::vector<TargetCircle>& circles, double z_mm, double leading_sigma_mm,
                               double trailing_sigma_mm);

}  // namespace sixpoint::metrology
