#include "metrology/linear_algebra/pose_directions.h"

#include "metrology/linear_algebra/pseudo_inverse.h"

namespace sixpoint::metrology {

Eigen::MatrixXd Restricted(const Matrix6d& matrix, const PoseDirections& directions) {
  return directions.transpose() * matrix * directions;
}

Matrix6d Embedded(const Eigen::MatrixXd& matrix, const PoseDirections& directions) {
  return directions * matrix * directions.transpose();
}

Matrix6d InverseIn(const Matrix6d& matrix, const PoseDirections& directions) {
  return Embedded(PseudoInverse(Restricted(matrix, directions)), directions);
}

Vector6d SolveHeldIn(const Matrix6d& matrix, const Vector6d& right, const PoseDirections& directions, double least) {
  return directions * SolveHeld(Restricted(matrix, directions), directions.transpose() * right, least);
}

}  // namespace sixpoint::metrology
