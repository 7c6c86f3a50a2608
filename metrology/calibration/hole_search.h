// Holes in a flat face of a raw cloud, without the record of where they are.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "metrology/calibration/artefact.h"

namespace sixpoint::metrology {

// A point this far below a face is in a hole.
constexpr double kBelowMm = 0.12;

// A reading seen from a flat face: its place in the face, and how far below it (negative: above).
struct Seen {
  Eigen::Vector2d at;
  double depth;
};

// A connected part of the face whose readings lie below it.
struct Region {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  size_t count = 0;
  bool slot = false;  // most of its points lie on a floor at the slots' depth
};

// Those no larger than the artefact's, those with the most readings first, at most 24. Holes that missing profiles or
// columns cut in two (up to 1.25 mm) count as one.
std::vector<Region> HolesBelow(const std::vector<Seen>& seen, const Artefact& artefact);

}  // namespace sixpoint::metrology
