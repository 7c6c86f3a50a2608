#include "metrology/linear_algebra/symmetric.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace sixpoint::metrology {

EigenSystem EigenSystemOf(const Eigen::MatrixXd& matrix) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(matrix);
  return {eigen.eigenvalues(), eigen.eigenvectors()};
}

EigenSystem6 EigenSystemOf(const Matrix6d& matrix) {
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(matrix);
  return {eigen.eigenvalues(), eigen.eigenvectors()};
}

Eigen::MatrixXd FactorOf(const Eigen::MatrixXd& covariance) {
  const EigenSystem eigen = EigenSystemOf(covariance);
  return eigen.vectors * eigen.values.cwiseMax(0).cwiseSqrt().asDiagonal();
}

Matrix6d FactorOf(const Matrix6d& covariance) {
  const EigenSystem6 eigen = EigenSystemOf(covariance);
  return eigen.vectors * eigen.values.cwiseMax(0).cwiseSqrt().asDiagonal();
}

double ConditionNumberOf(const Eigen::VectorXd& ascending_values) {
  const double low = ascending_values[0], high = ascending_values[ascending_values.size() - 1];
  return low > high * 1e-24 ? std::min(1e12, std::sqrt(high / low)) : 1e12;
}

Eigen::MatrixXd Propagated(const Eigen::MatrixXd& jacobian, const Eigen::MatrixXd& covariance) {
  return jacobian * covariance * jacobian.transpose();
}

Eigen::VectorXd SolveHeld(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& right, double least) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(matrix);
  const double floor = least * eigen.eigenvalues()[matrix.cols() - 1];
  Eigen::VectorXd solution = Eigen::VectorXd::Zero(right.size());
  for (Eigen::Index k = 0; k < matrix.cols(); ++k) {
    const double value = eigen.eigenvalues()[k];
    if (value > floor) solution += eigen.eigenvectors().col(k).dot(right) / value * eigen.eigenvectors().col(k);
  }
  return solution;
}

}  // namespace sixpoint::metrology
