#include "metrology/efficacy/offsets.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "metrology/efficacy/mean_test.h"
#include "metrology/statistics/distributions.h"

namespace sixpoint::metrology {
namespace {

// Of one component of a hole's own deviation; 0 where nothing tells it.
struct HoleEffect {
  double variance = 0, freedom = 0;
};

// Over the components; fitted: parameters that were taken off, which the holes' pattern has lost.
HoleEffect EffectOf(const std::vector<SeenBlade>& blades, const std::vector<int>& columns,
                    const Eigen::Vector2d& angles, int fitted, bool of_directions) {
  HoleEffect effect;
  double sum = 0, freedom = 0;
  for (const int column : columns) {
    const CrossedVariance spread = SpreadOf(blades, column, angles, of_directions);
    if (!spread.hole_variance) continue;
    sum += spread.hole_freedom * *spread.hole_variance;
    freedom += spread.hole_freedom;
  }
  effect.freedom = freedom - fitted;
  if (effect.freedom >= 1) effect.variance = sum / effect.freedom;
  return effect;
}

// What the holes' own deviations leave uncertain of the mean of all blades' estimates; its rows from there on.
CommonCovariance CovarianceOf(const BladeEstimates& estimates, const HoleEffect& position, const HoleEffect& direction,
                              Eigen::Index from, Eigen::Index count) {
  Eigen::MatrixXd by_position = Eigen::MatrixXd::Zero(count, count), by_direction = by_position;
  for (const auto& [hole, gain] : estimates.gains) {
    const Eigen::MatrixXd p = gain.by_position.middleRows(from, count), d = gain.by_direction.middleRows(from, count);
    by_position += position.variance * p * p.transpose();
    by_direction += direction.variance * d * d.transpose();
  }
  CommonCovariance common{by_position + by_direction, 1};
  double parts = 0;
  if (position.variance > 0) parts += SquareSum(by_position) / position.freedom;
  if (direction.variance > 0) parts += SquareSum(by_direction) / direction.freedom;
  if (parts > 0) common.degrees_of_freedom = std::max(1.0, SquareSum(common.covariance) / parts);
  return common;
}

struct Family {
  MeanTest mean;
  CommonCovariance common;
};

Family FamilyOf(const BladeEstimates& estimates, const HoleEffect& position, const HoleEffect& direction,
                Eigen::Index from, Eigen::Index count) {
  std::vector<Eigen::VectorXd> values;
  for (const Eigen::VectorXd& value : estimates.values) values.push_back(value.segment(from, count));
  Family family;
  family.common = CovarianceOf(estimates, position, direction, from, count);
  family.mean = TestMean(values, family.common);
  return family;
}

OffsetTest TestOf(const MeanTest& mean, double level) {
  return {mean.f, mean.p, level, mean.p.has_value() && *mean.p < level};
}

// shared: of this component.
OffsetEstimate EstimateOf(int column, const Family& family, Eigen::Index at, double shared, double confidence) {
  const MeanTest& mean = family.mean;
  OffsetEstimate estimate;
  estimate.component = static_cast<OffsetComponent>(column);
  estimate.value = mean.mean[at];
  const double of_blades = std::pow(mean.standard_uncertainty[at], 2), of_holes = family.common.covariance(at, at);
  const double variance = of_blades + of_holes + shared * shared;
  estimate.shared_standard_uncertainty = shared;
  estimate.standard_uncertainty = std::sqrt(variance);
  if (mean.count < 2) return estimate;
  estimate.standard_deviation = std::sqrt(mean.covariance(at, at));
  // What is shared is a stated uncertainty: known.
  const double parts =
      of_blades * of_blades / (mean.count - 1) + of_holes * of_holes / family.common.degrees_of_freedom;
  estimate.degrees_of_freedom = parts > 0 ? std::min(1e6, variance * variance / parts) : 1e6;
  estimate.expanded_uncertainty =
      StudentQuantile(0.5 + confidence / 2, estimate.degrees_of_freedom) * estimate.standard_uncertainty;
  return estimate;
}

std::vector<int> Joined(std::vector<int> columns, const std::vector<int>& more) {
  columns.insert(columns.end(), more.begin(), more.end());
  return columns;
}

}  // namespace

CrossedVariance SpreadOf(const std::vector<SeenBlade>& blades, int column, const Eigen::Vector2d& angles,
                         bool of_directions) {
  std::map<std::string, int> index;
  std::vector<CrossedObservation> observations;
  for (std::size_t i = 0; i < blades.size(); ++i)
    for (const WeighedOutcome& hole : blades[i]) {
      const SeenOutcome& seen = hole.seen;
      if (seen.across(column, column) < 0.98) continue;  // the component is not seen as it is
      const int of_hole = index.emplace(hole.outcome->hole, static_cast<int>(index.size())).first->second;
      const double value = of_directions ? (seen.direction_rad - seen.direction_by_angles * angles)[column]
                                         : (seen.position_mm - seen.position_by_angles * angles)[column];
      observations.push_back({static_cast<int>(i), of_hole, value});
    }
  return AnalyseCrossed(observations);
}

Offsets EstimateOffsets(const std::vector<SeenBlade>& blades, const Determined& determined,
                        const BladeEstimates& positions_alone, double confidence) {
  Offsets result;
  const auto positions = static_cast<Eigen::Index>(determined.positions.size());
  const auto angles = static_cast<Eigen::Index>(determined.angles.size());
  const double level = (1 - confidence) / (angles > 0 ? 2 : 1);
  const SharedUncertainty shared = SharedBy(blades);
  const BladeEstimates together =
      angles > 0 ? EstimateEach(blades, Joined(determined.positions, determined.angles)) : BladeEstimates{};
  Family shifted;
  std::vector<OffsetEstimate> turned;
  if (!together.values.empty()) {
    Eigen::Vector2d values = Eigen::Vector2d::Zero();
    for (Eigen::Index k = 0; k < angles; ++k)
      for (const Eigen::VectorXd& value : together.values)
        values[determined.angles[static_cast<std::size_t>(k)] - 3] +=
            value[positions + k] / static_cast<double>(together.values.size());
    const int fitted = static_cast<int>(angles);
    const HoleEffect position = EffectOf(blades, determined.positions, values, fitted, false);
    const HoleEffect direction = EffectOf(blades, determined.positions, values, fitted, true);
    const Family family = FamilyOf(together, position, direction, positions, angles);
    result.angles = TestOf(family.mean, level);
    result.angles_used = result.angles.significant;
    for (Eigen::Index k = 0; k < angles; ++k)
      turned.push_back(
          EstimateOf(determined.angles[static_cast<std::size_t>(k)], family, k, shared.angle_rad, confidence));
    if (result.angles_used) {
      result.angle_values = values;
      shifted = FamilyOf(together, position, direction, 0, positions);
    }
  }
  if (!result.angles_used)
    shifted = FamilyOf(positions_alone, EffectOf(blades, determined.positions, {0, 0}, 0, false), {}, 0, positions);
  result.position = TestOf(shifted.mean, level);
  const double position_shared =
      result.angles_used ? std::hypot(shared.position_mm, shared.lever_mm * shared.angle_rad) : shared.position_mm;
  for (Eigen::Index k = 0; k < positions; ++k)
    result.offsets.push_back(
        EstimateOf(determined.positions[static_cast<std::size_t>(k)], shifted, k, position_shared, confidence));
  result.offsets.insert(result.offsets.end(), turned.begin(), turned.end());
  return result;
}

}  // namespace sixpoint::metrology
