// What a ball on straight ways leaves of dexels, beside closed forms.
#include "metrology/milling/removal.h"

#include <gtest/gtest.h>

#include <cmath>

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

// Passes along x over the plane z = 0, a step apart in y, the ball's lowest point at `height_mm`.
RecontourPath Over(double step_mm, double height_mm, double radius_mm) {
  RecontourPath path;
  for (double y_mm = -3; y_mm <= 3 + 1e-9; y_mm += step_mm) {
    RecontourPass pass;
    for (const double x_mm : {-5.0, 5.0}) {
      ToolPlace place;
      place.centre_mm = {x_mm, y_mm, height_mm + radius_mm};
      place.axis = Vector3d::UnitZ();
      pass.places.push_back(place);
    }
    path.passes.push_back(pass);
  }
  return path;
}

TEST(Removal, LeavesTheScallop) {
  const BallMill mill{3, 20};
  std::vector<Dexel> dexels;
  for (double y_mm = -1; y_mm <= 1; y_mm += 0.01) dexels.push_back({{0, y_mm, 0}, Vector3d::UnitZ(), 2});
  const Removal removal = Remove(dexels, Over(0.4, 0, 3), mill, 1, 2);
  double highest_mm = 0, lowest_mm = 1;
  for (const double top_mm : removal.top_mm) {
    highest_mm = std::max(highest_mm, top_mm);
    lowest_mm = std::min(lowest_mm, top_mm);
  }
  EXPECT_NEAR(highest_mm, *ScallopOf(0.4, 3), 1e-5);  // dexels 10 um from the ridge: 0.01^2 / 2 / 3 mm
  EXPECT_NEAR(lowest_mm, 0, 1e-9);
  EXPECT_EQ(removal.touched_count, dexels.size());
}

TEST(Removal, TellsAGougeAndStopsAtItsDepth) {
  const std::vector<Dexel> dexels = {{{0, 0, 0}, Vector3d::UnitZ(), 2}, {{0, 20, 0}, Vector3d::UnitZ(), 2}};
  const Removal shallow = Remove(dexels, Over(1, -0.05, 3), {3, 20}, 1, 1);
  EXPECT_NEAR(shallow.top_mm[0], -0.05, 1e-9);
  EXPECT_EQ(shallow.top_mm[1], 2);  // out of reach
  EXPECT_EQ(shallow.touched_count, 1u);
  EXPECT_EQ(Remove(dexels, Over(1, -3, 3), {3, 20}, 1, 1).top_mm[0], -1);
}

TEST(Removal, ShankCutsToo) {
  // A ball far above, whose shank lies down across the dexel.
  RecontourPath path;
  RecontourPass pass;
  ToolPlace place;
  place.centre_mm = {10, 0, 3.5};
  place.axis = -Vector3d::UnitX();
  pass.places = {place, place};
  path.passes.push_back(pass);
  const std::vector<Dexel> dexels = {{{0, 0, 0}, Vector3d::UnitZ(), 2}};
  EXPECT_NEAR(Remove(dexels, path, {3, 20}, 1, 1).top_mm[0], 0.5, 1e-9);
  EXPECT_EQ(Remove(dexels, path, {3, 5}, 1, 1).top_mm[0], 2);  // too short to reach it
}

// One ball of 2 mm at that height, on its straight way past a dexel half a millimetre beside it.
TEST(Removal, ABallOnItsWayCutsWhereItsCircleIs) {
  RecontourPath path = Over(10, 0, 2);
  for (ToolPlace& place : path.passes.front().places) place.centre_mm.y() = 0;
  const std::vector<Dexel> dexels = {{{0, 0.5, 0}, Vector3d::UnitZ(), 2}, {{0, 5, 0}, Vector3d::UnitZ(), 2}};
  const Removal removal = Remove(dexels, path, {2, 20}, 1, 1);
  EXPECT_NEAR(removal.top_mm[0], 2 - std::sqrt(4 - 0.25), 1e-12);
  EXPECT_EQ(removal.top_mm[1], 2);
}

}  // namespace
}  // namespace sixpoint::metrology
