// How a section shifts with height, where no surface says so: found from the points' own heights beyond the plane.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "metrology/sections/local_fit.h"
#include "metrology/sections/point_chain.h"

namespace sixpoint::metrology {

// A blade's lean, twist and taper: the section a millimetre higher is this one moved by an affine map.
struct LeanField {
  Eigen::Vector2d about_mm = Eigen::Vector2d::Zero(), shift = Eigen::Vector2d::Zero();
  Eigen::Matrix2d by_place = Eigen::Matrix2d::Zero();  // per mm
  double scatter = 0;                                  // what pieces of the outline lean otherwise, root mean square
  double noise_mm = 0;                                 // of a sample beside a curve, once its lean is taken off: median

  Eigen::Vector2d At(const Eigen::Vector2d& point_mm) const { return shift + by_place * (point_mm - about_mm); }
};

// From curves fitted to pieces of the chain's points (which know no lean yet). Zero where the points do not tell.
LeanField LeanOf(const PointChain& chain, const LocalFit& fit);

}  // namespace sixpoint::metrology
