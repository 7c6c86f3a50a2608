// How one contender did over many cases: how often it failed, how far off it was where it did not, how long it took.
#pragma once

#include <string>
#include <vector>

namespace sixpoint::bench {

struct Result {
  bool found = false;  // else it said that it found nothing
  double error = 0;
  double seconds = 0;
};

class Tally {
 public:
  // An error beyond the limit is wrong, and silent: a failure like having found nothing.
  Tally(std::string name, std::vector<Result> results, double limit);

  const std::string& name() const { return name_; }
  double failed_percent() const { return 100.0 * static_cast<double>(refused_ + wrong_) / static_cast<double>(count_); }
  double wrong_percent() const { return 100.0 * static_cast<double>(wrong_) / static_cast<double>(count_); }
  double error_rms() const { return error_rms_; }  // of those that did not fail
  double seconds() const { return seconds_; }      // median of all

 private:
  std::string name_;
  std::size_t count_ = 0, refused_ = 0, wrong_ = 0;
  double error_rms_ = 0, seconds_ = 0;
};

// What the best of PCL's does better than ours: it fails less often, or as often with a smaller error.
struct Comparison {
  double failed_more_percent = 0;  // ours, less the best of PCL's
  double error_ratio = 0;          // ours over that one's
  double time_ratio = 0;
};
// Prints a row each; the first is ours.
Comparison PrintTallies(const std::string& title, const std::string& unit, const std::vector<Tally>& tallies);

double ThreadSeconds();  // processor time of the calling thread: what else runs on the machine does not count

}  // namespace sixpoint::bench
