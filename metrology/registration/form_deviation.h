// What a part's smooth deviation from its CAD does to a pose that is fitted to it (docs/methods/uncertainty.md, error sources).
#pragma once

#include <Eigen/Core>

#include "metrology/frames/pose.h"

namespace sixpoint::metrology {

// A normal field over the part's surface, as smooth as a casting's: correlated over 5, 10 or 20 mm, places whose normals look apart less
// alike. Draws of it with standard deviation 1, the same ones always, of each length in turn; those of a length add up to its covariance.
class FormDraws {
 public:
  static constexpr int kLengthCount = 3, kCount = kLengthCount * 64;
  // Of each draw at that place of the part, normal outwards.
  static Eigen::Matrix<double, kCount, 1> At(const Eigen::Vector3d& part_mm, const Eigen::Vector3d& normal);
};

// A root (six columns) of the covariance of what each draw does (a column a draw), each length as likely.
Matrix6d MeanRoot(const Eigen::Matrix<double, 6, FormDraws::kCount>& per_draw);

// A point of a fit: where it lies on the part, its row, what it counts, and how its distance follows what maps it.
struct FittedPoint {
  Eigen::Vector3d part_mm, normal;
  Vector6d row;
  double weight = 0;
  Eigen::RowVectorXd by_mapping;  // order of MappingSensitivity
};

// Adds up what each draw pulls at a pose, point by point.
class FormPull {
 public:
  // mapping: covariance of what maps the scans.
  explicit FormPull(const Eigen::MatrixXd& mapping);
  // One point in some is looked at, in place of those between.
  void Add(const FittedPoint& point);
  // A root (six columns) of the covariance of what the fit's solver (its normal matrix's inverse) makes of the sum of weighted rows times the
  // field, each length as likely. The field's standard deviation: what the residuals show beyond what calibrations and angles explain of them, and
  // what of it the fit has taken up; least_mm at least.
  Matrix6d Root(const Matrix6d& solver, double seen_mm, double least_mm) const;

 private:
  Eigen::Matrix<double, 6, FormDraws::kCount> pull_ = Eigen::Matrix<double, 6, FormDraws::kCount>::Zero();
  double weight_ = 0;
  int seen_count_ = 0;
  // The mapping as unit draws (columns): of each what it does to the pose's sums, and of all to the residuals' squares.
  Eigen::MatrixXd mapping_root_;
  Eigen::Matrix<double, 6, Eigen::Dynamic> mapping_pull_;
  double mapping_squares_ = 0;
};

}  // namespace sixpoint::metrology
