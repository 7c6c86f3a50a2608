#include "metrology/linear_algebra/inverse.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace sixpoint::metrology {

using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd Inverse(const MatrixXd& matrix) { return matrix.inverse(); }
Matrix6d Inverse(const Matrix6d& matrix) { return matrix.inverse(); }

VectorXd SolvePositiveDefinite(const MatrixXd& matrix, const VectorXd& right) { return matrix.ldlt().solve(right); }
Vector6d SolvePositiveDefinite(const Matrix6d& matrix, const Vector6d& right) { return matrix.ldlt().solve(right); }

CholeskyFactor::CholeskyFactor(const MatrixXd& matrix) {
  const Eigen::LLT<MatrixXd> factor(matrix);
  lower_ = factor.matrixL();
  upper_ = factor.matrixU();
}

VectorXd CholeskyFactor::Solve(const VectorXd& right) const {
  VectorXd solution = lower_.triangularView<Eigen::Lower>().solve(right);
  lower_.transpose().triangularView<Eigen::Upper>().solveInPlace(solution);
  return solution;
}

MatrixXd CholeskyFactor::RowsByInverse(const MatrixXd& rows) const {
  return upper_.transpose().triangularView<Eigen::Lower>().solve(rows.transpose()).transpose();
}

VectorXd CholeskyFactor::InverseTimes(const VectorXd& round) const {
  return upper_.triangularView<Eigen::Upper>().solve(round);
}

}  // namespace sixpoint::metrology
