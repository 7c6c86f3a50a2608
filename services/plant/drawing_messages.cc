// Drawings as messages.
#include "services/plant/messages.h"
#include "services/runtime/decision_rule_proto.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/stored_enum.h"
#include "services/runtime/stored_geometry.h"
#include "services/runtime/surface_where.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::plant {
namespace {

using runtime::StoredWords;

// Where something is stored.
void SetPoint(const std::vector<double>& stored, v1::DrawingSection* to,
              geometry::v1::Point* (v1::DrawingSection::*field)()) {
  if (!stored.empty()) runtime::SetPoint(stored, (to->*field)());
}

void Set(const storage::DatumSystemRow& row, StoredWords* words, v1::DatumSystem* to) {
  to->set_datum_system(row.datum_system);
  to->set_positioning(words->ValueOrNone<v1::DatumPositioning>(row.positioning));
  to->set_region(row.region);
  for (const storage::DatumRow& datum : row.datums) {
    v1::Datum* const one = to->add_datums();
    one->set_datum(datum.datum);
    for (const std::string& point : datum.datum_points) one->add_datum_points(point);
  }
}

void Set(const storage::DrawingSectionRow& row, StoredWords*, v1::DrawingSection* to) {
  to->set_section(row.section);
  if (row.height_mm) to->set_height_mm(*row.height_mm);
  SetPoint(row.origin_in_part_mm, to, &v1::DrawingSection::mutable_origin_in_part_mm);
  SetPoint(row.leading_in_part_mm, to, &v1::DrawingSection::mutable_leading_in_part_mm);
  SetPoint(row.near_in_part_mm, to, &v1::DrawingSection::mutable_near_in_part_mm);
  if (!row.normal_in_part.empty()) runtime::SetDirection(row.normal_in_part, to->mutable_normal_in_part());
  if (!row.reference_in_part.empty()) runtime::SetDirection(row.reference_in_part, to->mutable_reference_in_part());
  to->set_half_width_mm(row.half_width_mm);
}

void Set(const storage::DrawingRegionRow& row, StoredWords*, v1::DrawingRegion* to) {
  to->set_region(row.region);
  runtime::SetWhere(row, to);
}

void Set(const storage::CharacteristicRow& row, StoredWords* words, v1::Characteristic* to) {
  to->set_characteristic(row.characteristic);
  to->set_name(row.name);
  to->set_requirement(row.requirement);
  to->set_reference_location(row.reference_location);
  to->set_characteristic_class(words->Value<v1::CharacteristicClass>(row.characteristic_class));
  to->set_designator(row.designator);
  to->set_quantity(words->Value<v1::CharacteristicQuantity>(row.quantity));
  to->set_algorithm(words->ValueOrNone<v1::CharacteristicAlgorithm>(row.algorithm));
  to->set_hole_group(row.hole_group);
  to->set_hole(row.hole);
  to->set_to_hole(row.to_hole);
  if (!row.along_in_part.empty()) runtime::SetDirection(row.along_in_part, to->mutable_along_in_part());
  to->set_section(row.section);
  to->set_reference_section(row.reference_section);
  to->set_region(row.region);
  to->set_unit(words->ValueOrNone<v1::CharacteristicUnit>(row.unit));
  if (row.nominal) to->set_nominal(*row.nominal);
  if (row.lower_limit) to->set_lower_limit(*row.lower_limit);
  if (row.upper_limit) to->set_upper_limit(*row.upper_limit);
  to->set_zone(words->ValueOrNone<v1::ToleranceZone>(row.zone));
  to->set_datum_system(row.datum_system);
  if (row.least_coverage) to->set_least_coverage(*row.least_coverage);
  if (!row.decision_rule.kind.empty()) runtime::ToProto(row.decision_rule, words, to->mutable_decision_rule());
  to->set_gauge(row.gauge);
  to->set_designed_tooling(row.designed_tooling);
}

void Set(const storage::ProductRequirementRow& row, StoredWords* words, v1::ProductRequirement* to) {
  to->set_kind(words->Value<v1::ProductRequirementKind>(row.kind));
  to->set_requirement(row.requirement);
  to->set_specification(row.specification);
  to->set_code(row.code);
  to->set_customer_approval(row.customer_approval);
}

template <typename Rows, typename Messages>
void SetAll(const Rows& rows, StoredWords* words, Messages* to) {
  for (const auto& row : rows) Set(row, words, to->Add());
}

}  // namespace

absl::StatusOr<v1::Drawing> ToProto(const storage::DrawingRow& row) {
  StoredWords words("drawing " + row.drawing_id);
  v1::Drawing drawing;
  drawing.set_name(runtime::NameOf("drawings", row.drawing_id));
  drawing.set_revision(row.revision);
  drawing.set_part(runtime::NameOf("parts", row.part_id));
  for (const int revision : row.part_revisions) drawing.add_part_revisions(revision);
  drawing.set_drawing_number(row.drawing_number);
  drawing.set_drawing_revision(row.drawing_revision);
  drawing.set_part_number(row.part_number);
  drawing.set_part_name(row.part_name);
  drawing.set_part_revision_level(row.part_revision_level);
  for (const std::string& change : row.additional_changes) drawing.add_additional_changes(change);
  runtime::ToProto(row.decision_rule, &words, drawing.mutable_decision_rule());
  SetAll(row.datum_systems, &words, drawing.mutable_datum_systems());
  SetAll(row.sections, &words, drawing.mutable_sections());
  SetAll(row.regions, &words, drawing.mutable_regions());
  if (!row.neighbour_offset_in_part_mm.empty()) {
    runtime::SetPoint(row.neighbour_offset_in_part_mm, drawing.mutable_neighbour()->mutable_offset_in_part_mm());
    drawing.mutable_neighbour()->set_standard_uncertainty_um(row.neighbour_standard_uncertainty_um);
  }
  SetAll(row.characteristics, &words, drawing.mutable_characteristics());
  SetAll(row.product_requirements, &words, drawing.mutable_product_requirements());
  runtime::ToProto(row.recorded.recorded_at, drawing.mutable_created_at());
  drawing.set_requested_by(row.requested_by);
  drawing.set_characteristic_count(row.characteristic_count);
  return words.Checked(std::move(drawing));
}

void LeaveBasic(v1::Drawing* drawing) {
  drawing->clear_datum_systems();
  drawing->clear_sections();
  drawing->clear_regions();
  drawing->clear_characteristics();
  drawing->clear_product_requirements();
}

}  // namespace sixpoint::plant
