#include "bench/pcl/tally.h"

#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "metrology/statistics/ranks.h"

namespace sixpoint::bench {

Tally::Tally(std::string name, std::vector<Result> results, double limit)
    : name_(std::move(name)), results_(std::move(results)), limit_(limit) {}

double Tally::PercentOf(std::size_t count) const {
  return 100.0 * static_cast<double>(count) / static_cast<double>(results_.size());
}

double Tally::failed_percent() const {
  std::size_t failed = 0;
  for (std::size_t i = 0; i < results_.size(); ++i) failed += Right(i) ? 0 : 1;
  return PercentOf(failed);
}

double Tally::wrong_percent() const {
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < results_.size(); ++i) wrong += results_[i].found && !Right(i) ? 1 : 0;
  return PercentOf(wrong);
}

double Tally::seconds() const {
  std::vector<double> seconds;
  for (const Result& result : results_) seconds.push_back(result.seconds);
  return metrology::Median(seconds);
}

double Tally::ErrorBeside(const Tally& other) const {
  double squares = 0, count = 0;
  for (std::size_t i = 0; i < results_.size(); ++i) {
    if (!Right(i) || !other.Right(i)) continue;
    squares += results_[i].error * results_[i].error;
    count += 1;
  }
  return std::sqrt(squares / count);
}

Comparison PrintTallies(const std::string& title, const std::string& unit, const std::vector<Tally>& tallies) {
  const Tally& ours = tallies.front();
  std::printf("%-36s %9s %9s %14s %16s %11s %11s\n", title.c_str(), "failed %", "wrong %", ("rms " + unit).c_str(),
              "ours there", "ms", "time/ours");
  for (const Tally& each : tallies)
    std::printf("  %-34s %9.1f %9.1f %14.4g %16.4g %11.3g %11.2f\n", each.name().c_str(), each.failed_percent(),
                each.wrong_percent(), each.ErrorBeside(ours), ours.ErrorBeside(each), 1e3 * each.seconds(),
                each.seconds() / ours.seconds());
  const Tally& best = *std::min_element(tallies.begin() + 1, tallies.end(), [&](const Tally& a, const Tally& b) {
    if (a.failed_percent() != b.failed_percent()) return a.failed_percent() < b.failed_percent();
    return a.ErrorBeside(ours) < b.ErrorBeside(ours);
  });
  // Where PCL finds none at all, ours is no worse.
  const double error_ratio = best.failed_percent() < 100 ? ours.ErrorBeside(best) / best.ErrorBeside(ours) : 0;
  return {ours.failed_percent() - best.failed_percent(), error_ratio, ours.seconds() / best.seconds()};
}

double ThreadSeconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace sixpoint::bench
