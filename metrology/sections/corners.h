// Corners of an outline: places where its direction jumps however near one looks.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "metrology/sections/local_fit.h"
#include "metrology/sections/point_chain.h"

namespace sixpoint::metrology {

struct OutlineCorner {
  double at_mm = 0;                                    // along the chain
  Eigen::Vector2d point_mm = Eigen::Vector2d::Zero();  // where the curves from both sides meet
};

// By at_mm. First where the chain's direction, continued from both sides in a straight line over its length, jumps by 35 deg; of these
// where the curves fitted to either side jump by 30, and no smooth curve follows both. A round end goes on from both sides without a jump.
// clear_mm: nearer to a corner it is not known to which side a point belongs. reach_mm: as far from it curves are fitted; an end of a
// smaller radius may count as a corner.
std::vector<OutlineCorner> CornersOf(const PointChain& chain, const LocalFit& fit, double clear_mm, double reach_mm);

}  // namespace sixpoint::metrology
