#include "metrology/inspection/pitch.h"

#include <algorithm>
#include <cmath>

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

// From one start to the next, projected on a unit direction.
ValueEffects EffectsAlong(const Vector3d& direction, const MeasuredHole& one, const MeasuredHole& next) {
  ValueEffects effects = EffectsOf(direction.transpose() * next.start_per_parameter, next.sources, next.index);
  AddEffects(EffectsOf(direction.transpose() * one.start_per_parameter, one.sources, one.index), -1, &effects);
  double greatest_mm = 0;
  for (std::size_t k = 0; k < std::min(one.moved.size(), next.moved.size()); ++k) {
    const Vector3d further = (next.moved[k].start_in_part_mm - next.start_in_part_mm) -
                             (one.moved[k].start_in_part_mm - one.start_in_part_mm);
    greatest_mm = std::max(greatest_mm, std::abs(direction.dot(further)));
  }
  effects.push_back(OtherPositionings(greatest_mm));
  return effects;
}

// pitch / diameter, the mean of both holes'; what makes both uncertain enters once.
StatedRatio OverDiameter(double pitch_mm, const ValueEffects& effects_mm, const HoleDiameter& one,
                         const HoleDiameter& next) {
  const double diameter_mm = (one.diameter.value_mm + next.diameter.value_mm) / 2;
  const double ratio = pitch_mm / diameter_mm;
  ValueEffects effects;
  AddEffects(effects_mm, 1 / diameter_mm, &effects);
  AddEffects(one.effects_mm, -ratio / diameter_mm / 2, &effects);
  AddEffects(next.effects_mm, -ratio / diameter_mm / 2, &effects);
  const double half_mm = (one.half_interval_mm + next.half_interval_mm) / 2;
  return StateRatio(ratio, effects, {ratio / diameter_mm * half_mm, kPlayInHole});
}

}  // namespace

HolePitch PitchOf(const PitchEnd& one, const PitchEnd& next) {
  HolePitch pitch;
  const Vector3d nominal = next.nominal_start_mm - one.nominal_start_mm;
  pitch.nominal_mm = nominal.norm();
  if (one.measured == nullptr || next.measured == nullptr) {
    pitch.reason = one.measured == nullptr && next.measured == nullptr ? "neither hole was measured"
                   : one.measured == nullptr                           ? "the hole was not measured"
                                                                       : "the next hole was not measured";
    return pitch;
  }
  if (!(pitch.nominal_mm > 0)) {
    pitch.reason = "both holes are drawn at one place";
    return pitch;
  }
  const Vector3d row = nominal / pitch.nominal_mm;
  const Vector3d between = next.measured->start_in_part_mm - one.measured->start_in_part_mm;
  HolePitch::Values values;
  const ValueEffects along = EffectsAlong(row, *one.measured, *next.measured);
  values.along_row = StateLength(row.dot(between), along);
  values.distance = StateLength(between.norm(), EffectsAlong(between.normalized(), *one.measured, *next.measured));
  const double nominal_diameter_mm = (one.nominal_diameter_mm + next.nominal_diameter_mm) / 2;
  ValueEffects over_nominal;
  AddEffects(along, 1 / nominal_diameter_mm, &over_nominal);
  values.over_nominal_diameter = StateRatio(values.along_row.value_mm / nominal_diameter_mm, over_nominal);
  if (one.diameter != nullptr && next.diameter != nullptr)
    values.over_measured_diameter = OverDiameter(values.along_row.value_mm, along, *one.diameter, *next.diameter);
  pitch.values = std::move(values);
  return pitch;
}

}  // namespace sixpoint::metrology
