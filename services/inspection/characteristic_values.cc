#include "services/inspection/characteristic_values.h"

#include <google/protobuf/util/message_differencer.h>

#include <algorithm>
#include <cmath>

#include "services/inspection/stored_verdict.h"
#include "services/inspection/unit_conversion.h"
#include "services/runtime/contract_words.h"

namespace sixpoint::inspection {
namespace {

using plant::v1::Characteristic;
using plant::v1::Drawing;

// Of what went through a normalisation, or radians.
constexpr double kMessageMargin = 1e-9;
// Over wider patches a dent would be averaged away.
constexpr double kGreatestPatch_mm = 2;

template <typename Message>
bool IsSameMessage(const Message& one, const Message& other) {
  google::protobuf::util::DefaultFieldComparator comparator;
  comparator.set_float_comparison(google::protobuf::util::DefaultFieldComparator::APPROXIMATE);
  comparator.SetDefaultFractionAndMargin(kMessageMargin, kMessageMargin);
  google::protobuf::util::MessageDifferencer differencer;
  differencer.set_field_comparator(&comparator);
  return differencer.Compare(one, other);
}

// By what it does: editions until 2013 do the same.
bool SameRule(const v1::ProfileTolerance& one, const v1::ProfileTolerance& other) {
  const metrology::DecisionRule of_one = KernelRuleOf(one.decision_rule()),
                                of_other = KernelRuleOf(other.decision_rule());
  return of_one.kind == of_other.kind && of_one.guard_factor == of_other.guard_factor;
}

bool SameRegion(const v1::DeviationMap& map, const std::string& in_map, const Drawing& drawing,
                const std::string& in_drawing) {
  if (in_map.empty() || in_drawing.empty()) return in_map.empty() && in_drawing.empty();
  const auto of_map = std::find_if(map.regions().begin(), map.regions().end(),
                                   [&](const v1::SurfaceRegion& region) { return region.region() == in_map; });
  const auto of_drawing = std::find_if(drawing.regions().begin(), drawing.regions().end(),
                                       [&](const auto& region) { return region.region() == in_drawing; });
  if (of_map == map.regions().end() || of_drawing == drawing.regions().end()) return false;
  v1::SurfaceRegion one = *of_map, other = RegionOf(*of_drawing);
  one.clear_region();
  other.clear_region();
  return IsSameMessage(one, other);
}

// The start lies on the surface, which the axis may meet at a slant.
double SlantOf(const plant::v1::HoleGroup& group, const plant::v1::Hole& hole) {
  const auto &axis = group.axis_in_part(), &normal = hole.normal_in_part();
  return 1 / std::max(1e-3, std::abs(axis.x() * normal.x() + axis.y() * normal.y() + axis.z() * normal.z()));
}

}  // namespace

const std::string& AssessedResult::name() const {
  return std::visit([](const auto& one) -> const std::string& { return one.name(); }, result);
}

const std::string& AssessedResult::blade() const {
  return std::visit([](const auto& one) -> const std::string& { return one.blade(); }, result);
}

void AssessedResult::IndexPlaces() {
  if (const auto* const inspection = std::get_if<v1::Inspection>(&result)) {
    for (int i = 0; i < inspection->holes_size(); ++i)
      places.emplace(inspection->holes(i).group() + "/" + inspection->holes(i).hole(), i);
    for (int i = 0; i < inspection->pitches_size(); ++i) {
      const v1::HolePitch& pitch = inspection->pitches(i);
      places.emplace(pitch.group() + "/" + pitch.from() + " to " + pitch.to(), i);
    }
  } else if (const auto* const measurement = std::get_if<v1::Measurement>(&result)) {
    for (int i = 0; i < measurement->values_size(); ++i)
      places.emplace(measurement->values(i).characteristic() + "/" + measurement->values(i).feature(), i);
  }
}

registration::v1::Method AssessedResult::method() const {
  if (const auto* const inspection = std::get_if<v1::Inspection>(&result)) return inspection->positioning().method();
  if (const auto* const map = std::get_if<v1::DeviationMap>(&result)) return map->method();
  if (const auto* const sections = std::get_if<v1::SectionMeasurement>(&result)) return sections->method();
  return registration::v1::METHOD_UNSPECIFIED;
}

std::vector<Feature> FeaturesOf(const Characteristic& characteristic, const plant::v1::Part& part) {
  using namespace plant::v1;  // NOLINT: quantities' names say whose they are
  const bool pair = characteristic.quantity() == CHARACTERISTIC_QUANTITY_HOLE_PITCH ||
                    characteristic.quantity() == CHARACTERISTIC_QUANTITY_HOLE_PITCH_OVER_DIAMETER;
  if (characteristic.hole_group().empty()) return {{"", "", ""}};
  std::vector<Feature> features;
  for (const plant::v1::HoleGroup& group : part.hole_groups()) {
    if (group.group() != characteristic.hole_group()) continue;
    const auto slant = [&](const std::string& name) {
      for (const plant::v1::Hole& hole : group.holes())
        if (hole.hole() == name) return SlantOf(group, hole);
      return 1.0;
    };
    if (!characteristic.hole().empty() && pair)
      return {{characteristic.hole() + " to " + characteristic.to_hole(), characteristic.hole(),
               characteristic.to_hole(), slant(characteristic.hole()), slant(characteristic.to_hole())}};
    if (!characteristic.hole().empty())
      return {{characteristic.hole(), characteristic.hole(), "", slant(characteristic.hole())}};
    for (int i = 0; i + (pair ? 1 : 0) < group.holes_size(); ++i) {
      const plant::v1::Hole& one = group.holes(i);
      Feature& feature = features.emplace_back(Feature{one.hole(), one.hole(), "", SlantOf(group, one)});
      if (!pair) continue;
      feature.to_hole = group.holes(i + 1).hole();
      feature.feature += " to " + feature.to_hole;
      feature.to_slant = SlantOf(group, group.holes(i + 1));
    }
  }
  return features;
}

double PerMillimetre(const Characteristic& characteristic) {
  return characteristic.unit() == plant::v1::CHARACTERISTIC_UNIT_UM ? 1e3 : 1;
}

std::optional<FoundValue> ProfileIn(const v1::DeviationMap& map, const Drawing& drawing,
                                    const Characteristic& characteristic) {
  if (KindOf(characteristic.quantity()) != ResultKind::kDeviationMap) return std::nullopt;
  if (map.patch_mm() > kGreatestPatch_mm) return std::nullopt;
  const v1::ProfileTolerance wanted = ToleranceOf(drawing, characteristic);
  for (const v1::ProfileFinding& profile : map.profiles()) {
    const v1::ProfileTolerance& tolerance = profile.tolerance();
    if (tolerance.zone() != wanted.zone() || tolerance.lower_mm() != wanted.lower_mm() ||
        tolerance.upper_mm() != wanted.upper_mm() || tolerance.least_coverage() != wanted.least_coverage() ||
        !SameRule(tolerance, wanted) || !SameRegion(map, tolerance.region(), drawing, characteristic.region()))
      continue;
    FoundValue found;
    found.verdict = profile.verdict();
    found.reason = profile.reason();
    const double mm = 1e-3 * PerMillimetre(characteristic);
    for (const auto* patch :
         {profile.has_lowest() ? &profile.lowest() : nullptr, profile.has_highest() ? &profile.highest() : nullptr})
      if (patch != nullptr) found.values.push_back({mm * patch->mean_um(), mm * patch->expanded_uncertainty_um()});
    return found;
  }
  return std::nullopt;
}

std::optional<FoundValue> ValueIn(const AssessedResult& result, const Drawing& drawing,
                                  const Characteristic& characteristic, const Feature& feature,
                                  const plant::v1::Part& part) {
  if (std::holds_alternative<v1::Inspection>(result.result)) return HoleValueIn(result, characteristic, feature, part);
  if (const auto* const map = std::get_if<v1::DeviationMap>(&result.result))
    return ProfileIn(*map, drawing, characteristic);
  if (const auto* const sections = std::get_if<v1::SectionMeasurement>(&result.result))
    return SectionValueIn(*sections, drawing, characteristic);
  return MeasuredValueIn(result, characteristic, feature);
}

std::optional<FoundValue> MeasuredValueIn(const AssessedResult& measurement, const Characteristic& characteristic,
                                          const Feature& feature) {
  const auto place = measurement.places.find(characteristic.characteristic() + "/" + feature.feature);
  if (place == measurement.places.end()) return std::nullopt;
  const v1::MeasuredCharacteristic& one = std::get<v1::Measurement>(measurement.result).values(place->second);
  const auto conversion = ConversionTo(characteristic.unit(), runtime::WordOf(one.unit()));
  if (!conversion) return std::nullopt;
  FoundValue found;
  found.reason = one.reason();
  if (!one.has_value()) return found;
  ValueWithUncertainty& value = found.values.emplace_back();
  value.value = conversion->Of(one.value());
  if (one.has_expanded_uncertainty()) value.expanded_uncertainty = conversion->Of(one.expanded_uncertainty());
  return found;
}

bool IsOf(const AssessedResult& result, const DatumFit& fit) {
  if (result.method() != fit.method) return false;
  const registration::v1::FitOptions& made = result.registration.options();
  constexpr int kAllDirections = 6;
  if (!made.degrees_of_freedom().empty() && made.degrees_of_freedom_size() < kAllDirections) return false;
  // Six points are where they are, whichever points led to them.
  if (fit.method == registration::v1::METHOD_SIX_POINT || fit.method == registration::v1::METHOD_SIX_POINT_NORMALS)
    return true;
  // The same places: a fit to others is another datum.
  registration::v1::FitOptions asked, wanted;
  *asked.mutable_regions_in() = made.regions_in();
  *wanted.mutable_regions_in() = fit.options.regions_in();
  return IsSameMessage(asked, wanted) && made.regions_out().empty();
}

}  // namespace sixpoint::inspection
