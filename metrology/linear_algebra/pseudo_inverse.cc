#include "metrology/linear_algebra/pseudo_inverse.h"

#include <Eigen/LU>
#include <Eigen/QR>

namespace sixpoint::metrology {

using Eigen::MatrixXd;

MatrixXd PseudoInverse(const MatrixXd& matrix) { return matrix.completeOrthogonalDecomposition().pseudoInverse(); }
Matrix6d PseudoInverse(const Matrix6d& matrix) { return matrix.completeOrthogonalDecomposition().pseudoInverse(); }

Vector6d ShortestSolution(const Matrix6d& matrix, const Vector6d& right) {
  return matrix.completeOrthogonalDecomposition().solve(right);
}

Matrix6d ShortestSolutions(const Matrix6d& matrix, const Matrix6d& right) {
  return matrix.completeOrthogonalDecomposition().solve(right);
}

Eigen::Index RankOf(const Matrix6d& matrix) { return matrix.completeOrthogonalDecomposition().rank(); }

MatrixXd NullSpace(const MatrixXd& matrix) {
  const Eigen::FullPivLU<MatrixXd> lu(matrix);
  const Eigen::Index open = lu.dimensionOfKernel();
  if (open == 0) return MatrixXd(matrix.cols(), 0);
  return lu.kernel().householderQr().householderQ() * MatrixXd::Identity(matrix.cols(), open);
}

}  // namespace sixpoint::metrology
