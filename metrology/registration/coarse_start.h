// Where the part may stand when nothing is known of its pose: turned in any way, its place unknown.
//
// Turns spread evenly over all (Alexa 2022, super-Fibonacci spirals); for each the part is placed so that what the scanner
// can see of it has the scan's centre of mass; a few steps of fitting on some hundreds of points; the best are fitted to the
// surface. It only has to come within a millimetre or so: FitToSurface goes on from there.
#pragma once

#include <string>
#include <vector>

#include "metrology/frames/pose.h"
#include "metrology/registration/fit_options.h"
#include "metrology/surface/surface.h"

namespace sixpoint::metrology {

struct CoarseStart {
  Eigen::Isometry3d zero_from_part = NotYet<Eigen::Isometry3d>();
  double spread_mm = 0;  // root mean square distance of the nearer half of the points
  std::string remark;    // two poses that fit as well: the part looks alike from both. Empty otherwise
};

// Only the scans say where the part stands. Turned as the nominal is or in any other way; in one of `other_turns` where
// there are any (zero_from_part). CANCELLED: keep_going said so.
absl::StatusOr<CoarseStart> FindCoarseStart(const Surface& surface, const std::vector<ScanPortion>& portions,
                                            const Eigen::Isometry3d& zero_from_part_nominal, const FitOptions& options,
                                            const std::vector<Eigen::Matrix3d>& other_turns = {});

}  // namespace sixpoint::metrology
