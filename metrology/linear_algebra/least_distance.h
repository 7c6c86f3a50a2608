// The shortest vector that satisfies linear inequalities (Lawson and Hanson 1974, chapters 20 and 23).
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <functional>

namespace sixpoint::metrology {

struct LeastDistance {
  bool feasible = false;
  Eigen::VectorXd x;  // of least length with g x >= h
  // Feasible: x = g^T multipliers. Else: g^T multipliers = 0 with h . multipliers > 0, which no x can satisfy. All >= 0,
  // at most as many positive as x has elements, and one more.
  Eigen::VectorXd multipliers;
};

// g: one inequality a row. CANCELLED: keep_going, asked in each round, said so.
absl::StatusOr<LeastDistance> SolveLeastDistance(const Eigen::MatrixXd& g, const Eigen::VectorXd& h,
                                                 const std::function<bool()>& keep_going = nullptr);

// Of least |a x - b| with x >= 0. CANCELLED as above.
absl::StatusOr<Eigen::VectorXd> SolveNonNegative(const Eigen::MatrixXd& a, const Eigen::VectorXd& b,
                                                 const std::function<bool()>& keep_going = nullptr);

}  // namespace sixpoint::metrology
