#include "metrology/linear_algebra/singular_values.h"

#include <Eigen/SVD>

namespace sixpoint::metrology {

Eigen::VectorXd SingularValues(const Eigen::MatrixXd& matrix) { return matrix.jacobiSvd().singularValues(); }

Eigen::MatrixXd LeftSingularVectors(const Eigen::MatrixXd& matrix) {
  return matrix.jacobiSvd(Eigen::ComputeThinU).matrixU();
}

}  // namespace sixpoint::metrology
