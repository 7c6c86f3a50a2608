// Linear least squares of full rank: m rows, n <= m columns, a right side of m values, a solution of n. Thread-safe.
#pragma once

#include <Eigen/Core>

namespace sixpoint::metrology {

// By QR with column pivots. What the matrix does not determine (by its rank at rounding) is 0.
Eigen::VectorXd LeastSquares(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& right);

// R^-1 of matrix = Q R: the solution's covariance for right sides of variance 1 is R^-1 R^-T.
Eigen::MatrixXd InverseTriangle(const Eigen::MatrixXd& matrix);

}  // namespace sixpoint::metrology
