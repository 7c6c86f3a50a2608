// Matrices that may lack rank: pseudo-inverses by complete orthogonal decomposition, and the directions that they leave open.
//
// Rank is told at rounding. Of several solutions it is the shortest. Thread-safe.
#pragma once

#include <Eigen/Core>

#include "metrology/frames/pose.h"

namespace sixpoint::metrology {

Eigen::MatrixXd PseudoInverse(const Eigen::MatrixXd& matrix);
Matrix6d PseudoInverse(const Matrix6d& matrix);

Vector6d ShortestSolution(const Matrix6d& matrix, const Vector6d& right);
Matrix6d ShortestSolutions(const Matrix6d& matrix, const Matrix6d& right);  // column by column
Eigen::Index RankOf(const Matrix6d& matrix);

// Orthonormal columns: the directions that the matrix takes to 0; none where it takes none there.
Eigen::MatrixXd NullSpace(const Eigen::MatrixXd& matrix);

}  // namespace sixpoint::metrology
