#include "metrology/statistics/distance_quantile.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <random>

#include "metrology/statistics/standard_deviation.h"

namespace sixpoint::metrology {
namespace {

Eigen::Matrix3d Diagonal(double x, double y, double z) { return Eigen::Vector3d(x, y, z).asDiagonal(); }

// Tables of the chi distribution with 1, 2 and 3 degrees of freedom.
TEST(DistanceQuantile, IsTheChiDistributionsWhereVariancesAreEqual) {
  EXPECT_NEAR(DistanceQuantile(Diagonal(4, 0, 0), 0.95), 2 * 1.959963985, 1e-7);
  EXPECT_NEAR(DistanceQuantile(Diagonal(4, 4, 0), 0.95), 2 * 2.447746831, 1e-7);
  EXPECT_NEAR(DistanceQuantile(Diagonal(4, 4, 4), 0.95), 2 * 2.795483482, 1e-7);
  EXPECT_NEAR(DistanceQuantile(Diagonal(1, 1, 1), 0.5), 1.538172254, 1e-7);
}

TEST(DistanceQuantile, IsNothingForAPointThatIsKnown) { EXPECT_EQ(DistanceQuantile(Eigen::Matrix3d::Zero(), 0.95), 0); }

// A covariance that was never computed is no point that is known exactly.
TEST(DistanceQuantile, IsNoNumberOfWhatIsNone) {
  for (const double none : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    EXPECT_TRUE(std::isnan(DistanceQuantile(Diagonal(4, none, 0), 0.95)));
    EXPECT_TRUE(std::isnan(DistanceQuantile(Eigen::Matrix3d::Constant(none), 0.95)));
  }
}

TEST(StandardDeviation, IsTheRootAndKeepsWhatIsNoNumber) {
  EXPECT_EQ(StandardDeviation(4), 2);
  EXPECT_EQ(StandardDeviation(-1e-18), 0) << "rounding";
  EXPECT_TRUE(std::isnan(StandardDeviation(std::numeric_limits<double>::quiet_NaN())));
}

TEST(DistanceQuantile, HoldsTheStatedShareOfDraws) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  for (int shape = 0; shape < 5; ++shape) {
    Eigen::Matrix3d factor;
    for (int i = 0; i < 9; ++i) factor(i / 3, i % 3) = normal(random) * std::pow(10, -shape * (i % 3) / 2.0);
    const double radius = DistanceQuantile(factor * factor.transpose(), 0.95);
    constexpr int kDraws = 100000;
    int inside = 0;
    for (int i = 0; i < kDraws; ++i)
      inside += (factor * Eigen::Vector3d(normal(random), normal(random), normal(random))).norm() <= radius;
    // Four standard deviations of a share of 0.95 in that many draws.
    EXPECT_NEAR(static_cast<double>(inside) / kDraws, 0.95, 4 * std::sqrt(0.95 * 0.05 / kDraws));
  }
}

}  // namespace
}  // namespace sixpoint::metrology
