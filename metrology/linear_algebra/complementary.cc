#include "metrology/linear_algebra/complementary.h"

#include <absl/status/status.h>

#include <Eigen/Cholesky>
#include <algorithm>

namespace sixpoint::metrology {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kTries = 3;        // rounds in which all that is wrong may change sides without fewer being wrong
constexpr double kHeld = 1e-10;  // of the scale: below it an element or a gap counts as 0
constexpr double kHeldBack = 1e-14;
constexpr Index kBlockRounds = 60;  // then one by one, which rounding cannot send round in a circle

// x on the set, its gap q x - r elsewhere. False where the set's matrix has no factor.
bool SolveOn(const MatrixXd& q, const VectorXd& r, const std::vector<Index>& set, VectorXd* x, VectorXd* gap) {
  x->setZero(r.size());
  *gap = -r;
  if (set.empty()) return true;
  const auto size = static_cast<Index>(set.size());
  MatrixXd part(size, size), columns(r.size(), size);
  VectorXd right(size);
  for (Index i = 0; i < size; ++i) {
    columns.col(i) = q.col(set[static_cast<std::size_t>(i)]);
    right[i] = r[set[static_cast<std::size_t>(i)]];
  }
  for (Index i = 0; i < size; ++i) part.row(i) = columns.row(set[static_cast<std::size_t>(i)]);
  Eigen::LLT<MatrixXd> factor(part);
  // What rounding made indefinite is held by a little more; the steps after take its effect off.
  for (double more = kHeldBack; factor.info() != Eigen::Success && more < 1e3 * kHeldBack; more *= 10) {
    MatrixXd held = part;
    held.diagonal().array() += more * part.diagonal().cwiseAbs().maxCoeff();
    factor.compute(held);
  }
  if (factor.info() != Eigen::Success) return false;
  VectorXd solved = factor.solve(right);
  for (int again = 0; again < 2; ++again) solved += factor.solve(right - part * solved);
  gap->noalias() += columns * solved;
  for (Index i = 0; i < size; ++i) (*x)[set[static_cast<std::size_t>(i)]] = solved[i];
  return solved.allFinite();
}

// Lawson and Hanson's way, from the set: what is minimised falls in every round.
absl::StatusOr<VectorXd> OneByOne(const MatrixXd& q, const VectorXd& r, std::vector<bool>* positive) {
  const Index size = r.size();
  const double gap_zero = kHeld * std::max(1e-300, r.cwiseAbs().maxCoeff());
  VectorXd x = VectorXd::Zero(size), solved, gap;
  std::vector<bool> barred(static_cast<std::size_t>(size), false);  // that rounding alone would bring in
  Index newest = -1;
  for (Index round = 0; round < 6 * size + 60; ++round) {
    for (;;) {
      std::vector<Index> set;
      for (Index i = 0; i < size; ++i)
        if ((*positive)[static_cast<std::size_t>(i)]) set.push_back(i);
      if (!SolveOn(q, r, set, &solved, &gap)) return absl::InternalError("the matrix is not positive definite");
      if (newest >= 0 && !(solved[newest] > 0)) {
        (*positive)[static_cast<std::size_t>(newest)] = false;
        barred[static_cast<std::size_t>(newest)] = true;
        newest = -1;
        continue;
      }
      if (newest >= 0) std::fill(barred.begin(), barred.end(), false);
      newest = -1;
      double step = 1;
      for (const Index i : set)
        if (!(solved[i] > 0)) step = std::min(step, x[i] / std::max(1e-300, x[i] - solved[i]));
      if (step >= 1) break;
      x += step * (solved - x);
      for (const Index i : set)
        if (!(solved[i] > 0) && x[i] <= kHeld * x.maxCoeff()) {
          x[i] = 0;
          (*positive)[static_cast<std::size_t>(i)] = false;
        }
    }
    x = solved;
    for (Index i = 0; i < size; ++i)
      if (!(*positive)[static_cast<std::size_t>(i)] && !barred[static_cast<std::size_t>(i)] && gap[i] < -gap_zero &&
          (newest < 0 || gap[i] < gap[newest]))
        newest = i;
    if (newest < 0) return x;
    (*positive)[static_cast<std::size_t>(newest)] = true;
  }
  return absl::InternalError("no set of positive elements stands");
}

}  // namespace

absl::StatusOr<VectorXd> SolveComplementary(const MatrixXd& q, const VectorXd& r, std::vector<bool>* positive) {
  const Index size = r.size();
  positive->resize(static_cast<std::size_t>(size), false);
  const double gap_zero = kHeld * std::max(1e-300, r.cwiseAbs().maxCoeff());
  VectorXd x, gap;
  Index fewest = size + 1;
  int tries = kTries;
  for (Index round = 0; round < kBlockRounds; ++round) {
    std::vector<Index> set;
    for (Index i = 0; i < size; ++i)
      if ((*positive)[static_cast<std::size_t>(i)]) set.push_back(i);
    if (!SolveOn(q, r, set, &x, &gap)) break;
    const double x_zero = kHeld * x.cwiseAbs().maxCoeff();
    std::vector<Index> wrong;
    for (Index i = 0; i < size; ++i)
      if ((*positive)[static_cast<std::size_t>(i)] ? x[i] < -x_zero : gap[i] < -gap_zero) wrong.push_back(i);
    if (wrong.empty()) return x.cwiseMax(0).eval();
    const auto count = static_cast<Index>(wrong.size());
    if (count < fewest) {
      fewest = count;
      tries = kTries;
    } else if (tries > 0) {
      --tries;
    } else {
      wrong = {wrong.back()};
    }
    for (const Index i : wrong) (*positive)[static_cast<std::size_t>(i)] = !(*positive)[static_cast<std::size_t>(i)];
  }
  return OneByOne(q, r, positive);
}

}  // namespace sixpoint::metrology
