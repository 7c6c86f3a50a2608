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
constexpr double kSame = 1e-9;

template <typename Message>
bool Same(const Message& one, const Message& other) {
  google::protobuf::util::DefaultFieldComparator comparator;
  comparator.set_float_comparison(google::protobuf::util::DefaultFieldComparator::APPROXIMATE);
  comparator.SetDefaultFractionAndMargin(kSame, kSame);
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
  return Same(one, other);
}

std::vector<std::string> HolesOf(const Characteristic& characteristic, const plant::v1::Part& part) {
  std::vector<std::string> holes;
  for (const plant::v1::HoleGroup& group : part.hole_groups())
    if (group.group() == characteristic.hole_group())
      for (const plant::v1::Hole& hole : group.holes()) holes.push_back(hole.hole());
  return holes;
}

}  // namespace

const std::string& AssessedResult::name() const {
  return std::visit([](const auto& one) -> const std::string& { return one.name(); }, result);
}

const std::string& AssessedResult::blade() const {
  return std::visit([](const auto& one) -> const std::string& { return one.blade(); }, result);
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
  const auto pitch = [](const std::string& from, const std::string& to) {
    return Feature{from + " to " + to, from, to};
  };
  if (!characteristic.hole().empty())
    return {pair ? pitch(characteristic.hole(), characteristic.to_hole())
                 : Feature{characteristic.hole(), characteristic.hole(), ""}};
  std::vector<Feature> features;
  const std::vector<std::string> holes = HolesOf(characteristic, part);
  for (std::size_t i = 0; i + (pair ? 1 : 0) < holes.size(); ++i)
    features.push_back(pair ? pitch(holes[i], holes[i + 1]) : Feature{holes[i], holes[i], ""});
  return features;
}

double PerMillimetre(const Characteristic& characteristic) {
  return characteristic.unit() == plant::v1::CHARACTERISTIC_UNIT_UM ? 1e3 : 1;
}

std::optional<FoundValue> ProfileIn(const v1::DeviationMap& map, const Drawing& drawing,
                                    const Characteristic& characteristic) {
  if (KindOf(characteristic.quantity()) != ResultKind::kDeviationMap) return std::nullopt;
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
  if (const auto* const inspection = std::get_if<v1::Inspection>(&result.result))
    return HoleValueIn(*inspection, characteristic, feature, part);
  if (const auto* const map = std::get_if<v1::DeviationMap>(&result.result))
    return ProfileIn(*map, drawing, characteristic);
  if (const auto* const sections = std::get_if<v1::SectionMeasurement>(&result.result))
    return SectionValueIn(*sections, drawing, characteristic);
  return MeasuredValueIn(std::get<v1::Measurement>(result.result), characteristic, feature);
}

std::optional<FoundValue> MeasuredValueIn(const v1::Measurement& measurement, const Characteristic& characteristic,
                                          const Feature& feature) {
  for (const v1::MeasuredCharacteristic& one : measurement.values()) {
    if (one.characteristic() != characteristic.characteristic() || one.feature() != feature.feature) continue;
    const auto conversion = ConversionTo(characteristic.unit(), runtime::WordOf(one.unit()));
    if (!conversion) return std::nullopt;  // another revision of the drawing had another unit
    FoundValue found;
    found.reason = one.reason();
    if (!one.has_value()) return found;
    ValueWithUncertainty& value = found.values.emplace_back();
    value.value = conversion->Of(one.value());
    if (one.has_expanded_uncertainty()) value.expanded_uncertainty = conversion->Of(one.expanded_uncertainty());
    return found;
  }
  return std::nullopt;
}

bool IsOf(const AssessedResult& result, const DatumFit& fit) {
  if (result.method() != fit.method) return false;
  if (fit.method != registration::v1::METHOD_LOCAL) return true;
  // The same places: a local fit elsewhere is another datum.
  registration::v1::FitOptions asked, wanted;
  *asked.mutable_regions_in() = result.registration.options().regions_in();
  *wanted.mutable_regions_in() = fit.options.regions_in();
  return Same(asked, wanted) && result.registration.options().regions_out().empty();
}

}  // namespace sixpoint::inspection
