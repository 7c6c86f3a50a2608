// Which limits of earlier passes count on, and whose their pushes are.
#include "metrology/reconstruction/stock_cuts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

FreeFormDeformation Still() {
  return *FreeFormDeformation::Still(ControlLattice{Vector3d::Zero(), Vector3d(5, 5, 5), {2, 2, 2}});
}

DisplacementLimit StockLimit(double angle_rad, double most_mm, LimitKind kind = LimitKind::kStock) {
  DisplacementLimit limit;
  limit.at = *Still().WeightsAt({5, 5, 5});
  limit.direction = Vector3d(std::cos(angle_rad), std::sin(angle_rad), 0);
  limit.most_mm = most_mm;
  limit.most_kind = kind;
  return limit;
}

std::vector<DisplacementLimit> Cuts(const StockCuts& cuts) {
  std::vector<DisplacementLimit> all;
  cuts.AppendTo(&all);
  return all;
}

TEST(StockCuts, KeepsWhatTurnsAndAsksStock) {
  StockCuts cuts(true);
  cuts.TakeTurned({StockLimit(0, 0.1), StockLimit(0, 0.2), StockLimit(0, 0.3, LimitKind::kTolerance)});
  EXPECT_TRUE(cuts.empty());
  cuts.TakeTurned({StockLimit(0.02, 0.4), StockLimit(0.1, 0.5), StockLimit(1, 0.6, LimitKind::kTolerance)});
  ASSERT_EQ(Cuts(cuts).size(), 1u);
  EXPECT_EQ(Cuts(cuts)[0].most_mm, 0.2);  // as it stood before it turned
  // Of three directions the two earlier ones.
  cuts.TakeTurned({StockLimit(0.02, 0.4), StockLimit(0.2, 0.7)});
  ASSERT_EQ(Cuts(cuts).size(), 2u);
  EXPECT_EQ(Cuts(cuts)[1].most_mm, 0.5);
  cuts.Clear();
  EXPECT_TRUE(cuts.empty());
}

TEST(StockCuts, BeginWhereAWayMissedMore) {
  StockCuts cuts(false);
  for (int pass = 0; pass < 3; ++pass) cuts.TakeTurned({StockLimit(0.1 * pass, 0.1)});
  EXPECT_TRUE(cuts.empty());
  cuts.TakeMissed({}, Still(), 1e-3);
  cuts.TakeTurned({StockLimit(0.4, 0.1)});
  EXPECT_EQ(Cuts(cuts).size(), 1u);
  cuts.Clear();
  cuts.TakeTurned({StockLimit(0.6, 0.1)});
  EXPECT_TRUE(cuts.empty());
}

TEST(StockCuts, StaysBounded) {
  StockCuts cuts(true);
  std::size_t most = 0;
  for (int pass = 0; pass < 20; ++pass) {
    cuts.TakeTurned({StockLimit(0.1 * pass, 0.1), StockLimit(0.1 * pass, 0.2)});
    most = std::max(most, Cuts(cuts).size());
  }
  EXPECT_EQ(most, 4u);  // 38 without a bound
}

TEST(StockCuts, TakesWhatAWayMissesAtItsEnd) {
  const FreeFormDeformation still = Still();
  auto controls_mm = still.controls_mm();
  controls_mm.colwise() = Vector3d(0.3, 0, 0);
  const auto end = *FreeFormDeformation::Make(still.lattice(), controls_mm, still.covered());
  StockCuts cuts(true);
  cuts.TakeMissed({StockLimit(0, 0.2999), StockLimit(0, 0.2), StockLimit(0, 0.2, LimitKind::kTolerance),
                   StockLimit(3.1, 0.2), DisplacementLimit()},
                  end, 1e-3);
  ASSERT_EQ(Cuts(cuts).size(), 1u);
  EXPECT_EQ(cuts.Owned({{5, true, 2.0}, {1, true, 1.0}, {0, false, 4.0}}, 5).size(), 2u);
}

TEST(StockCuts, PushesBecomeThoseOfTheirPatches) {
  StockCuts cuts(true);
  cuts.TakeTurned({StockLimit(0, 0.1), StockLimit(0, 0.2)});
  cuts.TakeTurned({StockLimit(0.1, 0.1), StockLimit(0.1, 0.2)});
  const auto owned = cuts.Owned({{0, true, 1.0}, {1, false, 2.0}, {1, true, 3.0}, {2, true, 4.0}, {3, true, 5.0}}, 2);
  ASSERT_EQ(owned.size(), 3u);
  EXPECT_EQ(owned[0].limit, 0u);
  EXPECT_EQ(owned[0].force, 5.0);
  EXPECT_FALSE(owned[1].most);
  EXPECT_EQ(owned[1].force, 2.0);
  EXPECT_EQ(owned[2].limit, 1u);
  EXPECT_TRUE(owned[2].most);
  EXPECT_EQ(owned[2].force, 8.0);
}

}  // namespace
}  // namespace sixpoint::metrology
