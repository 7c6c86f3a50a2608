#include "bench/pcl/tally.h"

#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "metrology/statistics/ranks.h"

namespace sixpoint::bench {

Tally::Tally(std::string name, std::vector<Result> results, double limit)
    : name_(std::move(name)), count_(results.size()) {
  std::vector<double> seconds;
  double squares = 0, right = 0;
  for (const Result& result : results) {
    seconds.push_back(result.seconds);
    if (!result.found) {
      ++refused_;
    } else if (!(result.error <= limit)) {
      ++wrong_;
    } else {
      squares += result.error * result.error;
      right += 1;
    }
  }
  error_rms_ = right > 0 ? std::sqrt(squares / right) : NAN;
  seconds_ = seconds.empty() ? NAN : metrology::Median(seconds);
}

Comparison PrintTallies(const std::string& title, const std::string& unit, const std::vector<Tally>& tallies) {
  const Tally& ours = tallies.front();
  std::printf("%-36s %9s %9s %14s %11s %11s\n", title.c_str(), "failed %", "wrong %", ("rms " + unit).c_str(), "ms",
              "time/ours");
  for (const Tally& each : tallies)
    std::printf("  %-34s %9.1f %9.1f %14.4g %11.3g %11.2f\n", each.name().c_str(), each.failed_percent(),
                each.wrong_percent(), each.error_rms(), 1e3 * each.seconds(), each.seconds() / ours.seconds());
  const Tally& best = *std::min_element(tallies.begin() + 1, tallies.end(), [](const Tally& a, const Tally& b) {
    if (a.failed_percent() != b.failed_percent()) return a.failed_percent() < b.failed_percent();
    return a.error_rms() < b.error_rms();
  });
  return {ours.failed_percent() - best.failed_percent(), ours.error_rms() / best.error_rms(),
          ours.seconds() / best.seconds()};
}

double ThreadSeconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace sixpoint::bench
