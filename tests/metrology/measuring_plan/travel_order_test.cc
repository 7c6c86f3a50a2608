#include "metrology/measuring_plan/travel_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

namespace sixpoint::metrology {
namespace {

// Two coordinates and a way back that costs more: no symmetry to lean on.
Eigen::MatrixXd RandomCost(int count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0, 100);
  std::vector<Eigen::Vector2d> places;
  for (int i = 0; i < count; ++i) places.emplace_back(uniform(random), uniform(random));
  Eigen::MatrixXd cost(count, count);
  for (int i = 0; i < count; ++i)
    for (int j = 0; j < count; ++j)
      cost(i, j) = (places[i] - places[j]).norm() + std::max(0.0, places[j].x() - places[i].x());
  return cost;
}

bool VisitsEachOnce(std::vector<int> order, int count) {
  std::sort(order.begin(), order.end());
  std::vector<int> all(static_cast<std::size_t>(count));
  std::iota(all.begin(), all.end(), 0);
  return order == all;
}

TEST(TravelOrder, OfFewIsTheBestOfAllOrders) {
  for (int count = 1; count <= 7; ++count)
    for (unsigned seed = 0; seed < 20; ++seed) {
      const Eigen::MatrixXd cost = RandomCost(count, seed);
      std::vector<int> order(static_cast<std::size_t>(count));
      std::iota(order.begin(), order.end(), 0);
      double least = std::numeric_limits<double>::infinity();
      do least = std::min(least, TravelOf(order, cost));
      while (std::next_permutation(order.begin(), order.end()));
      const std::vector<int> found = ShortOrder(cost);
      EXPECT_TRUE(VisitsEachOnce(found, count));
      EXPECT_NEAR(TravelOf(found, cost), least, 1e-9) << count << " places, seed " << seed;
    }
}

// On a line no way is shorter than from one end to the other.
TEST(TravelOrder, OfManyOnALineGoesFromEndToEnd) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(0, 100);
    const int count = 40;
    std::vector<double> places;
    for (int i = 0; i < count; ++i) places.push_back(uniform(random));
    Eigen::MatrixXd cost(count, count);
    for (int i = 0; i < count; ++i)
      for (int j = 0; j < count; ++j) cost(i, j) = std::abs(places[i] - places[j]);
    const auto [low, high] = std::minmax_element(places.begin(), places.end());
    EXPECT_NEAR(TravelOf(ShortOrder(cost), cost), *high - *low, 1e-9);
  }
}

// No piece of it turned round, and no place of it elsewhere, makes it shorter.
TEST(TravelOrder, OfManyIsNotBetteredByOneChange) {
  const int count = 30;
  const Eigen::MatrixXd cost = RandomCost(count, 7);
  const std::vector<int> found = ShortOrder(cost);
  ASSERT_TRUE(VisitsEachOnce(found, count));
  const double least = TravelOf(found, cost);
  for (int i = 0; i < count; ++i)
    for (int j = 0; j < count; ++j) {
      std::vector<int> turned = found, moved = found;
      if (i < j) std::reverse(turned.begin() + i, turned.begin() + j + 1);
      moved.erase(moved.begin() + i);
      moved.insert(moved.begin() + std::min(j, count - 1), found[static_cast<std::size_t>(i)]);
      EXPECT_GE(TravelOf(turned, cost), least - 1e-9);
      EXPECT_GE(TravelOf(moved, cost), least - 1e-9);
    }
}

// Sixteen stations, four by four: the best way goes through them row by row.
TEST(TravelOrder, OfAGridIsItsShortestWay) {
  Eigen::MatrixXd cost(16, 16);
  for (int i = 0; i < 16; ++i)
    for (int j = 0; j < 16; ++j) cost(i, j) = std::hypot(i % 4 - j % 4, i / 4 - j / 4);
  EXPECT_NEAR(TravelOf(ShortOrder(cost), cost), 15, 1e-9);
}

TEST(TravelOrder, OfNoneIsNone) { EXPECT_TRUE(ShortOrder(Eigen::MatrixXd(0, 0)).empty()); }

}  // namespace
}  // namespace sixpoint::metrology
