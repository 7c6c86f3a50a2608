// Problems in some of the six directions in which a pose can change. Thread-safe.
#pragma once

#include <Eigen/Core>

#include "metrology/frames/pose.h"
#include "metrology/linear_algebra/symmetric.h"

namespace sixpoint::metrology {

// 6 x k, orthonormal columns: the directions that are free.
using PoseDirections = Eigen::Matrix<double, 6, Eigen::Dynamic>;

// k x k: D^T matrix D.
Eigen::MatrixXd Restricted(const Matrix6d& matrix, const PoseDirections& directions);

// D matrix D^T.
Matrix6d Embedded(const Eigen::MatrixXd& matrix, const PoseDirections& directions);

// The (pseudo-)inverse in these directions, 0 across them.
Matrix6d InverseIn(const Matrix6d& matrix, const PoseDirections& directions);

// SolveHeld (symmetric.h) in these directions, 0 across them.
Vector6d SolveHeldIn(const Matrix6d& matrix, const Vector6d& right, const PoseDirections& directions,
                     double least = kRounding);

}  // namespace sixpoint::metrology
