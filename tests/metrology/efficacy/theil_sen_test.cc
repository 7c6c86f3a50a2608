#include "metrology/efficacy/theil_sen.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace sixpoint::metrology {
namespace {

std::vector<double> Times(std::size_t n) {
  std::vector<double> times(n);
  std::iota(times.begin(), times.end(), 0.0);
  return times;
}

int KendallSum(const std::vector<double>& values) {
  int sum = 0;
  for (std::size_t i = 0; i < values.size(); ++i)
    for (std::size_t j = i + 1; j < values.size(); ++j) sum += values[j] > values[i] ? 1 : -1;
  return sum;
}

TEST(TheilSen, AWildValueDoesNotMoveALine) {
  std::vector<double> values;
  for (const double t : Times(9)) values.push_back(3 + 0.25 * t);
  values[4] = 1000;
  const auto fitted = FitTheilSen(Times(9), values, 0.95);
  ASSERT_TRUE(fitted);
  EXPECT_NEAR(fitted->slope, 0.25, 1e-12);
}

// The oracle: every order of seven values.
TEST(TheilSen, TheProbabilityIsThatOfAllOrders) {
  const std::vector<double> seen = {1, 2, 4, 3, 7, 5, 6};
  std::vector<double> order = {1, 2, 3, 4, 5, 6, 7};
  double as_far = 0, all = 0;
  do {
    ++all;
    as_far += std::abs(KendallSum(order)) >= std::abs(KendallSum(seen)) ? 1 : 0;
  } while (std::next_permutation(order.begin(), order.end()));
  EXPECT_NEAR(FitTheilSen(Times(7), seen, 0.95)->p, as_far / all, 1e-12);
}

// Hollander and Wolfe, table of Kendall's K: of five, P(K >= 10) = 0.008, so that the bounds are the least and the greatest slope; of four
// nothing is below 2.5 %, and no slope is a bound.
TEST(TheilSen, OfFewTheBoundsAreOpenOrTheOutermost) {
  const auto five = FitTheilSen(Times(5), {0, 2, 3, 5, 9}, 0.95);
  ASSERT_TRUE(five && five->lower && five->upper);
  EXPECT_EQ(*five->lower, 1);
  EXPECT_EQ(*five->upper, 4);
  EXPECT_NEAR(five->p, 2.0 / 120, 1e-12);
  const auto four = FitTheilSen(Times(4), {0, 2, 3, 5}, 0.95);
  ASSERT_TRUE(four);
  EXPECT_FALSE(four->lower || four->upper);
  EXPECT_FALSE(FitTheilSen({1, 1, 1}, {1, 2, 3}, 0.95));
  EXPECT_FALSE(FitTheilSen({1, 2}, {1, 2}, 0.95));
}

// Exact and normal meet where the one passes into the other.
TEST(TheilSen, ManyGoByTheNormalDistribution) {
  std::vector<double> values;
  for (const double t : Times(60)) values.push_back(std::fmod(t * 37, 61) + 0.1 * t);
  const auto exact = FitTheilSen(Times(60), values, 0.95);
  values.push_back(std::fmod(60 * 37, 61) + 0.1 * 60);
  const auto normal = FitTheilSen(Times(61), values, 0.95);
  ASSERT_TRUE(exact && normal && exact->lower && normal->lower);
  EXPECT_NEAR(exact->p, normal->p, 0.25 * exact->p);  // and of one value more
  EXPECT_NEAR(*exact->lower, *normal->lower, 0.05);
}

}  // namespace
}  // namespace sixpoint::metrology
