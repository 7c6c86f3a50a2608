#include "metrology/efficacy/crossed_variance.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace sixpoint::metrology {

CrossedVariance AnalyseCrossed(const std::vector<CrossedObservation>& observations) {
  CrossedVariance result;
  int blades = 0, holes = 0;
  for (const CrossedObservation& o : observations) {
    blades = std::max(blades, o.blade + 1);
    holes = std::max(holes, o.hole + 1);
  }
  if (blades == 0) return result;
  Eigen::MatrixXd incidence = Eigen::MatrixXd::Zero(blades, holes);
  Eigen::VectorXd of_blade = Eigen::VectorXd::Zero(blades), of_hole = Eigen::VectorXd::Zero(holes);
  Eigen::VectorXd blade_sums = of_blade;
  double all = 0;
  for (const CrossedObservation& o : observations) {
    incidence(o.blade, o.hole) += 1;
    of_hole[o.hole] += o.value;
    blade_sums[o.blade] += o.value;
    all += o.value * o.value;
  }
  const Eigen::VectorXd hole_counts = incidence.colwise().sum();
  const Eigen::VectorXd inverse = hole_counts.unaryExpr([](double n) { return n > 0 ? 1 / n : 0.0; });
  double squares = 0;
  for (const CrossedObservation& o : observations) {
    const double from_hole = o.value - of_hole[o.hole] * inverse[o.hole];
    squares += from_hole * from_hole;
    of_blade[o.blade] += from_hole;
  }
  // The blades' normal equations with the holes eliminated.
  Eigen::MatrixXd normal = -incidence * inverse.asDiagonal() * incidence.transpose();
  normal.diagonal() += incidence.rowwise().sum();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(normal);
  const double least = 1e-9 * std::max(1.0, eigen.eigenvalues().maxCoeff());
  double reduction = 0;
  for (int i = 0; i < blades; ++i) {
    if (eigen.eigenvalues()[i] <= least) continue;
    ++result.between_freedom;
    reduction += std::pow(eigen.eigenvectors().col(i).dot(of_blade), 2) / eigen.eigenvalues()[i];
  }
  const int seen_holes = static_cast<int>((hole_counts.array() > 0).count());
  result.within_freedom = static_cast<int>(observations.size()) - seen_holes - result.between_freedom;
  if (result.within_freedom < 1) return result;
  result.within_variance = std::max(0.0, squares - reduction) / result.within_freedom;
  if (result.between_freedom < 1) return result;
  const double between = (reduction - *result.within_variance * result.between_freedom) / normal.trace();
  result.between_negative = between < 0;
  result.between_variance = std::max(0.0, between);
  // The other way round: what the holes take off what is left within blades.
  const Eigen::VectorXd blade_counts = incidence.rowwise().sum();
  int seen_blades = 0;
  double within_blades = all;
  for (int i = 0; i < blades; ++i) {
    if (blade_counts[i] <= 0) continue;
    ++seen_blades;
    within_blades -= blade_sums[i] * blade_sums[i] / blade_counts[i];
  }
  result.hole_freedom = seen_holes + result.between_freedom - seen_blades;
  if (result.hole_freedom < 1) return result;
  const double of_holes = within_blades - std::max(0.0, squares - reduction);
  result.hole_variance = std::max(0.0, (of_holes - *result.within_variance * result.hole_freedom) /
                                           static_cast<double>(static_cast<int>(observations.size()) - seen_blades));
  return result;
}

}  // namespace sixpoint::metrology
