#include "metrology/statistics/ranks.h"

#include <gtest/gtest.h>

#include <random>

namespace sixpoint::metrology {
namespace {

TEST(Ranks, TheMedianOfAnEvenNumberLiesBetweenTheMiddleTwo) {
  EXPECT_EQ(Median({4, 1, 3, 2}), 2.5);
  EXPECT_EQ(UpperMedian({4, 1, 3, 2}), 3);
}

TEST(Ranks, TheMedianOfAnOddNumberIsTheMiddleOne) {
  EXPECT_EQ(Median({5, 1, 4}), 4);
  EXPECT_EQ(UpperMedian({5, 1, 4}), 4);
}

TEST(Ranks, NoValuesHaveNoSpread) {
  EXPECT_EQ(Median({}), 0);
  EXPECT_EQ(UpperMedian({}), 0);
  EXPECT_EQ(RobustSigma({}), 0);
}

TEST(Ranks, TheValueAtARankHasAsManyBeforeIt) {
  std::vector<float> values{9, 7, 5, 3, 1};
  for (std::size_t rank = 0; rank < values.size(); ++rank)
    EXPECT_EQ(AtRank(rank, &values), 1 + 2 * static_cast<float>(rank));
}

TEST(Ranks, WildValuesLeaveTheSpreadOfNormalOnesAlone) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal(100, 2);
  std::vector<double> values(40'000);
  for (double& value : values) value = normal(random);
  // Its standard error is 1.17 / sqrt(n), 0.6 % here.
  EXPECT_NEAR(RobustSigma(values), 2, 0.05);
  for (std::size_t i = 0; i < 400; ++i) values[i] = 1e9;  // 1 % of them move it by about as much
  EXPECT_NEAR(RobustSigma(values), 2, 0.1);
}

TEST(Ranks, MagnitudesAreAboutZero) { EXPECT_EQ(RobustSigmaOfMagnitudes({1, 2, 3}), 2 * kSigmaPerMad); }

}  // namespace
}  // namespace sixpoint::metrology
