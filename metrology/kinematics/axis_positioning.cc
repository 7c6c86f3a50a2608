#include "metrology/kinematics/axis_positioning.h"

#include <cmath>

namespace sixpoint::metrology {

double AxisPositioning::Reached(double commanded_rad) const {
  return table ? table->Reached(commanded_rad, approach) : commanded_rad;
}

double AxisPositioning::CommandFor(double reached_rad) const {
  return table ? table->CommandFor(reached_rad, approach) : reached_rad;
}

double AxisPositioning::HalfReversalAt(double commanded_rad) const {
  if (!table || approach != Travel::kUnknown) return 0;
  return (table->ErrorAt(commanded_rad, Travel::kForward) - table->ErrorAt(commanded_rad, Travel::kBackward)) / 2;
}

double AxisPositioning::StandardUncertaintyAt(double commanded_rad) const {
  return std::hypot(standard_uncertainty_rad, HalfReversalAt(commanded_rad));
}

Eigen::MatrixXd ErrorCovariance(const std::vector<AngleInfluence>& angles) {
  const auto count = static_cast<Eigen::Index>(angles.size());
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(count, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const AngleInfluence& first = angles[static_cast<size_t>(i)];
    for (Eigen::Index j = 0; j < count; ++j) {
      const AngleInfluence& second = angles[static_cast<size_t>(j)];
      if (first.axis == second.axis) covariance(i, j) = first.half_reversal_rad * second.half_reversal_rad;
    }
    covariance(i, i) += first.standard_uncertainty_rad * first.standard_uncertainty_rad;
  }
  return covariance;
}

Matrix6d PoseCovarianceOf(const std::vector<AngleInfluence>& angles) {
  Eigen::Matrix<double, 6, Eigen::Dynamic> changes(6, static_cast<Eigen::Index>(angles.size()));
  for (size_t i = 0; i < angles.size(); ++i) changes.col(static_cast<Eigen::Index>(i)) = angles[i].pose_per_rad;
  return changes * ErrorCovariance(angles) * changes.transpose();
}

}  // namespace sixpoint::metrology
