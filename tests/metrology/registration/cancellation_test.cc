// A registration whose caller is gone ends at once, wherever its kernel is.
#include <gtest/gtest.h>
#include <time.h>

#include <algorithm>
#include <functional>

#include "metrology/registration/allowance.h"
#include "metrology/registration/coarse_start.h"
#include "tests/metrology/registration/sampled_blade.h"
#include "tests/support/sanitizer.h"

namespace sixpoint::metrology {
namespace {

// What this process computed, whatever else its cores had to do.
double ComputedS() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

constexpr double kGreatestS = testing::kSanitized ? 2 : 0.1;

using Kernel = std::function<absl::Status(const FitOptions&)>;

// On one thread, so that computed time is the kernel's own: no two questions, nor the last one and the end after an answer of
// no, are farther apart than that.
void ExpectStopsInTime(const Kernel& kernel) {
  FitOptions options;
  options.thread_count = 1;
  int question_count = 0;
  double last_s = 0, longest_s = 0;
  options.keep_going = [&] {
    const double now_s = ComputedS();
    if (question_count++ > 0) longest_s = std::max(longest_s, now_s - last_s);
    last_s = now_s;
    return true;
  };
  ASSERT_TRUE(kernel(options).ok());
  EXPECT_LT(longest_s, kGreatestS);
  std::printf("%d questions, at most %.1f ms apart\n", question_count, 1e3 * longest_s);
  const int all = question_count;
  ASSERT_GT(all, 8);
  for (const int last : {1, all / 8, all / 3, all / 2, 3 * all / 4, all - 1, all}) {
    question_count = 0;
    double told_s = 0;
    options.keep_going = [&] {
      if (++question_count == last) told_s = ComputedS();
      return question_count < last;
    };
    EXPECT_EQ(kernel(options).code(), absl::StatusCode::kCancelled) << last << " of " << all;
    EXPECT_EQ(question_count, last);
    EXPECT_LT(ComputedS() - told_s, kGreatestS) << last << " of " << all;
  }
}

// 200 000 triangles.
class Cancellation : public ::testing::Test {
 protected:
  static const Surface& Blade() {
    static const auto* surface =
        new std::shared_ptr<const Surface>(*Surface::Prepare(shapes::Blade(400, 250, kPartCentreMm)));
    return **surface;
  }
  static const std::vector<ScanPortion>& Scans() {
    static const auto* portions = new std::vector<ScanPortion>{
        PortionAtZero(Scanned(Spread(Blade(), 200'000, 1).points_mm, BladePose(), 2e-3, 2))};
    return *portions;
  }
};

TEST_F(Cancellation, OfABestFit) {
  ExpectStopsInTime([](const FitOptions& options) {
    return FitToSurface(Blade(), Scans(), StartPose(), MachineCalibration::Exact(), options).status();
  });
}

TEST_F(Cancellation, OfACoarseStart) {
  ExpectStopsInTime(
      [](const FitOptions& options) { return FindCoarseStart(Blade(), Scans(), BladePose(), options).status(); });
}

// The stock asked for is not there: rounds enough.
TEST_F(Cancellation, OfAnAllowance) {
  AllowanceOptions allowance;
  allowance.least_stock_mm = 0.05;
  allowance.patch_mm = 0.5;
  allowance.least_points = 1;
  ExpectStopsInTime([&](const FitOptions& options) {
    return FitWithAllowance(Blade(), Scans(), StartPose(), allowance, MachineCalibration::Exact(), options).status();
  });
}

}  // namespace
}  // namespace sixpoint::metrology
