#include "metrology/linear_algebra/least_distance.h"

#include <absl/status/status.h>

#include <Eigen/Core>
#include <vector>

#include "metrology/linear_algebra/least_squares.h"

namespace sixpoint::metrology {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

absl::StatusOr<VectorXd> SolveNonNegative(const MatrixXd& a, const VectorXd& b,
                                          const std::function<bool()>& keep_going) {
  const Index count = a.cols();
  VectorXd x = VectorXd::Zero(count);
  std::vector<Index> held;  // columns whose element is positive
  std::vector<bool> is_held(static_cast<std::size_t>(count), false);
  const double tolerance = 1e-12 * std::max(1.0, b.norm()) * std::max(1e-300, a.colwise().norm().maxCoeff());
  for (Index round = 0; round < 3 * (count + a.rows()); ++round) {
    if (keep_going && !keep_going()) return absl::CancelledError("stopped by its caller");
    const VectorXd pull = a.transpose() * (b - a * x);
    Index best = -1;
    for (Index k = 0; k < count; ++k)
      if (!is_held[static_cast<std::size_t>(k)] && pull[k] > tolerance && (best < 0 || pull[k] > pull[best])) best = k;
    if (best < 0) break;
    held.push_back(best);
    is_held[static_cast<std::size_t>(best)] = true;
    bool first = true;
    for (;;) {
      MatrixXd columns(a.rows(), static_cast<Index>(held.size()));
      for (std::size_t k = 0; k < held.size(); ++k) columns.col(static_cast<Index>(k)) = a.col(held[k]);
      const VectorXd solved = LeastSquares(columns, b);
      // Rounding alone brought the newest in: there is nothing to gain.
      if (first && !(solved[static_cast<Index>(held.size()) - 1] > 0)) {
        is_held[static_cast<std::size_t>(held.back())] = false;
        held.pop_back();
        return x;
      }
      first = false;
      double step = 1;
      for (std::size_t k = 0; k < held.size(); ++k) {
        const double now = x[held[k]], then = solved[static_cast<Index>(k)];
        if (!(then > 0)) step = std::min(step, now / (now - then));
      }
      for (std::size_t k = 0; k < held.size(); ++k) x[held[k]] += step * (solved[static_cast<Index>(k)] - x[held[k]]);
      if (step >= 1) break;
      std::vector<Index> left;
      for (const Index k : held) {
        if (x[k] > 1e-15) {
          left.push_back(k);
        } else {
          x[k] = 0;
          is_held[static_cast<std::size_t>(k)] = false;
        }
      }
      held = std::move(left);
      if (held.empty()) break;
    }
  }
  return x;
}

absl::StatusOr<LeastDistance> SolveLeastDistance(const MatrixXd& g, const VectorXd& h,
                                                 const std::function<bool()>& keep_going) {
  const Index size = g.cols();
  MatrixXd e(size + 1, g.rows());
  e << g.transpose(), h.transpose();
  VectorXd f = VectorXd::Zero(size + 1);
  f[size] = 1;
  LeastDistance result;
  const absl::StatusOr<VectorXd> solved = SolveNonNegative(e, f, keep_going);
  if (!solved.ok()) return solved.status();
  const VectorXd& u = *solved;
  const VectorXd r = e * u - f;
  result.feasible = r.norm() > 1e-9;
  if (result.feasible) {
    result.x = -r.head(size) / r[size];
    result.multipliers = -u / r[size];
  } else {
    result.x = VectorXd::Zero(size);
    result.multipliers = u;
  }
  return result;
}

}  // namespace sixpoint::metrology
