#include "services/registration/drawn_holes.h"

#include <algorithm>

namespace sixpoint::registration {
namespace {

// Of the diameter: on the axis of a hole that is drawn its wall is half of it away, and in the solid nothing is outside.
constexpr double kUnder = 0.5, kLeastOutside = 0.25;

}  // namespace

int CountDrawnHoles(const plant::v1::Part& part, const metrology::Surface& surface) {
  int count = 0;
  for (const plant::v1::HoleGroup& group : part.hole_groups()) {
    const Eigen::Vector3d axis(group.axis_in_part().x(), group.axis_in_part().y(), group.axis_in_part().z());
    const double under_mm = std::min(kUnder * group.diameter_mm(), group.depth_mm() / 2);
    for (const plant::v1::Hole& hole : group.holes()) {
      const auto& start = hole.start_in_part_mm();
      const Eigen::Vector3d within = Eigen::Vector3d(start.x_mm(), start.y_mm(), start.z_mm()) - under_mm * axis;
      if (surface.Closest(within).signed_distance_mm > kLeastOutside * group.diameter_mm()) ++count;
    }
  }
  return count;
}

}  // namespace sixpoint::registration
