// Measured points near a section's plane, brought into it.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "metrology/frames/pose.h"
#include "metrology/surface/surface.h"

namespace sixpoint::metrology {

struct SectionSample {
  Eigen::Vector2d point_mm;  // section frame
  double beyond_mm = 0;      // that it still is off the plane, along its normal
  double lean = 0;           // of the CAD surface there (outline.h); 0 where none is given
};

struct SectionSamples {
  std::vector<SectionSample> samples;  // by place: in which order the points came does not matter
  std::int64_t not_finite_count = 0, far_from_surface_count = 0, too_flat_count = 0;
};

// Those within the half-width. With a surface each slides along it into the plane; what is farther from it than reach_mm, or where it
// leans by more than 60 deg from the plane's normal (a platform), is left out and counted. Without one it is dropped onto the plane, and
// what the lean does to it is the outline's to find.
SectionSamples SamplesNear(const Points& points_mm, const Eigen::Isometry3d& part_from_section, double half_width_mm,
                           const Surface* surface, double reach_mm, int thread_count);

}  // namespace sixpoint::metrology
