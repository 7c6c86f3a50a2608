#include "simulator/living_fleet.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

namespace sixpoint::simulator {
namespace {

// Within a shift of a few dozen blades every machine has met everything, most blades nothing, and no drift grows for ever.
TEST(LivingFleet, EveryMachineHasItsTroubleInItsOwnTime) {
  std::set<std::map<int, int>> courses;
  for (int machine = 0; machine < 3; ++machine) {
    std::map<int, int> course;
    std::map<Incident, int> met;
    int since = 0;
    for (int blade = 0; blade < 40; ++blade) {
      const Turn turn = TurnOf(machine, blade);
      EXPECT_LT(turn.blades_since_calibration, 8);
      since = turn.calibrate ? 0 : since + 1;
      EXPECT_EQ(turn.calibrate, turn.blades_since_calibration == 0);
      EXPECT_LE(since, 8);
      ++met[turn.incident];
      if (turn.incident != Incident::kNone) course[blade] = static_cast<int>(turn.incident);
    }
    EXPECT_EQ(met.size(), 4u) << machine;
    EXPECT_GT(met[Incident::kNone], 30) << machine;
    courses.insert(course);
  }
  EXPECT_EQ(courses.size(), 3u);
}

}  // namespace
}  // namespace sixpoint::simulator
