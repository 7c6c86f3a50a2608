// Singular values, descending, and their vectors, by Jacobi's method. Nothing here fails; a matrix that is not finite gives
// values that are not finite. Thread-safe.
#pragma once

#include <Eigen/Core>

namespace sixpoint::metrology {

Eigen::VectorXd SingularValues(const Eigen::MatrixXd& matrix);

// m x min(m, n), orthonormal columns, the greatest singular value's first.
Eigen::MatrixXd LeftSingularVectors(const Eigen::MatrixXd& matrix);

}  // namespace sixpoint::metrology
