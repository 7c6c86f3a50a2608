#include "metrology/linear_algebra/singular_values.h"

#include <Eigen/SVD>

namespace sixpoint::metrology {

SingularValueDecomposition DecomposeSingular(const Eigen::MatrixXd& matrix) {
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(matrix, Eigen::ComputeThinU | Eigen::ComputeFullV);
  return {svd.singularValues(), svd.matrixU(), svd.matrixV()};
}

Eigen::VectorXd SingularValues(const Eigen::MatrixXd& matrix) { return matrix.jacobiSvd().singularValues(); }

Eigen::MatrixXd LeftSingularVectors(const Eigen::MatrixXd& matrix) {
  return matrix.jacobiSvd(Eigen::ComputeThinU).matrixU();
}

}  // namespace sixpoint::metrology
