// Holes' values as a drawing asks for them.
#include <algorithm>
#include <cmath>
#include <utility>

#include "metrology/inspection/hole_displacement.h"
#include "metrology/statistics/standard_deviation.h"
#include "services/inspection/characteristic_values.h"
#include "services/runtime/units.h"

namespace sixpoint::inspection {
namespace {

using plant::v1::Characteristic;
using namespace plant::v1;  // NOLINT: quantities' names say whose they are

constexpr char kNotKept[] = "it was inspected before this was kept";
constexpr char kLoose[] = "how loosely the pin stands is not stated (gauge_pin of the part's hole group)";

FoundValue NotMeasured(const std::string& reason) {
  FoundValue found;
  found.reason = reason;
  return found;
}

// The drawing says by which datums a hole is positioned: what other positionings would say is no uncertainty of that. So it is kept apart;
// of inspections from before it was, the budget tells. Of what is left its degrees of freedom are not known: Student's factor of 95 % at eight.
constexpr double kStudentFactor = 2.306;
template <typename Budget>
double WithoutOtherPositionings(double expanded_uncertainty_um, const Budget& budget) {
  double variance_um2 = 0;
  for (const auto& component : budget)
    if (component.source() != metrology::kOtherPositionings)
      variance_um2 += component.standard_uncertainty_um() * component.standard_uncertainty_um();
  return budget.empty() ? expanded_uncertainty_um
                        : std::min(expanded_uncertainty_um, kStudentFactor * std::sqrt(variance_um2));
}

// Of by_along times the displacement along and by_across times that across, um. Where their covariance is not kept the two errors may go
// together in any way: their uncertainties are added.
double DisplacementUncertainty_um(const v1::HoleResult& hole, double by_along, double by_across) {
  if (hole.has_in_stated_positioning()) {
    const v1::StatedPositioning& stated = hole.in_stated_positioning();
    const double variance_um2 = by_along * by_along * stated.along_variance_um2() +
                                2 * by_along * by_across * stated.covariance_um2() +
                                by_across * by_across * stated.across_variance_um2();
    return stated.displacement_coverage_factor() * metrology::StandardDeviation(variance_um2);
  }
  const auto expanded = [](const v1::SignedValue& value) {
    return WithoutOtherPositionings(value.expanded_uncertainty(), value.budget());
  };
  return std::abs(by_along) * expanded(hole.displacement().along_um()) +
         std::abs(by_across) * expanded(hole.displacement().across_um());
}

double PositionUncertainty_um(const v1::HoleResult& hole) {
  return hole.has_in_stated_positioning()
             ? hole.in_stated_positioning().position_expanded_uncertainty_um()
             : WithoutOtherPositionings(hole.position_expanded_uncertainty_um(), hole.budget());
}

double InclinationUncertainty_deg(const v1::HoleResult& hole) {
  return hole.has_in_stated_positioning() ? hole.in_stated_positioning().inclination_expanded_uncertainty_deg()
                                          : hole.inclination_expanded_uncertainty_deg();
}

// Of the hole's start from its nominal one, along a direction that is told across the drawn axis.
FoundValue DisplacementIn(const v1::HoleResult& hole, const Characteristic& characteristic, const HoleGroup& group) {
  if (!hole.has_displacement()) return NotMeasured(kNotKept);
  using Vector = Eigen::Vector3d;
  const auto vector = [](const geometry::v1::Direction& of) { return Vector(of.x(), of.y(), of.z()); };
  const Vector axis = vector(group.axis_in_part()).normalized();
  const Vector stated = vector(characteristic.along_in_part());
  Vector along = (stated - stated.dot(axis) * axis).normalized();
  if (characteristic.quantity() == CHARACTERISTIC_QUANTITY_HOLE_DISPLACEMENT_ACROSS) along = axis.cross(along);
  const v1::HoleDisplacement& displacement = hole.displacement();
  const double by_along = along.dot(vector(displacement.along_in_part()));
  const double by_across = along.dot(vector(displacement.across_in_part()));
  const double mm = PerMillimetre(characteristic) * runtime::kMmPerUm;
  FoundValue found;
  found.values = {{mm * (by_along * displacement.along_um().value() + by_across * displacement.across_um().value()),
                   mm * DisplacementUncertainty_um(hole, by_along, by_across)}};
  return found;
}

// Where nobody says how loosely its pin stands, its hole may be this much wider than drawn (HoleGroup.gauge_pin).
constexpr double kWidest = 1.6;

// How far the start may be off by that; 0 where it is said, or no pin was measured.
double UnstatedPlay_mm(const v1::HoleResult& hole, const HoleGroup& group) {
  if (hole.measured_by() == v1::HOLE_MEASURED_BY_BORE || group.has_gauge_pin() || group.has_pin_standing()) return 0;
  return std::max(0.0, kWidest * group.diameter_mm() - hole.pin_diameter_mm()) / 2;
}

void LeaveOpen(double by, FoundValue* found) {
  if (!(by > 0) || found->values.empty()) return;
  found->open_by += by;
  found->open_reason = kLoose;
}

FoundValue HoleValue(const v1::HoleResult& hole, const Characteristic& characteristic, const Feature& feature,
                     const HoleGroup& group) {
  if (!hole.has_position_error_mm()) return NotMeasured(hole.reason().empty() ? "not measured" : hole.reason());
  const double mm = PerMillimetre(characteristic), play_mm = UnstatedPlay_mm(hole, group);
  FoundValue found;
  switch (characteristic.quantity()) {
    case CHARACTERISTIC_QUANTITY_HOLE_POSITION:
      found.values = {{mm * hole.position_error_mm(), mm * runtime::kMmPerUm * PositionUncertainty_um(hole)}};
      LeaveOpen(mm * play_mm * feature.slant, &found);
      return found;
    case CHARACTERISTIC_QUANTITY_HOLE_INCLINATION:
      found.values = {{hole.inclination_error_deg(), InclinationUncertainty_deg(hole)}};
      LeaveOpen(2 * play_mm / group.depth_mm() / runtime::kRadPerDeg, &found);
      return found;
    case CHARACTERISTIC_QUANTITY_HOLE_DIAMETER:
      if (!hole.has_diameter()) return NotMeasured(hole.diameter_reason().empty() ? kNotKept : hole.diameter_reason());
      found.nominal = mm * group.diameter_mm();
      found.values = {
          {mm * hole.diameter().diameter_mm(), mm * runtime::kMmPerUm * hole.diameter().expanded_uncertainty_um()}};
      return found;
    default:
      found = DisplacementIn(hole, characteristic, group);
      LeaveOpen(mm * play_mm * feature.slant, &found);
      return found;
  }
}

const v1::HoleResult* HoleOf(const AssessedResult& inspection, const std::string& group, const std::string& hole) {
  const auto place = inspection.places.find(group + "/" + hole);
  return place == inspection.places.end() ? nullptr : &std::get<v1::Inspection>(inspection.result).holes(place->second);
}

FoundValue PitchIn(const AssessedResult& inspection, const Characteristic& characteristic, const Feature& feature,
                   const HoleGroup& group) {
  const auto& pitches = std::get<v1::Inspection>(inspection.result).pitches();
  auto place = inspection.places.find(group.group() + "/" + feature.hole + " to " + feature.to_hole);
  if (place == inspection.places.end())
    place = inspection.places.find(group.group() + "/" + feature.to_hole + " to " + feature.hole);
  if (place == inspection.places.end())
    return NotMeasured(pitches.empty() ? kNotKept : "pitches are measured from each hole to the next of its group");
  const v1::HolePitch& pitch = pitches[place->second];
  if (!pitch.has_pitch_mm()) return NotMeasured(pitch.reason());
  FoundValue found;
  const bool is_length = characteristic.quantity() == CHARACTERISTIC_QUANTITY_HOLE_PITCH;
  const double mm = is_length ? PerMillimetre(characteristic) : 1 / group.diameter_mm();
  found.nominal = mm * pitch.nominal_pitch_mm();
  found.values = {
      is_length ? ValueWithUncertainty{mm * pitch.pitch_mm(), mm * runtime::kMmPerUm * pitch.expanded_uncertainty_um()}
                : ValueWithUncertainty{pitch.pitch_over_diameter(), pitch.pitch_over_diameter_expanded_uncertainty()}};
  const auto leave_open = [&](const std::string& hole, double slant) {
    if (const auto* const end = HoleOf(inspection, group.group(), hole); end != nullptr)
      LeaveOpen(mm * UnstatedPlay_mm(*end, group) * slant, &found);
  };
  leave_open(feature.hole, feature.slant);
  leave_open(feature.to_hole, feature.to_slant);
  return found;
}

}  // namespace

std::optional<FoundValue> HoleValueIn(const AssessedResult& inspection, const Characteristic& characteristic,
                                      const Feature& feature, const Part& part) {
  const auto group = std::find_if(part.hole_groups().begin(), part.hole_groups().end(),
                                  [&](const HoleGroup& one) { return one.group() == characteristic.hole_group(); });
  if (KindOf(characteristic.quantity()) != ResultKind::kInspection || group == part.hole_groups().end())
    return std::nullopt;
  if (!feature.to_hole.empty()) return PitchIn(inspection, characteristic, feature, *group);
  const v1::HoleResult* const hole = HoleOf(inspection, characteristic.hole_group(), feature.hole);
  if (hole == nullptr) return std::nullopt;
  return HoleValue(*hole, characteristic, feature, *group);
}

}  // namespace sixpoint::inspection
