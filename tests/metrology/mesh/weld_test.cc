#include "metrology/mesh/weld.h"

#include <gtest/gtest.h>

namespace sixpoint::metrology {
namespace {

TEST(Weld, KeepsOrderAndJoinsWithinTheTolerance) {
  Points points{{1, 0, 0}, {0, 0, 0}, {1 + 0.9e-3, 0, 0}, {0, -0.0, 0}, {1.0025, 0, 0}};
  Points exact = points;
  EXPECT_EQ(Weld(1e-3, &points), (std::vector<std::uint32_t>{0, 1, 0, 1, 2}));
  EXPECT_EQ(points.size(), 3u);
  EXPECT_EQ(Weld(0, &exact), (std::vector<std::uint32_t>{0, 1, 2, 1, 3}));
}

TEST(Weld, EachPointKnowsTheFirstThatIsAlike) {
  const Points points{{1, 0, 0}, {0, 0, 0}, {1 + 0.9e-3, 0, 0}, {0, -0.0, 0}};
  EXPECT_EQ(FirstAlike(0, points), (std::vector<std::uint32_t>{0, 1, 2, 1}));
  EXPECT_EQ(FirstAlike(1e-3, points), (std::vector<std::uint32_t>{0, 1, 0, 1}));
  EXPECT_TRUE(FirstAlike(0, {}).empty());
}

}  // namespace
}  // namespace sixpoint::metrology
