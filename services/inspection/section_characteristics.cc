// Sections' values as a drawing asks for them.
#include <algorithm>
#include <cmath>

#include "services/inspection/characteristic_values.h"
#include "services/inspection/drawing_orders.h"

namespace sixpoint::inspection {
namespace {

using plant::v1::Characteristic;
using namespace plant::v1;  // NOLINT: quantities' names say whose they are

// Of places and directions that went through a normalisation.
constexpr double kSame = 1e-9;

bool Same(const geometry::v1::Point& one, const geometry::v1::Point& other) {
  return std::abs(one.x_mm() - other.x_mm()) <= kSame && std::abs(one.y_mm() - other.y_mm()) <= kSame &&
         std::abs(one.z_mm() - other.z_mm()) <= kSame;
}

bool Same(const geometry::v1::Direction& one, const geometry::v1::Direction& other) {
  return std::abs(one.x() - other.x()) <= kSame && std::abs(one.y() - other.y()) <= kSame &&
         std::abs(one.z() - other.z()) <= kSame;
}

bool SamePlane(const v1::SectionPlane& one, const v1::SectionPlane& other) {
  return Same(one.origin_in_part_mm(), other.origin_in_part_mm()) &&
         Same(one.normal_in_part(), other.normal_in_part()) &&
         Same(one.reference_in_part(), other.reference_in_part()) &&
         one.has_leading_in_part_mm() == other.has_leading_in_part_mm() &&
         Same(one.leading_in_part_mm(), other.leading_in_part_mm()) &&
         one.has_near_in_part_mm() == other.has_near_in_part_mm() &&
         Same(one.near_in_part_mm(), other.near_in_part_mm());
}

// The one of that plane; none: it was not cut there.
const v1::Section* SectionIn(const v1::SectionMeasurement& sections, const DrawingSection& wanted) {
  if (std::abs(sections.half_width_mm() - wanted.half_width_mm()) > kSame) return nullptr;
  const v1::SectionPlane plane = PlaneOf(wanted);
  for (const v1::Section& section : sections.sections())
    if (SamePlane(section.plane(), plane)) return &section;
  return nullptr;
}

// The parameters that are the quantity: two of a profile.
std::vector<v1::SectionParameter> ParametersOf(const Characteristic& characteristic) {
  const auto by = [&](v1::SectionParameter nose_tail) {
    // Nose-tail, caliper and tangent follow each other in both enums, as do the ways of a thickness with its place between.
    return std::vector{
        static_cast<v1::SectionParameter>(nose_tail + characteristic.algorithm() - CHARACTERISTIC_ALGORITHM_NOSE_TAIL)};
  };
  const bool two_point = characteristic.algorithm() == CHARACTERISTIC_ALGORITHM_TWO_POINT;
  switch (characteristic.quantity()) {
    case CHARACTERISTIC_QUANTITY_SECTION_CHORD:
      return by(v1::SECTION_PARAMETER_CHORD_NOSE_TAIL);
    case CHARACTERISTIC_QUANTITY_SECTION_STAGGER:
      return by(v1::SECTION_PARAMETER_STAGGER_NOSE_TAIL);
    case CHARACTERISTIC_QUANTITY_SECTION_THICKNESS:
      return {two_point ? v1::SECTION_PARAMETER_THICKNESS_TWO_POINT : v1::SECTION_PARAMETER_THICKNESS_INSCRIBED};
    case CHARACTERISTIC_QUANTITY_SECTION_THICKNESS_PLACE:
      return {two_point ? v1::SECTION_PARAMETER_THICKNESS_TWO_POINT_PLACE
                        : v1::SECTION_PARAMETER_THICKNESS_INSCRIBED_PLACE};
    case CHARACTERISTIC_QUANTITY_SECTION_LEADING_EDGE_RADIUS:
      return {v1::SECTION_PARAMETER_LEADING_RADIUS};
    case CHARACTERISTIC_QUANTITY_SECTION_TRAILING_EDGE_RADIUS:
      return {v1::SECTION_PARAMETER_TRAILING_RADIUS};
    case CHARACTERISTIC_QUANTITY_SECTION_LEADING_EDGE_FORM:
      return {v1::SECTION_PARAMETER_LEADING_FORM};
    case CHARACTERISTIC_QUANTITY_SECTION_TRAILING_EDGE_FORM:
      return {v1::SECTION_PARAMETER_TRAILING_FORM};
    case CHARACTERISTIC_QUANTITY_SECTION_CAMBER_HEIGHT:
      return {v1::SECTION_PARAMETER_CAMBER_HEIGHT};
    case CHARACTERISTIC_QUANTITY_SECTION_PROFILE_FORM:
      return {v1::SECTION_PARAMETER_PROFILE_FORM_LEAST, v1::SECTION_PARAMETER_PROFILE_FORM_GREATEST};
    case CHARACTERISTIC_QUANTITY_SECTION_PROFILE_FORM_AND_LOCATION:
      return {v1::SECTION_PARAMETER_PROFILE_LOCATION_LEAST, v1::SECTION_PARAMETER_PROFILE_LOCATION_GREATEST};
    case CHARACTERISTIC_QUANTITY_TWIST:
      return {v1::SECTION_PARAMETER_TWIST};
    case CHARACTERISTIC_QUANTITY_BOW_X:
      return {v1::SECTION_PARAMETER_BOW_X};
    case CHARACTERISTIC_QUANTITY_BOW_Y:
      return {v1::SECTION_PARAMETER_BOW_Y};
    case CHARACTERISTIC_QUANTITY_THROAT:
      return {v1::SECTION_PARAMETER_THROAT};
    default:
      return {};
  }
}

bool IsOrderedSo(const v1::SectionMeasurement& sections, const Drawing& drawing, const Characteristic& characteristic) {
  switch (characteristic.quantity()) {
    case CHARACTERISTIC_QUANTITY_TWIST: {
      const DrawingSection* const reference = SectionOf(drawing, characteristic.reference_section());
      const v1::Section* const found = reference == nullptr ? nullptr : SectionIn(sections, *reference);
      return found != nullptr && found->plane().section() == sections.reference_section();
    }
    case CHARACTERISTIC_QUANTITY_BOW_X:
    case CHARACTERISTIC_QUANTITY_BOW_Y:
      return SamePlane(sections.sections(0).plane(), PlaneOf(drawing.sections(0))) &&
             SamePlane(sections.sections(sections.sections_size() - 1).plane(),
                       PlaneOf(drawing.sections(drawing.sections_size() - 1)));
    case CHARACTERISTIC_QUANTITY_THROAT:
      return Same(sections.neighbour().offset_in_part_mm(), drawing.neighbour().offset_in_part_mm()) &&
             std::abs(sections.neighbour().standard_uncertainty_um() - drawing.neighbour().standard_uncertainty_um()) <=
                 kSame;
    default:
      return true;
  }
}

}  // namespace

std::optional<FoundValue> SectionValueIn(const v1::SectionMeasurement& sections, const Drawing& drawing,
                                         const Characteristic& characteristic) {
  const DrawingSection* const wanted = SectionOf(drawing, characteristic.section());
  if (KindOf(characteristic.quantity()) != ResultKind::kSections || wanted == nullptr || sections.sections().empty())
    return std::nullopt;
  const v1::Section* const section = SectionIn(sections, *wanted);
  if (section == nullptr || !IsOrderedSo(sections, drawing, characteristic)) return std::nullopt;
  FoundValue found;
  for (const v1::SectionParameter parameter : ParametersOf(characteristic)) {
    const auto value = std::find_if(section->values().begin(), section->values().end(),
                                    [&](const v1::SectionValue& one) { return one.parameter() == parameter; });
    if (value == section->values().end()) return std::nullopt;
    const double scale = value->unit() == v1::SECTION_UNIT_MM ? PerMillimetre(characteristic) : 1;
    if (!value->has_value()) {
      found.values.clear();
      found.reason = value->reason();
      return found;
    }
    if (value->has_nominal()) found.nominal = scale * value->nominal();
    found.values.push_back({scale * value->value(), scale * value->expanded_uncertainty()});
  }
  if (found.values.size() > 1) found.nominal.reset();  // a zone about the CAD has none
  return found;
}

}  // namespace sixpoint::inspection
