// Several parts beside each other in one fixture: which points are of the one at a station, and where it may stand at all
// (docs/methods/registration.md, stations).
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "metrology/frames/pose.h"
#include "metrology/registration/fit_options.h"
#include "metrology/registration/pose_fit.h"
#include "metrology/registration/scan_portion.h"
#include "metrology/surface/surface.h"

namespace sixpoint::metrology {

struct Station {
  Eigen::Isometry3d zero_from_part_nominal = NotYet<Eigen::Isometry3d>();
  double capture_mm = 0;                      // how far any of the part may stand from there
  std::vector<Eigen::Isometry3d> neighbours;  // zero_from_part_nominal of the parts at the other stations
};

// Leaves out of a scan what lies farther than capture_mm from the part at its nominal place, or nearer to a neighbour at its own. Returns of how
// many points, after thinning. The same on any number of threads.
std::int64_t LeaveOutOthers(const Surface& surface, const Station& station, int thread_count, ScanPortion* portion);

// Takes back a pose that is none of the part at that station. NOT_CONVERGED: some of it would stand farther from its nominal place than it may.
// TOO_LITTLE_OVERLAP: the scanner would have seen it through itself, as it sees the fixture that bears it; or less than a tenth of its surface is seen,
// regions_in aside: what is left of fixture, chips and neighbours where no part is clamped.
void HoldToStation(const Surface& surface, const std::vector<ScanPortion>& portions, const Station& station,
                   const FitOptions& options, PoseFit* fit);

}  // namespace sixpoint::metrology
