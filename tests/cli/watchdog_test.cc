#include "cli/watchdog.h"

#include <gtest/gtest.h>

#include <string>

namespace sixpoint::cli {
namespace {

// After how many of these answers the service is ended; 0: after none.
int EndedAfter(const std::string& health, int most) {
  Watch watch;
  for (int count = 1; count <= most; ++count)
    if (watch.IsStuckAfter(health)) return count;
  return 0;
}

TEST(Watch, EndsWhatIsSilentThreeTimesInARow) {
  EXPECT_EQ(EndedAfter("SILENT", 10), 3);
  Watch watch;
  for (int round = 0; round < 10; ++round) {
    EXPECT_FALSE(watch.IsStuckAfter("SILENT"));
    EXPECT_FALSE(watch.IsStuckAfter("SILENT"));
    EXPECT_FALSE(watch.IsStuckAfter("SERVING"));
  }
}

TEST(Watch, TakesEveryAnswerForOne) {
  EXPECT_EQ(EndedAfter("SERVING", 1000), 0);
  EXPECT_EQ(EndedAfter("NOT_SERVING", 1000), 0);
  EXPECT_EQ(EndedAfter("NOT_TRUSTED", 1000), 0);  // no restart makes a certificate
}

// One that starts is given a minute; one that was ended begins anew.
TEST(Watch, LeavesWhatStartsAlone) {
  EXPECT_EQ(EndedAfter("NOT_REACHED", 100), 20);
  Watch watch;
  for (int count = 1; count <= 3; ++count) EXPECT_EQ(watch.IsStuckAfter("SILENT"), count == 3);
  EXPECT_FALSE(watch.IsStuckAfter("SILENT"));
  EXPECT_FALSE(watch.IsStuckAfter("NOT_REACHED"));
}

// Out of descriptors and busy: now the connection is ended, now nobody serves it. It is as stuck as one that does only either.
TEST(Watch, ASilenceBetweenDoesNotBeginTheMinuteAnew) {
  Watch watch;
  int count = 0;
  while (count < 100 && !watch.IsStuckAfter(++count % 5 == 0 ? "SILENT" : "NOT_REACHED")) {
  }
  EXPECT_EQ(count, 20);
}

}  // namespace
}  // namespace sixpoint::cli
