#include "bench/goals.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace sixpoint::bench {
namespace {

std::string Wanted(const Goal& goal) {
  char text[64];
  if (goal.least && goal.most && *goal.least == *goal.most)
    std::snprintf(text, sizeof text, "%g", *goal.least);
  else if (goal.least && goal.most)
    std::snprintf(text, sizeof text, "%g to %g", *goal.least, *goal.most);
  else if (goal.least)
    std::snprintf(text, sizeof text, "at least %g", *goal.least);
  else
    std::snprintf(text, sizeof text, "at most %g", goal.most.value_or(NAN));
  return text;
}

bool Counts(const Goal& goal, const GoalRun& run) {
  return goal.counts == Goal::Counts::kAlways || (run.full && (goal.counts == Goal::Counts::kInFull || run.quiet));
}

}  // namespace

int PrintGoals(const std::vector<Goal>& goals, const GoalRun& run, const nlohmann::json& figures) {
  int missed = 0;
  std::printf("\n%-72s %14s %10s\n", "goals", "wanted", "measured");
  for (const Goal& goal : goals) {
    if (std::find(run.parts.begin(), run.parts.end(), goal.part) == run.parts.end()) continue;
    const auto at = figures.find(goal.figure);
    const bool measured = at != figures.end() && at->is_number();
    const double value = measured ? at->get<double>() : NAN;
    const bool met = std::isfinite(value) && !(goal.least && value < *goal.least) && !(goal.most && value > *goal.most);
    const bool counts = Counts(goal, run);
    missed += counts && !met ? 1 : 0;
    char text[32] = "-";
    if (measured) std::snprintf(text, sizeof text, "%.4g", value);
    std::printf("%-72s %14s %10s  %s\n", goal.words.c_str(), Wanted(goal).c_str(), text,
                !counts ? "not judged"
                : met   ? "ok"
                        : "MISSED");
  }
  std::printf("%d missed\n", missed);
  return missed;
}

}  // namespace sixpoint::bench
