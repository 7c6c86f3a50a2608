// Holes in a flat face of a raw cloud, without the record of where they are.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "metrology/calibration/artefact.h"
#include "metrology/calibration/plane_search.h"

namespace sixpoint::metrology {

// A point this far below a face is in a hole.
constexpr double kBelowMm = 0.12;

// A reading seen from a flat face: its place in the face, and how far below it (negative: above).
struct FacePoint {
  Eigen::Vector2d at;
  double depth;
};

// Axes of a face: x along the scan direction.
struct FaceFrame {
  Plane plane;
  Eigen::Vector3d u, v;
  explicit FaceFrame(const Plane& p) : plane(p) {
    u = (Eigen::Vector3d::UnitX() - p.normal.x() * p.normal).normalized();
    v = p.normal.cross(u);
  }
  FacePoint See(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d d = p - plane.point;
    return {{u.dot(d), v.dot(d)}, -plane.normal.dot(d)};
  }
};

// A connected part of the face whose readings lie below it.
struct Recess {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  size_t count = 0;
  bool slot = false;  // most of its points lie on a floor at the slots' depth
};

// Those no larger than the artefact's, those with the most readings first, at most 24. Holes that missing profiles or
// columns cut in two (up to 1.25 mm) count as one.
std::vector<Recess> HolesBelow(const std::vector<FacePoint>& seen, const Artefact& artefact);

}  // namespace sixpoint::metrology
