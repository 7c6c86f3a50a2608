// The least of a quadratic function over vectors without a negative element, by block principal pivoting (Judice and Pires 1994).
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <vector>

namespace sixpoint::metrology {

// x >= 0 of least x . q x / 2 - r . x, q symmetric and positive definite: where x is 0, q x >= r; elsewhere q x = r. positive: in, the
// elements thought to be positive (empty: none), which changes the time and never the result but by rounding; out, those that are.
// INTERNAL where q is not positive definite, or rounding lets no set stand.
absl::StatusOr<Eigen::VectorXd> SolveComplementary(const Eigen::MatrixXd& q, const Eigen::VectorXd& r,
                                                   std::vector<bool>* positive);

}  // namespace sixpoint::metrology
