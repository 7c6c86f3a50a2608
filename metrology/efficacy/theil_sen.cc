#include "metrology/efficacy/theil_sen.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>

#include "metrology/statistics/ranks.h"

namespace sixpoint::metrology {
namespace {

constexpr std::size_t kMostExact = 60;

// Probability of each number of inversions of n values in random order.
std::vector<double> InversionProbabilities(std::size_t n) {
  std::vector<double> known{1};
  for (std::size_t size = 2; size <= n; ++size) {
    std::vector<double> next(known.size() + size - 1, 0);
    for (std::size_t k = 0; k < known.size(); ++k)
      for (std::size_t j = 0; j < size; ++j) next[k + j] += known[k] / static_cast<double>(size);
    known = std::move(next);
  }
  return known;
}

bool HasTies(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return std::adjacent_find(values.begin(), values.end()) != values.end();
}

// n (n - 1) (2 n + 5), summed over groups of ties; of one group: all values.
double TieTerm(const std::vector<double>& values) {
  std::map<double, double> counts;
  for (const double value : values) ++counts[value];
  double sum = 0;
  for (const auto& [value, t] : counts) sum += t * (t - 1) * (2 * t + 5);
  return sum;
}

// Two-sided probability of Kendall's sum, and the greatest sum that is within the confidence.
struct KendallJudgement {
  double p = 1, greatest_within = 0;
};

KendallJudgement JudgeExactly(std::size_t n, double sum, double confidence) {
  const std::vector<double> probabilities = InversionProbabilities(n);
  const double pairs = static_cast<double>(probabilities.size() - 1);
  KendallJudgement judged{0, pairs};
  double tail = 0;
  for (std::size_t k = 0; k < probabilities.size(); ++k) {
    const double at = pairs - 2 * static_cast<double>(k);  // the sum with k inversions, from the greatest down
    if (at < 0) break;
    if (at >= std::abs(sum)) judged.p += 2 * probabilities[k];
    tail += probabilities[k];
    if (tail <= (1 - confidence) / 2) judged.greatest_within = at - 2;
  }
  judged.p = std::min(1.0, judged.p);
  return judged;
}

double NormalQuantileOfTwoSided(double confidence) {
  double low = 0, high = 40;
  for (int i = 0; i < 200; ++i) {
    const double middle = (low + high) / 2;
    (std::erf(middle / std::sqrt(2.0)) < confidence ? low : high) = middle;
  }
  return (low + high) / 2;
}

KendallJudgement JudgeByNormal(const std::vector<double>& times, const std::vector<double>& values, double sum,
                               double confidence) {
  const double n = static_cast<double>(times.size());
  const double variance = (n * (n - 1) * (2 * n + 5) - TieTerm(times) - TieTerm(values)) / 18;
  if (variance <= 0) return {};
  const double sigma = std::sqrt(variance);
  const double z = std::max(0.0, std::abs(sum) - 1) / sigma;  // continuity
  return {std::erfc(z / std::sqrt(2.0)), NormalQuantileOfTwoSided(confidence) * sigma};
}

}  // namespace

std::optional<TheilSenSlope> FitTheilSen(const std::vector<double>& times, const std::vector<double>& values,
                                         double confidence) {
  const std::size_t n = times.size();
  if (n < 3 || values.size() != n) return std::nullopt;
  std::vector<double> slopes;
  double sum = 0;
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = i + 1; j < n; ++j) {
      if (times[i] == times[j]) continue;
      const double slope = (values[j] - values[i]) / (times[j] - times[i]);
      slopes.push_back(slope);
      sum += slope > 0 ? 1 : slope < 0 ? -1 : 0;
    }
  if (slopes.empty()) return std::nullopt;
  const bool exact = n <= kMostExact && !HasTies(times) && !HasTies(values);
  const KendallJudgement judged =
      exact ? JudgeExactly(n, sum, confidence) : JudgeByNormal(times, values, sum, confidence);
  TheilSenSlope fitted;
  fitted.p = judged.p;
  fitted.slope = Median(slopes);
  // Of N slopes in order those numbered (N - C) / 2 and, from the other end, the same.
  std::sort(slopes.begin(), slopes.end());
  const double rank = std::floor((static_cast<double>(slopes.size()) - judged.greatest_within) / 2);
  if (rank >= 1) {
    const auto at = static_cast<std::size_t>(rank);
    fitted.lower = slopes[at - 1];
    fitted.upper = slopes[slopes.size() - at];
  }
  return fitted;
}

}  // namespace sixpoint::metrology
