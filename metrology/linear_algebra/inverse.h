// Inverses of square matrices, and of positive definite ones through their Cholesky factor.
//
// The caller knows that the matrix has an inverse (a condition number, a part of the identity added); else what comes out is
// not finite. Thread-safe.
#pragma once

#include <Eigen/Core>

#include "metrology/frames/pose.h"

namespace sixpoint::metrology {

Eigen::MatrixXd Inverse(const Eigen::MatrixXd& matrix);
Matrix6d Inverse(const Matrix6d& matrix);

// matrix^-1 right of a positive definite matrix, through its factors L D L^T.
Eigen::VectorXd SolvePositiveDefinite(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& right);
Vector6d SolvePositiveDefinite(const Matrix6d& matrix, const Vector6d& right);

// A positive definite matrix U^T U, U upper triangular: x -> U x makes its unit ball round.
class CholeskyFactor {
 public:
  explicit CholeskyFactor(const Eigen::MatrixXd& matrix);
  Eigen::VectorXd Solve(const Eigen::VectorXd& right) const;         // matrix^-1 right
  Eigen::MatrixXd RowsByInverse(const Eigen::MatrixXd& rows) const;  // rows U^-1
  Eigen::VectorXd InverseTimes(const Eigen::VectorXd& round) const;  // U^-1 round

 private:
  Eigen::MatrixXd lower_, upper_;  // each as its solutions read it
};

}  // namespace sixpoint::metrology
