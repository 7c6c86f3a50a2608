// A section's profile beside the nominal one: as it stands, and after it was fitted onto it in its plane.
//
// Section frame; mm and radians. Thread-safe.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "metrology/sections/outline.h"

namespace sixpoint::metrology {

struct ProfileBand {
  double least_mm = 0, greatest_mm = 0;  // deviation from the nominal, positive outward
  std::size_t least_node = 0, greatest_node = 0;
  double Width() const { return greatest_mm - least_mm; }
};

struct ProfileDeviation {
  std::vector<double> location_mm, form_mm;  // of each node of the measured outline: as it stands, and after the fit
  ProfileBand location, form;
  Eigen::Isometry2d nominal_from_measured = Eigen::Isometry2d::Identity();  // the fit: least squares along the outline
};

// What lies beside a gap of either outline is compared like all else; gaps of the measured one are not.
ProfileDeviation DeviationFrom(const Outline& nominal, const Outline& measured);

// Signed distance of a point from the outline, positive outside, and the outline's normal there.
double SignedDistance(const Outline& outline, const Eigen::Vector2d& point_mm, Eigen::Vector2d* normal);

}  // namespace sixpoint::metrology
