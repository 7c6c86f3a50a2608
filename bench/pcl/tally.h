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

// An error beyond the limit is wrong, and silent: a failure like having found nothing.
class Tally {
 public:
  Tally(std::string name, std::vector<Result> results, double limit);

  const std::string& name() const { return name_; }
  double failed_percent() const;
  double wrong_percent() const;
  double seconds() const;  // median
  // Root mean square over the cases in which neither this one nor the other failed.
  double ErrorBeside(const Tally& other) const;

 private:
  bool Right(std::size_t i) const { return results_[i].found && results_[i].error <= limit_; }
  double PercentOf(std::size_t count) const;

  std::string name_;
  std::vector<Result> results_;
  double limit_;
};

// Ours beside the best of PCL's: what fails least often, and of those the nearest.
struct Comparison {
  double failed_more_percent = 0;
  double error_ratio = 0;  // over the cases that both found
  double time_ratio = 0;
};
// Prints a row each; the first is ours. All had the same cases.
Comparison PrintTallies(const std::string& title, const std::string& unit, const std::vector<Tally>& tallies);

double ThreadSeconds();  // processor time of the calling thread: what else runs on the machine does not count

}  // namespace sixpoint::bench
