// What it does to a pose that the CAD's faces do not meet somewhere (docs/methods/uncertainty.md, error sources).
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "metrology/frames/pose.h"
#include "metrology/registration/form_deviation.h"

namespace sixpoint::metrology {

// Standard uncertainty of a surface at a gap of its faces: between the two of them it is anywhere as likely, and the prepared surface in the
// middle, so the gap, of either face from it, is half of a rectangle's width (GUM 4.3.7).
inline double GapUncertainty(double gap_mm) { return gap_mm / std::sqrt(3.0); }

// Adds up, point by point, what each draw of a smooth field pulls at a pose, the field as uncertain as the gap where the point lies.
class GapPull {
 public:
  // weight: of the point in the fit; row: of its equation; normal: outward, part frame.
  void Add(double gap_mm, double weight, const Vector6d& row, const Eigen::Vector3d& part_mm,
           const Eigen::Vector3d& normal) {
    if (gap_mm > 0) pull_ += weight * GapUncertainty(gap_mm) * row * FormDraws::At(part_mm, normal).transpose();
  }
  // As FormPull's.
  Matrix6d Root(const Matrix6d& solver) const { return MeanRoot(solver * pull_); }

 private:
  Eigen::Matrix<double, 6, FormDraws::kCount> pull_ = Eigen::Matrix<double, 6, FormDraws::kCount>::Zero();
};

}  // namespace sixpoint::metrology
