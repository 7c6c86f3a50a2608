#include "metrology/efficacy/efficacy.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "metrology/efficacy/blade_estimates.h"
#include "metrology/efficacy/check.h"
#include "metrology/efficacy/hole_bias.h"
#include "metrology/efficacy/mean_test.h"
#include "metrology/efficacy/offsets.h"

namespace sixpoint::metrology {
namespace {

constexpr double kNewestLevel = 0.01;

OffsetComponent ComponentOf(int column) { return static_cast<OffsetComponent>(column); }

// Over blade means: trend of each component, and whether the newest fits those before.
void LookOverTime(const std::vector<BladeOutcome>& blades, const BladeEstimates& means, const Determined& determined,
                  const EfficacyOptions& options, Efficacy* result) {
  std::vector<double> times;
  for (const std::size_t i : means.blades) times.push_back(blades[i].time_days);
  const double level = (1 - options.confidence) / static_cast<double>(determined.positions.size());
  for (std::size_t k = 0; k < determined.positions.size(); ++k) {
    std::vector<double> values;
    for (const Eigen::VectorXd& value : means.values) values.push_back(value[static_cast<Eigen::Index>(k)]);
    const auto slope = FitTheilSen(times, values, options.confidence);
    if (slope) result->trends.push_back({ComponentOf(determined.positions[k]), *slope, slope->p < level});
  }
  if (static_cast<int>(means.values.size()) < options.least_blades) return;
  result->newest_p = FurtherOne({means.values.begin(), means.values.end() - 1}, means.values.back());
  result->newest_off = result->newest_p && *result->newest_p < kNewestLevel;
}

void SetBlades(const std::vector<BladeOutcome>& blades, const BladeEstimates& means, const Determined& determined,
               Efficacy* result) {
  for (const BladeOutcome& blade : blades) {
    BladeMean& mean = result->blades.emplace_back();
    mean.blade = blade.blade;
    mean.time_days = blade.time_days;
    mean.hole_count = static_cast<int>(blade.holes.size());
    result->hole_count += mean.hole_count;
  }
  for (std::size_t i = 0; i < means.values.size(); ++i)
    for (std::size_t k = 0; k < determined.positions.size(); ++k)
      result->blades[means.blades[i]].position_mm[static_cast<std::size_t>(determined.positions[k])] =
          means.values[i][static_cast<Eigen::Index>(k)];
}

// A vector is offered where all of it is significant together; of it the components beyond their own uncertainty.
void Offer(const EfficacyOptions& options, int estimated, Efficacy* result) {
  const auto drifts = [](const ComponentTrend& trend) { return trend.significant; };
  if (estimated < options.least_blades)
    result->reasons.push_back(NotOffered::kTooFewBlades);
  else if (!result->position.significant && !result->angles.significant)
    result->reasons.push_back(NotOffered::kNotSignificant);
  if (std::any_of(result->trends.begin(), result->trends.end(), drifts)) result->reasons.push_back(NotOffered::kDrifts);
  if (result->newest_off) result->reasons.push_back(NotOffered::kNewestBladeOff);
  if (!result->reasons.empty()) return;
  bool any = false;
  for (OffsetEstimate& offset : result->offsets) {
    const bool significant =
        offset.component < OffsetComponent::kA ? result->position.significant : result->angles.significant;
    offset.offered =
        significant && offset.expanded_uncertainty && std::abs(offset.value) > *offset.expanded_uncertainty;
    any |= offset.offered;
  }
  if (!any) result->reasons.push_back(NotOffered::kWithinUncertainty);
}

}  // namespace

absl::StatusOr<Efficacy> AssessEfficacy(const std::vector<BladeOutcome>& blades, const RotaryAxes& axes,
                                        const EfficacyOptions& options) {
  if (absl::Status s = CheckOutcomes(blades, options); !s.ok()) return s;
  const std::vector<SeenBlade> seen = SeeAll(blades, axes);
  const Determined determined = WhatIsDetermined(seen);
  Efficacy result;
  result.blade_count = static_cast<int>(blades.size());
  result.condition_number = determined.condition_number;
  for (int column = 0; column < kOffsetComponentCount; ++column) {
    const auto& columns = column < 3 ? determined.positions : determined.angles;
    if (std::find(columns.begin(), columns.end(), column) == columns.end())
      result.not_determined.push_back(ComponentOf(column));
  }
  const BladeEstimates means = EstimateEach(seen, determined.positions);
  SetBlades(blades, means, determined, &result);
  if (means.values.empty()) {
    result.reasons.push_back(NotOffered::kTooFewBlades);
    return result;
  }
  Offsets offsets = EstimateOffsets(seen, determined, means, options.confidence);
  result.offsets = std::move(offsets.offsets);
  result.position = offsets.position;
  result.angles = offsets.angles;
  result.angles_used = offsets.angles_used;
  for (const int column : determined.positions)
    result.spreads.push_back({ComponentOf(column), SpreadOf(seen, column, offsets.angle_values, false)});
  result.holes = HoleBiases(seen, offsets.angle_values, options.confidence);
  LookOverTime(blades, means, determined, options, &result);
  Offer(options, static_cast<int>(means.values.size()), &result);
  return result;
}

}  // namespace sixpoint::metrology
