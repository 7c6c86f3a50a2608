#include "metrology/linear_algebra/pseudo_inverse.h"

#include <Eigen/LU>
#include <Eigen/QR>

namespace sixpoint::metrology {

using Eigen::MatrixXd;

MatrixXd PseudoInverse(const MatrixXd& matrix) { return matrix.completeOrthogonalDecomposition().pseudoInverse(); }

MatrixXd NullSpace(const MatrixXd& matrix) {
  const Eigen::FullPivLU<MatrixXd> lu(matrix);
  const Eigen::Index open = lu.dimensionOfKernel();
  if (open == 0) return MatrixXd(matrix.cols(), 0);
  return lu.kernel().householderQr().householderQ() * MatrixXd::Identity(matrix.cols(), open);
}

}  // namespace sixpoint::metrology
