#include "metrology/linear_algebra/least_squares.h"

#include <Eigen/QR>

namespace sixpoint::metrology {

using Eigen::MatrixXd;

Eigen::VectorXd LeastSquares(const MatrixXd& matrix, const Eigen::VectorXd& right) {
  return matrix.colPivHouseholderQr().solve(right);
}

MatrixXd InverseTriangle(const MatrixXd& matrix) {
  const Eigen::Index columns = matrix.cols();
  const MatrixXd triangle = matrix.householderQr().matrixQR().topRows(columns).triangularView<Eigen::Upper>();
  return triangle.triangularView<Eigen::Upper>().solve(MatrixXd::Identity(columns, columns).eval());
}

}  // namespace sixpoint::metrology
