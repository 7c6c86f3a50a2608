#include "simulator/fixture.h"

#include <gtest/gtest.h>

#include <cmath>

namespace sixpoint::simulator {
namespace {

DesignedPart InFixture() {
  DesignedPart part = DesignPart({}, MachineDesign().centre_mm);
  part.stations = UsualStations(part);
  return part;
}

TEST(Fixture, PartsStandBesideEachOtherAlongTheSpan) {
  const DesignedPart part = InFixture();
  const auto left = AtStation(part, kLeftStation), right = AtStation(part, kRightStation);
  ASSERT_TRUE(left.ok() && right.ok());
  EXPECT_TRUE(left->zero_from_part_nominal.isApprox(part.zero_from_part_nominal));
  const Eigen::Isometry3d between = left->zero_from_part_nominal.inverse() * right->zero_from_part_nominal;
  EXPECT_GT(between.translation().z(), part.airfoil.span_mm);
  EXPECT_LT(between.translation().head<2>().norm(), 1e-9);
  // A neighbour is clamped a little wrong at its own station.
  const auto neighbours = NeighboursByHand(part, kRightStation, 1, 1, 3);
  ASSERT_EQ(neighbours.size(), 1u);
  const double off_mm = (neighbours[0].translation() - left->zero_from_part_nominal.translation()).norm();
  EXPECT_GT(off_mm, 0);
  EXPECT_LT(off_mm, 1 + part.airfoil.span_mm / 2 * M_PI / 180 + 1e-6);
}

TEST(Fixture, AStationIsOneThatThePartHas) {
  const DesignedPart part = InFixture();
  EXPECT_EQ(AtStation(part, "middle").status().message(), "station: middle, want a station of the part (left, right)");
  EXPECT_EQ(AtStation(part, "").status().message(), "station: empty, want a station of the part (left, right)");
  const DesignedPart alone = DesignPart({}, MachineDesign().centre_mm);
  EXPECT_EQ(AtStation(alone, "left").status().message(), "station: left, want none: the part has no stations");
  EXPECT_TRUE(AtStation(alone, "").ok());
  EXPECT_TRUE(NeighboursByHand(alone, "", 1, 1, 3).empty());
}

TEST(Fixture, AStripGoesOnOverTheNeighboursEnds) {
  const DesignedPart part = InFixture();
  const ScanPlan strip = PlanStrip(part, MachineDesign(), 0.2, 0, 0, MachineDesign().centre_mm.y());
  const ScanPlan longer = OverNeighbours(strip);
  const double gap_mm =
      (part.stations[0].zero_from_part_nominal.inverse() * part.stations[1].zero_from_part_nominal).translation().z() -
      part.airfoil.span_mm;
  EXPECT_GT(longer.last_x_mm - strip.last_x_mm, gap_mm);
  EXPECT_EQ(longer.first_x_mm, -longer.last_x_mm);
}

}  // namespace
}  // namespace sixpoint::simulator
