// What a benchmark promises: each figure beside what is wanted of it, printed last, so that a miss ends the program with 1.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace sixpoint::bench {

struct Goal {
  enum class Counts {
    kAlways,
    kInFull,     // not with few draws or points: there chance or a fixed cost decides
    kWhereQuiet  // a time: in full, and only on a machine that does nothing else
  };
  std::string part;    // of the benchmark, that measures it
  std::string figure;  // its key among the figures
  std::string words;   // with its unit
  std::optional<double> least, most;
  Counts counts = Counts::kAlways;
};

struct GoalRun {
  std::vector<std::string> parts;  // that ran; the goals of others are not looked at
  bool full = true;                // the default number of draws and points, or more
  bool quiet = true;
};

// Prints the table. How many are missed of those that count: a figure outside its limits, not finite, or not measured.
int PrintGoals(const std::vector<Goal>& goals, const GoalRun& run, const nlohmann::json& figures);

}  // namespace sixpoint::bench
