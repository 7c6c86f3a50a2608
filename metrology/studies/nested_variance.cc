#include "metrology/studies/nested_variance.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "metrology/statistics/distributions.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

struct Cell {
  double count = 0, mean = 0, squares = 0;
};
using Levels = std::map<std::string, std::map<std::string, Cell>>;

// Mean squares in the order outer, inner, repeat, with what they are expected to be:
// E[outer] = e + k2 b + k3 a, E[inner] = e + k1 b, E[repeat] = e.
struct MeanSquares {
  std::array<double, 3> value{};
  std::array<double, 3> freedom{};
  double k1 = 0, k2 = 0, k3 = 0;
};
using Coefficients = std::array<double, 3>;  // of a linear combination of the mean squares

double Combine(const Coefficients& c, const MeanSquares& ms) {
  return c[0] * ms.value[0] + c[1] * ms.value[1] + c[2] * ms.value[2];
}

// Modified large-sample interval of sum c_q MS_q (Ting, Burdick, Graybill, Jeyaratnam, Lu 1990), not below 0.
Interval IntervalOf(const Coefficients& c, const MeanSquares& ms, double confidence) {
  const double tail = (1 - confidence) / 2;
  const double estimate = Combine(c, ms);
  double below = 0, above = 0;
  std::array<double, 3> g{}, h{};  // relative: how far a mean square may lie above, and below, its expectation
  for (int q = 0; q < 3; ++q) {
    g[q] = 1 - ms.freedom[q] / ChiSquaredQuantile(1 - tail, ms.freedom[q]);
    h[q] = ms.freedom[q] / ChiSquaredQuantile(tail, ms.freedom[q]) - 1;
    const double part = c[q] * ms.value[q];
    below += part * part * (c[q] > 0 ? g[q] * g[q] : h[q] * h[q]);
    above += part * part * (c[q] > 0 ? h[q] * h[q] : g[q] * g[q]);
  }
  for (int q = 0; q < 3; ++q)
    for (int r = 0; r < 3; ++r) {
      if (c[q] <= 0 || c[r] >= 0) continue;
      const double product = c[q] * -c[r] * ms.value[q] * ms.value[r];
      const double f_high = FisherQuantile(1 - tail, ms.freedom[q], ms.freedom[r]);
      const double f_low = FisherQuantile(tail, ms.freedom[q], ms.freedom[r]);
      below += product * (std::pow(f_high - 1, 2) - std::pow(g[q] * f_high, 2) - h[r] * h[r]) / f_high;
      above += product * (std::pow(1 - f_low, 2) - std::pow(h[q] * f_low, 2) - g[r] * g[r]) / f_low;
    }
  return {std::max(0.0, estimate - std::sqrt(std::max(0.0, below))),
          std::max(0.0, estimate + std::sqrt(std::max(0.0, above)))};
}

absl::Status CheckObservations(const std::vector<NestedObservation>& observations, const NestedOptions& options) {
  if (!(options.confidence >= 0.5 && options.confidence <= 0.999))
    return Refuse("confidence", options.confidence, "0.5 to 0.999");
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const std::string field = "observations[" + std::to_string(i) + "]";
    if (!std::isfinite(observations[i].value)) return Refuse(field + ".value", "not finite", "a number");
    if (observations[i].outer.empty()) return Refuse(field + ".outer", "", "the name of its level");
    if (observations[i].inner.empty()) return Refuse(field + ".inner", "", "the name of its level");
  }
  return absl::OkStatus();
}

absl::Status CheckLevels(const Levels& levels, bool balanced, const NestedOptions& options) {
  if (levels.size() < 2) return Refuse("observations", std::to_string(levels.size()) + " outer levels", "at least 2");
  std::size_t inner = 0;
  bool repeated = false;
  for (const auto& [name, cells] : levels) {
    inner = std::max(inner, cells.size());
    for (const auto& [cell_name, cell] : cells) repeated |= cell.count > 1;
  }
  if (inner < 2) return Refuse("observations", "one inner level in each outer one", "two or more in one of them");
  if (!repeated) return Refuse("observations", "one value at each inner level", "two or more at one of them");
  if (options.balanced_only && !balanced)
    return Refuse("observations", "not balanced", "as many inner levels in each outer one, as many values at each");
  return absl::OkStatus();
}

bool IsBalanced(const Levels& levels) {
  const auto& first = levels.begin()->second;
  for (const auto& [name, cells] : levels) {
    if (cells.size() != first.size()) return false;
    for (const auto& [cell_name, cell] : cells)
      if (cell.count != first.begin()->second.count) return false;
  }
  return true;
}

void FillLine(const MeanSquares& ms, int index, double sum_of_squares, const Coefficients& c, double confidence,
              VarianceLine* line) {
  line->degrees_of_freedom = static_cast<int>(ms.freedom[index]);
  line->sum_of_squares = sum_of_squares;
  line->mean_square = ms.value[index];
  const double component = Combine(c, ms);
  line->negative = component < 0;
  line->variance = std::max(0.0, component);
  line->interval = IntervalOf(c, ms, confidence);
}

// F against a synthesised denominator, with Satterthwaite's degrees of freedom.
void FillTest(const MeanSquares& ms, int index, const Coefficients& denominator, VarianceLine* line) {
  const double below = Combine(denominator, ms);
  if (below <= 0) return;
  double spread = 0;
  for (int q = 0; q < 3; ++q) spread += std::pow(denominator[q] * ms.value[q], 2) / ms.freedom[q];
  line->f = ms.value[index] / below;
  line->p = FisherUpperTail(*line->f, ms.freedom[index], below * below / spread);
}

}  // namespace

absl::StatusOr<NestedVariance> AnalyseNested(const std::vector<NestedObservation>& observations,
                                             const NestedOptions& options) {
  if (absl::Status s = CheckObservations(observations, options); !s.ok()) return s;
  Levels levels;
  NestedVariance result;
  for (const NestedObservation& o : observations) {
    Cell& cell = levels[o.outer][o.inner];
    ++cell.count;
    const double from_mean = o.value - cell.mean;  // running mean: no digits lost to a large offset
    cell.mean += from_mean / cell.count;
    cell.squares += from_mean * (o.value - cell.mean);
    result.mean += (o.value - result.mean) / static_cast<double>(&o - observations.data() + 1);
  }
  result.balanced = !levels.empty() && IsBalanced(levels);
  if (absl::Status s = CheckLevels(levels, result.balanced, options); !s.ok()) return s;

  const double n = static_cast<double>(observations.size()), outer_count = static_cast<double>(levels.size());
  double cells = 0, outer_squares = 0, inner_squares = 0, repeat_squares = 0;
  double within = 0, inner_counts = 0, outer_counts = 0;  // sums of n_ij^2 / n_i, n_ij^2, n_i^2
  for (const auto& [name, inner] : levels) {
    double count = 0, mean = 0;
    for (const auto& [cell_name, cell] : inner) {
      count += cell.count;
      mean += cell.count * (cell.mean - result.mean);
    }
    mean = result.mean + mean / count;
    outer_squares += count * std::pow(mean - result.mean, 2);
    outer_counts += count * count;
    for (const auto& [cell_name, cell] : inner) {
      ++cells;
      inner_squares += cell.count * std::pow(cell.mean - mean, 2);
      repeat_squares += cell.squares;
      within += cell.count * cell.count / count;
      inner_counts += cell.count * cell.count;
    }
  }
  MeanSquares ms;
  ms.freedom = {outer_count - 1, cells - outer_count, n - cells};
  ms.value = {outer_squares / ms.freedom[0], inner_squares / ms.freedom[1], repeat_squares / ms.freedom[2]};
  ms.k1 = (n - within) / ms.freedom[1];
  ms.k2 = (within - inner_counts / n) / ms.freedom[0];
  ms.k3 = (n - outer_counts / n) / ms.freedom[0];

  const double ratio = ms.k2 / ms.k1;
  const Coefficients outer{1 / ms.k3, -ratio / ms.k3, -(1 - ratio) / ms.k3}, inner{0, 1 / ms.k1, -1 / ms.k1},
      repeat{0, 0, 1};
  FillLine(ms, 0, outer_squares, outer, options.confidence, &result.outer);
  FillLine(ms, 1, inner_squares, inner, options.confidence, &result.inner);
  FillLine(ms, 2, repeat_squares, repeat, options.confidence, &result.repeat);
  FillTest(ms, 0, {0, ratio, 1 - ratio}, &result.outer);
  FillTest(ms, 1, {0, 0, 1}, &result.inner);
  result.total_degrees_of_freedom = static_cast<int>(n) - 1;
  result.total_sum_of_squares = outer_squares + inner_squares + repeat_squares;

  const double a = result.outer.variance, b = result.inner.variance, e = result.repeat.variance, total = a + b + e;
  result.mean_standard_uncertainty = std::sqrt(a * outer_counts / (n * n) + b * inner_counts / (n * n) + e / n);
  if (total > 0)
    for (VarianceLine* line : {&result.outer, &result.inner, &result.repeat})
      line->percent = 100 * line->variance / total;
  const Coefficients& reproducibility = options.part_is_outer ? inner : outer;
  result.gauge_rr_variance = (options.part_is_outer ? b : a) + e;
  result.gauge_rr_interval =
      IntervalOf({reproducibility[0], reproducibility[1], reproducibility[2] + 1}, ms, options.confidence);
  if (total > 0) result.gauge_rr_percent = 100 * std::sqrt(result.gauge_rr_variance / total);
  if (result.gauge_rr_variance > 0)
    result.distinct_categories = static_cast<int>(
        std::min(1e6, std::floor(1.41 * std::sqrt((options.part_is_outer ? a : b) / result.gauge_rr_variance))));
  return result;
}

}  // namespace sixpoint::metrology
