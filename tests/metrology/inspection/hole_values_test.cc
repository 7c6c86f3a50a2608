// What is stated of holes, over many draws: as the model has the world, and harsher.
#include <gtest/gtest.h>

#include <cstdio>

#include "tests/metrology/inspection/hole_worlds.h"

namespace sixpoint::metrology {
namespace {

constexpr int kWorldCount = 120;

WorldTally Told(const HoleWorld& world) {
  WorldTally tally = RunHoleWorld(world, kWorldCount);
  for (const auto& [name, value] : tally.values)
    std::printf("%-12s %-20s %4d  %5.1f %%  rms %.3f  U %.3f (um, mrad, 1e-3)\n", world.name.c_str(), name.c_str(),
                value.count, value.held_percent(), 1e3 * value.rms(), 1e3 * value.expanded());
  return tally;
}

// 480 values of 120 seeds, that err together within one: 95 +- 2 % where they err wholly together, and bench/run inspection --pins asks 93 %
// of more.
constexpr double kLeastHeld = 91;

TEST(HoleValues, HoldForTightPins) {
  const WorldTally tally = Told({"tight pins"});
  EXPECT_EQ(tally.measured, tally.holes);
  for (const auto& [name, value] : tally.values) EXPECT_GT(value.held_percent(), kLeastHeld) << name;
  // Of what is common nothing is left: and what is left still holds.
  EXPECT_LT(tally.values.at("pitch").expanded(), 0.2 * tally.independent_pitch.expanded());
  // Held by truth and not by size: of normal errors U is 1.96 rms, a little more where degrees of freedom are few.
  for (const char* name : {"along", "across", "inclination along", "inclination across", "pitch", "pin as seen"})
    EXPECT_LT(tally.values.at(name).expanded(), 3.3 * tally.values.at(name).rms()) << name;
}

TEST(HoleValues, HoldForLoosePinsWhoseHolesAreIntervals) {
  HoleWorld world{"loose pins"};
  world.play_mm = 0.02;
  const WorldTally tally = Told(world);
  for (const auto& [name, value] : tally.values) EXPECT_GT(value.held_percent(), kLeastHeld) << name;
  EXPECT_EQ(tally.values.at("hole's diameter").count, tally.measured);
  EXPECT_GT(tally.values.at("hole's diameter").expanded(), 0.01);
}

TEST(HoleValues, HoldForBores) {
  HoleWorld world{"bores"};
  world.bores = true;
  const WorldTally tally = Told(world);
  EXPECT_EQ(tally.measured, tally.holes);
  for (const auto& [name, value] : tally.values) EXPECT_GT(value.held_percent(), kLeastHeld) << name;
}

TEST(HoleValues, HoldForBentPins) {
  HoleWorld world{"bent pins"};
  world.bend_mm = 0.01;
  const WorldTally tally = Told(world);
  for (const auto& [name, value] : tally.values) EXPECT_GT(value.held_percent(), kLeastHeld) << name;
}

}  // namespace
}  // namespace sixpoint::metrology
