// Symmetric matrices: eigenvalues, how well they hold a direction, and solving in the directions that they hold.
//
// Only the lower triangle is read. Nothing here fails: a matrix that is not finite gives values that are not finite, which
// compare false with every limit. Thread-safe.
#pragma once

#include <Eigen/Core>

#include "metrology/frames/pose.h"

namespace sixpoint::metrology {

// Eigenvalues ascending; the unit eigenvector of each in the column of its index.
struct EigenSystem {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};
EigenSystem EigenSystemOf(const Eigen::MatrixXd& matrix);

// The same, of six parameters.
struct EigenSystem6 {
  Vector6d values;
  Matrix6d vectors;
};
EigenSystem6 EigenSystemOf(const Matrix6d& matrix);

// F with F F^T = covariance, of one that need not be of full rank: a column an independent draw. What rounding makes negative counts as 0.
Eigen::MatrixXd FactorOf(const Eigen::MatrixXd& covariance);
Matrix6d FactorOf(const Matrix6d& covariance);

// Square root of greatest over smallest eigenvalue, at most 1e12.
double ConditionNumberOf(const Eigen::VectorXd& ascending_values);

// jacobian covariance jacobian^T: what a linear map makes of a covariance (JCGM 102, 6.2).
Eigen::MatrixXd Propagated(const Eigen::MatrixXd& jacobian, const Eigen::MatrixXd& covariance);

// Solves in the directions that the matrix holds, their eigenvalue above this part of the greatest; 0 in the others.
constexpr double kRounding = 1e-13;
Eigen::VectorXd SolveHeld(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& right, double least = kRounding);

}  // namespace sixpoint::metrology
