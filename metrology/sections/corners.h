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

struct CornerSearch {
  double noise_mm = 0;  // of a sample
  double clear_mm = 0;  // nearer to a corner it is not known to which side a point belongs
  bool exact = false;   // no noise: a side is its next few points, however near
};

// By at_mm. A parabola is fitted to either side of a place, over four spacings of the chain or as far as noise makes necessary to know
// directions to 3 deg. A corner is where the two differ by more than 35 deg and by more than noise explains, where no circle follows both
// sides about as well, and where both follow their points best. An end of a radius below two thirds of the reach may count as one.
std::vector<OutlineCorner> CornersOf(const PointChain& chain, const std::vector<FitPoint>& points, const LocalFit& fit,
                                     const CornerSearch& search);

}  // namespace sixpoint::metrology
