#include "services/inspection/efficacy_messages.h"

#include <cmath>

#include "services/runtime/geometry_proto.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/time_proto.h"
#include "services/runtime/units.h"

namespace sixpoint::inspection {

const char* const kEfficacyRule =
    "Hotelling's T squared over blades at 5 % together, half for X, Y, Z and half for A, B where these are determined; "
    "of what is significant "
    "the components beyond their own expanded uncertainty (95 %), where nothing drifts and the newest blade fits; "
    "holes by Holm at 5 %";

namespace {

constexpr int kMostHoleBiases = 2000;

v1::OffsetComponent ProtoOf(metrology::OffsetComponent component) {
  switch (component) {
    case metrology::OffsetComponent::kX:
      return v1::OFFSET_COMPONENT_X;
    case metrology::OffsetComponent::kY:
      return v1::OFFSET_COMPONENT_Y;
    case metrology::OffsetComponent::kZ:
      return v1::OFFSET_COMPONENT_Z;
    case metrology::OffsetComponent::kA:
      return v1::OFFSET_COMPONENT_A;
    case metrology::OffsetComponent::kB:
      break;
  }
  return v1::OFFSET_COMPONENT_B;
}

v1::NotOffered ProtoOf(metrology::NotOffered reason) {
  switch (reason) {
    case metrology::NotOffered::kTooFewBlades:
      return v1::NOT_OFFERED_TOO_FEW_BLADES;
    case metrology::NotOffered::kNotSignificant:
      return v1::NOT_OFFERED_NOT_SIGNIFICANT;
    case metrology::NotOffered::kWithinUncertainty:
      return v1::NOT_OFFERED_WITHIN_UNCERTAINTY;
    case metrology::NotOffered::kDrifts:
      return v1::NOT_OFFERED_DRIFTS;
    case metrology::NotOffered::kNewestBladeOff:
      break;
  }
  return v1::NOT_OFFERED_NEWEST_BLADE_OFF;
}

void Fill(const metrology::OffsetEstimate& offset, v1::OffsetEstimate* out) {
  const double unit = offset.component < metrology::OffsetComponent::kA ? 1 : runtime::kDegPerRad;
  out->set_component(ProtoOf(offset.component));
  out->set_value(unit * offset.value);
  out->set_standard_uncertainty(unit * offset.standard_uncertainty);
  out->set_shared_standard_uncertainty(unit * offset.shared_standard_uncertainty);
  out->set_degrees_of_freedom(offset.degrees_of_freedom);
  if (offset.expanded_uncertainty) out->set_expanded_uncertainty(unit * *offset.expanded_uncertainty);
  if (offset.standard_deviation) out->set_standard_deviation(unit * *offset.standard_deviation);
}

void Fill(const metrology::OffsetTest& test, v1::OffsetTest* out) {
  if (test.f) out->set_f(*test.f);
  if (test.p) out->set_p(*test.p);
  out->set_level(test.level);
  out->set_significant(test.significant);
}

void Fill(const metrology::ComponentSpread& spread, v1::ComponentSpread* out) {
  const metrology::CrossedVariance& v = spread.variance;
  const auto um = [](double variance_mm2) { return 1e3 * std::sqrt(variance_mm2); };
  out->set_component(ProtoOf(spread.component));
  if (v.within_variance) out->set_within_um(um(*v.within_variance));
  out->set_within_degrees_of_freedom(v.within_freedom);
  if (v.between_variance) out->set_between_um(um(*v.between_variance));
  out->set_between_degrees_of_freedom(v.between_freedom);
  if (v.hole_variance) out->set_holes_um(um(*v.hole_variance));
  out->set_holes_degrees_of_freedom(v.hole_freedom);
}

void Fill(const metrology::ComponentTrend& trend, v1::ComponentTrend* out) {
  out->set_component(ProtoOf(trend.component));
  out->set_slope_um_per_day(1e3 * trend.slope.slope);
  if (trend.slope.lower) out->set_slope_lower_um_per_day(1e3 * *trend.slope.lower);
  if (trend.slope.upper) out->set_slope_upper_um_per_day(1e3 * *trend.slope.upper);
  out->set_p(trend.slope.p);
  out->set_significant(trend.significant);
}

void Fill(const metrology::HoleBias& hole, v1::HoleBias* out) {
  out->set_hole(hole.hole);
  out->set_blade_count(hole.blade_count);
  runtime::ToProto(hole.mean_in_machine_mm, out->mutable_mean_in_machine_mm());
  runtime::ToProto(hole.mean_in_part_mm, out->mutable_mean_in_part_mm());
  if (hole.own_in_machine_mm) runtime::ToProto(*hole.own_in_machine_mm, out->mutable_own_in_machine_mm());
  if (hole.own_expanded_uncertainty_mm) out->set_own_expanded_uncertainty_um(1e3 * *hole.own_expanded_uncertainty_mm);
  if (hole.p) out->set_p(*hole.p);
  if (hole.adjusted_p) out->set_adjusted_p(*hole.adjusted_p);
  out->set_significant(hole.significant);
}

void Fill(const metrology::BladeMean& mean, const PeriodOutcomes::Origin& origin, v1::BladeMean* out) {
  out->set_blade(runtime::NameOf("blades", mean.blade));
  out->set_inspection(runtime::NameOf("inspections", origin.inspection_id));
  runtime::ToProto(origin.corrected_at, out->mutable_corrected_at());
  out->set_hole_count(mean.hole_count);
  out->set_reported_count(origin.reported_count);
  if (mean.position_mm[0]) out->set_x_mm(*mean.position_mm[0]);
  if (mean.position_mm[1]) out->set_y_mm(*mean.position_mm[1]);
  if (mean.position_mm[2]) out->set_z_mm(*mean.position_mm[2]);
}

// What is of another calibration, or of another record of the machine, is told and not offered.
void Offer(const PeriodOutcomes& period, const metrology::Efficacy& efficacy, v1::EfficacyPeriod* out) {
  for (const metrology::NotOffered reason : efficacy.reasons) out->add_not_offered(ProtoOf(reason));
  if (!period.in_force) out->add_not_offered(v1::NOT_OFFERED_NOT_IN_FORCE);
  if (!out->not_offered().empty()) return;
  for (const metrology::OffsetEstimate& offset : efficacy.offsets)
    if (offset.offered) Fill(offset, out->mutable_offered_offset()->add_components());
}

}  // namespace

void ToProto(const std::string& machine_id, const PeriodOutcomes& period, const metrology::Efficacy& efficacy,
             v1::EfficacyPeriod* out) {
  out->set_sensor_calibration(runtime::NameOf("calibrations", period.sensor_calibration_id));
  out->set_rotation_calibration(runtime::NameOf("calibrations", period.rotation_calibration_id));
  out->set_machine(runtime::RevisedName("machines", machine_id, period.machine_revision));
  out->set_in_force(period.in_force);
  for (std::size_t i = 0; i < efficacy.blades.size(); ++i)
    Fill(efficacy.blades[i], period.origins[i], out->add_blades());
  out->set_hole_count(efficacy.hole_count);
  bool turns = false;
  for (const metrology::OffsetEstimate& offset : efficacy.offsets) {
    Fill(offset, out->add_offsets());
    turns |= offset.component >= metrology::OffsetComponent::kA;
  }
  for (const metrology::OffsetComponent component : efficacy.not_determined)
    out->add_not_determined(ProtoOf(component));
  out->set_angles_used(efficacy.angles_used);
  if (efficacy.condition_number && std::isfinite(*efficacy.condition_number))
    out->set_condition_number(*efficacy.condition_number);
  Fill(efficacy.position, out->mutable_position_test());
  if (turns) Fill(efficacy.angles, out->mutable_angle_test());
  for (const metrology::ComponentSpread& spread : efficacy.spreads) Fill(spread, out->add_spreads());
  for (const metrology::ComponentTrend& trend : efficacy.trends) Fill(trend, out->add_trends());
  if (efficacy.newest_p) out->set_newest_blade_p(*efficacy.newest_p);
  out->set_newest_blade_off(efficacy.newest_off);
  for (const metrology::HoleBias& hole : efficacy.holes) {
    if (out->holes_size() == kMostHoleBiases) break;
    Fill(hole, out->add_holes());
  }
  Offer(period, efficacy, out);
}

void ToProto(const LeftOutCounts& counts, v1::LeftOut* out) {
  out->set_not_inspected(counts.not_inspected);
  out->set_withdrawn(counts.withdrawn);
  out->set_positioning_open(counts.positioning_open);
  out->set_no_hole(counts.no_hole);
  out->set_superseded_inspections(counts.superseded_inspections);
}

}  // namespace sixpoint::inspection
