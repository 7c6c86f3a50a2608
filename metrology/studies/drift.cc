#include "metrology/studies/drift.h"

#include <cmath>
#include <string>

#include "metrology/statistics/distributions.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

absl::Status Check(const std::vector<DatedEstimate>& estimates, const DriftOptions& options) {
  if (!std::isfinite(options.coverage_factor) || options.coverage_factor <= 0 || options.coverage_factor > 8)
    return Refuse("coverage_factor", options.coverage_factor, "above 0, at most 8");
  if (options.limit && !(std::isfinite(*options.limit) && *options.limit > 0))
    return Refuse("limit", *options.limit, "> 0");
  for (std::size_t i = 0; i < estimates.size(); ++i) {
    const DatedEstimate& e = estimates[i];
    const std::string field = "estimates[" + std::to_string(i) + "]";
    if (!std::isfinite(e.value)) return Refuse(field + ".value", e.value, "a number");
    if (!std::isfinite(e.standard_uncertainty) || e.standard_uncertainty <= 0)
      return Refuse(field + ".standard_uncertainty", e.standard_uncertainty, "> 0");
    if (!std::isfinite(e.time_days) || (i > 0 && e.time_days < estimates[i - 1].time_days))
      return Refuse(field + ".time_days", e.time_days, "in order");
  }
  return absl::OkStatus();
}

std::optional<DriftLine> FitLine(const std::vector<DatedEstimate>& estimates, double coverage_factor) {
  const std::size_t n = estimates.size();
  if (n < 3) return std::nullopt;
  double weights = 0, mean_time = 0, mean_value = 0;
  for (const DatedEstimate& e : estimates) {
    const double w = 1 / (e.standard_uncertainty * e.standard_uncertainty);
    weights += w;
    mean_time += w * e.time_days;
    mean_value += w * e.value;
  }
  mean_time /= weights;
  mean_value /= weights;
  double times = 0, products = 0;
  for (const DatedEstimate& e : estimates) {
    const double w = 1 / (e.standard_uncertainty * e.standard_uncertainty), t = e.time_days - mean_time;
    times += w * t * t;
    products += w * t * (e.value - mean_value);
  }
  const double span = estimates.back().time_days - estimates.front().time_days;
  if (span <= 0 || times <= 0) return std::nullopt;
  DriftLine line;
  line.slope_per_day = products / times;
  double squares = 0;
  for (const DatedEstimate& e : estimates) {
    const double r = (e.value - mean_value - line.slope_per_day * (e.time_days - mean_time)) / e.standard_uncertainty;
    squares += r * r;
  }
  const double freedom = static_cast<double>(n) - 2;
  line.scatter_ratio = std::max(1.0, std::sqrt(squares / freedom));
  line.slope_standard_uncertainty_per_day = line.scatter_ratio / std::sqrt(times);
  line.t = std::abs(line.slope_per_day) / line.slope_standard_uncertainty_per_day;
  // Normal probability of |x| < k, one tail.
  line.t_limit = StudentQuantile(0.5 * (1 + std::erf(coverage_factor / std::sqrt(2))), freedom);
  return line;
}

}  // namespace

absl::StatusOr<Drift> AssessDrift(const std::vector<DatedEstimate>& estimates, const DriftOptions& options) {
  if (absl::Status s = Check(estimates, options); !s.ok()) return s;
  Drift drift;
  for (std::size_t i = 1; i < estimates.size(); ++i) {
    const DatedEstimate &before = estimates[i - 1], &now = estimates[i];
    DriftStep& step = drift.steps.emplace_back();
    step.change = now.value - before.value;
    step.ratio = step.change / std::hypot(now.standard_uncertainty, before.standard_uncertainty);
    step.step_alarm = std::abs(step.ratio) > options.coverage_factor;
    step.limit_alarm = options.limit && std::abs(now.value - estimates.front().value) > *options.limit;
    drift.step_alarm |= step.step_alarm;
    drift.limit_alarm |= step.limit_alarm;
  }
  drift.line = FitLine(estimates, options.coverage_factor);
  drift.trend_alarm = drift.line && drift.line->t > drift.line->t_limit;
  return drift;
}

}  // namespace sixpoint::metrology
