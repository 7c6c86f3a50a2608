#include <Eigen/QR>

#include "metrology/linear_algebra/pseudo_inverse.h"

namespace sixpoint::metrology {

Matrix6d PseudoInverse(const Matrix6d& matrix) { return matrix.completeOrthogonalDecomposition().pseudoInverse(); }

Vector6d ShortestSolution(const Matrix6d& matrix, const Vector6d& right) {
  return matrix.completeOrthogonalDecomposition().solve(right);
}

Matrix6d ShortestSolutions(const Matrix6d& matrix, const Matrix6d& right) {
  return matrix.completeOrthogonalDecomposition().solve(right);
}

Eigen::Index RankOf(const Matrix6d& matrix) { return matrix.completeOrthogonalDecomposition().rank(); }

}  // namespace sixpoint::metrology
