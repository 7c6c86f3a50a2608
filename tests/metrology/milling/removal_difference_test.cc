// What a moved path leaves otherwise than the path that it was made from, beside closed forms.
#include "metrology/milling/removal_difference.h"

#include <gtest/gtest.h>

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

constexpr BallMill kMill{3, 20};

// Along x over a plane at this height, which the ball touches at this distance from it.
CutBeside OverPlane(double plane_mm, double off_mm) {
  CutBeside cut;
  for (double x_mm = -4; x_mm <= 4; x_mm += 0.5) cut.dexels.push_back({{x_mm, 0, plane_mm}, Vector3d::UnitZ(), 1});
  cut.dexels.push_back({{0, 30, plane_mm}, Vector3d::UnitZ(), 1});  // out of reach
  for (const double x_mm : {-3.0, -1.0, 1.0, 3.0}) {
    ToolPlace& place = cut.places.emplace_back();
    place.centre_mm = {x_mm, 0, plane_mm + off_mm + kMill.radius_mm};
    place.axis = Vector3d::UnitZ();
  }
  return cut;
}

TEST(RemovalDifference, APathThatWentWithItsSurfaceCutsAsBefore) {
  const auto same = CompareRemoval(OverPlane(0, 0), OverPlane(0.25, 0), kMill, 2, 0.1, 2);
  ASSERT_TRUE(same.ok()) << same.status();
  EXPECT_NEAR(same->deepest_mm, 0, 1e-12);
  EXPECT_NEAR(same->most_rest_mm, 0, 1e-12);
  EXPECT_EQ(same->compared_count, 17u);
}

TEST(RemovalDifference, TellsHowMuchDeeperAndHowMuchMoreIsLeft) {
  const auto deeper = CompareRemoval(OverPlane(0, 0), OverPlane(0, -0.03), kMill, 2, 0.1, 1);
  ASSERT_TRUE(deeper.ok());
  EXPECT_NEAR(deeper->deepest_mm, 0.03, 1e-12);
  const auto rest = CompareRemoval(OverPlane(0, 0), OverPlane(0, 0.04), kMill, 2, 0.1, 1);
  ASSERT_TRUE(rest.ok());
  EXPECT_EQ(rest->deepest_mm, 0);
  EXPECT_NEAR(rest->most_rest_mm, 0.04, 1e-12);
  // What the template leaves above its surface may be cut, but no more.
  const auto allowed = CompareRemoval(OverPlane(0, 0.2), OverPlane(0, -0.01), kMill, 2, 0.1, 1);
  ASSERT_TRUE(allowed.ok());
  EXPECT_NEAR(allowed->deepest_mm, 0.01, 1e-12);
  EXPECT_EQ(allowed->most_rest_mm, 0);
}

// It ends where it ends: the way back to its beginning is none of it.
TEST(RemovalDifference, AnOpenPathIsNotClosed) {
  CutBeside arc = OverPlane(0, 0), moved = OverPlane(0, 0);
  for (CutBeside* cut : {&arc, &moved}) {
    cut->places.front().centre_mm = {-3, 12, 3};
    cut->places.back().centre_mm = {3, 12, 3};
  }
  arc.dexels = moved.dexels = {{{0, 12, 0}, Vector3d::UnitZ(), 1}};  // on the straight line between both ends
  const auto compared = CompareRemoval(arc, moved, kMill, 2, 0.1, 1);
  ASSERT_TRUE(compared.ok());
  EXPECT_EQ(compared->compared_count, 0u);
}

TEST(RemovalDifference, RefusesWhatDoesNotGoTogether) {
  CutBeside one = OverPlane(0, 0), other = one;
  other.dexels.pop_back();
  EXPECT_EQ(CompareRemoval(one, other, kMill, 2, 0.1, 1).status().code(), absl::StatusCode::kInvalidArgument);
  other = one;
  other.places.pop_back();
  EXPECT_EQ(CompareRemoval(one, other, kMill, 2, 0.1, 1).status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace sixpoint::metrology
