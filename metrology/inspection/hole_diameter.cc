#include "metrology/inspection/hole_diameter.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace sixpoint::metrology {
namespace {

constexpr double kKnown = std::numeric_limits<double>::infinity();

ValueEffect Own(const std::string& source, int hole, double standard_uncertainty_mm) {
  return {source, kKnown, hole, Eigen::RowVectorXd::Constant(1, standard_uncertainty_mm)};
}

// Of the cylinder as seen, whatever a certificate says of it: the radius that a certificate took part in follows all but the points by
// radius_kept of what it would.
ValueEffects SeenEffects(const PinFit& fit, const MeasuredHole& hole) {
  const Eigen::Matrix<double, 1, 5> radius = Eigen::Matrix<double, 1, 5>::Unit(4);
  ValueEffects effects;
  for (const ValueEffect& effect : EffectsOf(2 / fit.radius_kept * radius, hole.sources, hole.index)) {
    if (effect.source == kPinStanding) continue;
    if (effect.source == kPinPoints || effect.source == kBorePoints)
      effects.push_back(Own(effect.source, hole.index, 2 * std::sqrt(fit.seen_radius_variance_mm2)));
    else
      effects.push_back(effect);
  }
  return effects;
}

// Anywhere within, as likely.
ValueEffect SeenOtherwise(int hole, const PinLimits& limits) {
  return Own(kSeenOtherwise, hole, limits.greatest_diameter_difference_um / 1e3 / std::sqrt(3.0));
}

}  // namespace

PinDiameter PinDiameterOf(const NominalPin& nominal, const PinFit& fit, const MeasuredHole& hole,
                          const PinLimits& limits) {
  PinDiameter diameter;
  ValueEffects effects = SeenEffects(fit, hole);
  diameter.seen = StateLength(2 * fit.radius_mm, effects);
  if (nominal.gauge) {
    diameter.own = StateLength(nominal.gauge->diameter_mm,
                               {Own(kPinCertificate, hole.index, nominal.gauge->diameter_standard_uncertainty_mm)});
  } else {
    effects.push_back(SeenOtherwise(hole.index, limits));
    diameter.own = StateLength(2 * fit.radius_mm, effects);
  }
  return diameter;
}

HoleDiameterFinding DiameterByPin(const NominalPin& nominal, const PinFit& fit) {
  if (!nominal.gauge)
    return {std::nullopt,
            "the play of the pin is not stated (gauge_pin of the part's hole group): the hole may be wider"};
  const GaugePin& gauge = *nominal.gauge;
  // A pin that is seen to be another than its certificate says, beyond what both may err, may be the one or the other (PlayOf).
  const double err_mm =
      2 * std::hypot(gauge.diameter_standard_uncertainty_mm, 2 * std::sqrt(fit.seen_radius_variance_mm2));
  const double seen_mm =
      std::abs(2 * fit.radius_mm - gauge.diameter_mm) > err_mm ? 2 * fit.radius_mm : gauge.diameter_mm;
  const double least_mm = std::min(seen_mm, gauge.diameter_mm);
  const double greatest_mm = std::max(seen_mm, gauge.diameter_mm) + gauge.greatest_play_mm;
  HoleDiameter hole;
  hole.half_interval_mm = (greatest_mm - least_mm) / 2;
  hole.effects_mm = {Own(kPinCertificate, 0, gauge.diameter_standard_uncertainty_mm)};
  hole.diameter = StateLength((least_mm + greatest_mm) / 2, hole.effects_mm, {hole.half_interval_mm, kPlayInHole});
  return {std::move(hole), ""};
}

HoleDiameter DiameterOfBore(const PinFit& fit, const MeasuredHole& hole, const PinLimits& limits) {
  HoleDiameter found;
  found.effects_mm = SeenEffects(fit, hole);
  found.effects_mm.push_back(SeenOtherwise(hole.index, limits));
  found.diameter = StateLength(2 * fit.radius_mm, found.effects_mm);
  return found;
}

}  // namespace sixpoint::metrology
