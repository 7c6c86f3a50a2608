#include "cli/plant_run/jobs.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

namespace sixpoint::cli {
namespace {

TEST(RunJobs, DoesEveryJobOnceAndNeverTooManyTogether) {
  std::vector<std::atomic<int>> done(50);
  std::atomic<int> running{0}, most{0};
  RunJobs(50, 3, [&](int i) {
    const int now = ++running;
    int seen = most;
    while (now > seen && !most.compare_exchange_weak(seen, now)) {
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    ++done[i];
    --running;
  });
  for (const auto& count : done) EXPECT_EQ(count, 1);
  EXPECT_LE(most, 3);
}

TEST(RunJobs, NoJobsIsDone) {
  RunJobs(0, 3, [](int) { FAIL(); });
}

}  // namespace
}  // namespace sixpoint::cli
