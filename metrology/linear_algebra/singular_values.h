// Singular values, descending, and their vectors, by Jacobi's method: matrix = left diag(values) right^T. Nothing here fails; a matrix that is not finite gives
// values that are not finite. Thread-safe.
#pragma once

#include <Eigen/Core>

namespace sixpoint::metrology {

struct SingularValueDecomposition {
  Eigen::VectorXd values;  // min(m, n)
  Eigen::MatrixXd left;    // m x min(m, n), orthonormal columns
  Eigen::MatrixXd right;   // n x n, orthonormal: beyond the values, the directions that the matrix takes to 0
};
SingularValueDecomposition DecomposeSingular(const Eigen::MatrixXd& matrix);

Eigen::VectorXd SingularValues(const Eigen::MatrixXd& matrix);

// m x min(m, n), orthonormal columns, the greatest singular value's first.
Eigen::MatrixXd LeftSingularVectors(const Eigen::MatrixXd& matrix);

}  // namespace sixpoint::metrology
