#include "metrology/linear_algebra/least_distance.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

namespace sixpoint::metrology {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// The conditions of Karush, Kuhn and Tucker say all: they hold at the shortest vector and nowhere else.
TEST(LeastDistance, ConditionsHoldOnRandomProblems) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal(0, 1);
  int infeasible = 0;
  for (int draw = 0; draw < 500; ++draw) {
    const int size = 2 + draw % 5, count = 1 + draw % 23;
    MatrixXd g(count, size);
    VectorXd h(count);
    for (int i = 0; i < count; ++i) {
      for (int k = 0; k < size; ++k) g(i, k) = normal(random);
      h[i] = normal(random);
    }
    const LeastDistance solved = *SolveLeastDistance(g, h);
    EXPECT_GE(solved.multipliers.minCoeff(), 0);
    if (solved.feasible) {
      const VectorXd slack = g * solved.x - h;
      EXPECT_GT(slack.minCoeff(), -1e-8) << draw;
      EXPECT_LT((solved.x - g.transpose() * solved.multipliers).norm(), 1e-8 * (1 + solved.x.norm())) << draw;
      EXPECT_LT(slack.cwiseProduct(solved.multipliers).cwiseAbs().maxCoeff(), 1e-7 * (1 + solved.x.squaredNorm()))
          << draw;
    } else {
      ++infeasible;
      // The proof: added up with these weights the inequalities say 0 >= something positive.
      EXPECT_LT((g.transpose() * solved.multipliers).norm(), 1e-8) << draw;
      EXPECT_GT(h.dot(solved.multipliers), 0.5) << draw;
    }
  }
  EXPECT_GT(infeasible, 50);
  EXPECT_LT(infeasible, 450);
}

TEST(LeastDistance, NothingToDoIsZero) {
  const LeastDistance solved = *SolveLeastDistance(MatrixXd::Identity(3, 3), VectorXd::Constant(3, -1));
  EXPECT_TRUE(solved.feasible);
  EXPECT_EQ(solved.x.norm(), 0);
}

TEST(LeastDistance, StopsInAnyRound) {
  const MatrixXd g = MatrixXd::Identity(5, 5);
  const VectorXd h = VectorXd::Ones(5);  // five rounds that find one more, and one that finds none
  int question_count = 0;
  const auto after = [&](int limit) {
    question_count = 0;
    return SolveLeastDistance(g, h, [&question_count, limit] { return question_count++ < limit; });
  };
  ASSERT_TRUE(after(100).ok());
  const int all = question_count;
  EXPECT_GE(all, 6);
  for (int limit = 0; limit < all; ++limit)
    EXPECT_EQ(after(limit).status().code(), absl::StatusCode::kCancelled) << limit;
}

}  // namespace
}  // namespace sixpoint::metrology
