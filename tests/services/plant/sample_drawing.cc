#include "tests/services/plant/sample_drawing.h"

#include <cstdio>
#include <cstdlib>

#include "storage/blobs.h"
#include "storage/plant_registry.h"
#include "tests/support/registered.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::plant {
namespace {

void SetPoint(double x, double y, double z, geometry::v1::Point* out) {
  out->set_x_mm(x);
  out->set_y_mm(y);
  out->set_z_mm(z);
}

void AddDatums(v1::Drawing* drawing) {
  v1::DatumSystem& nest = *drawing->add_datum_systems();
  nest.set_datum_system("A|B|C");
  nest.set_positioning(v1::DATUM_POSITIONING_SIX_POINT_NORMALS);
  int point = 0;
  for (const auto& [letter, count] : {std::pair("A", 3), std::pair("B", 2), std::pair("C", 1)}) {
    v1::Datum& datum = *nest.add_datums();
    datum.set_datum(letter);
    for (int i = 0; i < count; ++i) datum.add_datum_points("D" + std::to_string(++point));
  }
  v1::DatumSystem& local = *drawing->add_datum_systems();
  local.set_datum_system("D");
  local.set_positioning(v1::DATUM_POSITIONING_LOCAL);
  local.set_region("root");
  local.add_datums()->set_datum("D");
}

void AddPlaces(v1::Drawing* drawing) {
  v1::DrawingRegion& root = *drawing->add_regions();
  root.set_region("root");
  SetPoint(-20, -20, -1, root.mutable_minimum_in_part_mm());
  SetPoint(20, 20, 12.5, root.mutable_maximum_in_part_mm());
  v1::DrawingRegion& side = *drawing->add_regions();
  side.set_region("pressure side");
  side.mutable_facing_in_part()->set_y(-1);
  side.set_facing_within_deg(70);
  for (const auto& [name, height_mm] : {std::pair("10 %", 10.0), std::pair("50 %", 50.0)}) {
    v1::DrawingSection& section = *drawing->add_sections();
    section.set_section(name);
    section.set_height_mm(height_mm);
    section.set_half_width_mm(0.1);
  }
  v1::DrawingSection& tip = *drawing->add_sections();
  tip.set_section("A-A");
  SetPoint(1.0 / 3, 0, 90, tip.mutable_origin_in_part_mm());
  tip.mutable_normal_in_part()->set_y(0.6);
  tip.mutable_normal_in_part()->set_z(0.8);
  tip.mutable_reference_in_part()->set_x(1);
  SetPoint(-10, 0, 90, tip.mutable_leading_in_part_mm());
  SetPoint(1, 2, 90, tip.mutable_near_in_part_mm());
  tip.set_half_width_mm(0.25);
  SetPoint(0, 24.5, 0, drawing->mutable_neighbour()->mutable_offset_in_part_mm());
  drawing->mutable_neighbour()->set_standard_uncertainty_um(0);
}

v1::Characteristic* Add(v1::Drawing* drawing, const std::string& quantity, v1::CharacteristicUnit unit) {
  v1::Characteristic& one = *drawing->add_characteristics();
  const int number = drawing->characteristics_size();
  one.set_characteristic(std::to_string(number) + (number == 2 ? ".1" : ""));
  one.set_name("the " + quantity);
  one.set_requirement("\xE2\x8C\x80 as noted, " + std::to_string(number));
  one.set_reference_location("sheet 1, zone B" + std::to_string(number));
  one.set_characteristic_class(static_cast<v1::CharacteristicClass>(1 + number % 3));
  v1::CharacteristicQuantity known = v1::CHARACTERISTIC_QUANTITY_UNSPECIFIED;
  if (!CharacteristicQuantity_Parse("CHARACTERISTIC_QUANTITY_" + quantity, &known)) std::exit(1);
  one.set_quantity(known);
  one.set_unit(unit);
  return &one;
}

void AddHoles(v1::Drawing* drawing) {
  constexpr auto kMm = v1::CHARACTERISTIC_UNIT_MM;
  for (const char* quantity : {"HOLE_POSITION", "HOLE_DISPLACEMENT_ALONG", "HOLE_DISPLACEMENT_ACROSS"}) {
    v1::Characteristic& one = *Add(drawing, quantity, v1::CHARACTERISTIC_UNIT_UM);
    one.set_hole_group("G1");
    one.set_upper_limit(60);
    one.set_datum_system("A|B|C");
    one.set_zone(v1::TOLERANCE_ZONE_DIAMETER);
    if (one.characteristic() == "1") continue;
    one.mutable_along_in_part()->set_x(0.6);
    one.mutable_along_in_part()->set_z(0.8);
    one.set_zone(one.characteristic() == "3" ? v1::TOLERANCE_ZONE_HALF_WIDTH : v1::TOLERANCE_ZONE_BORDERS);
    if (one.zone() == v1::TOLERANCE_ZONE_BORDERS) one.set_lower_limit(-20);
  }
  v1::Characteristic& inclination = *Add(drawing, "HOLE_INCLINATION", v1::CHARACTERISTIC_UNIT_DEG);
  inclination.set_hole_group("G1");
  inclination.set_hole("H2");
  inclination.set_upper_limit(0.5);
  inclination.set_datum_system("A|B|C");
  v1::Characteristic& diameter = *Add(drawing, "HOLE_DIAMETER", kMm);
  diameter.set_hole_group("G1");
  diameter.set_nominal(0.44);
  diameter.set_lower_limit(0.43);
  diameter.set_upper_limit(0.47);
  diameter.set_gauge("pin set");
  v1::Characteristic& pitch = *Add(drawing, "HOLE_PITCH", kMm);
  pitch.set_hole_group("G1");
  pitch.set_hole("H1");
  pitch.set_to_hole("H2");
  pitch.set_lower_limit(1.0 / 3);
  v1::Characteristic& ratio = *Add(drawing, "HOLE_PITCH_OVER_DIAMETER", v1::CHARACTERISTIC_UNIT_RATIO);
  ratio.set_hole_group("G1");
  ratio.set_lower_limit(2.5);
}

void AddProfiles(v1::Drawing* drawing) {
  for (const char* quantity :
       {"PROFILE_FORM", "PROFILE_FORM_AND_LOCATION", "SECTION_PROFILE_FORM", "SECTION_PROFILE_FORM_AND_LOCATION"}) {
    v1::Characteristic& one = *Add(drawing, quantity, v1::CHARACTERISTIC_UNIT_MM);
    const bool section = std::string(quantity).rfind("SECTION", 0) == 0;
    if (section) one.set_section("50 %");
    if (!section) one.set_least_coverage(0.9);
    one.set_zone(v1::TOLERANCE_ZONE_WIDTH);
    one.set_upper_limit(0.1);
    if (std::string(quantity).find("LOCATION") != std::string::npos) one.set_datum_system("D");
  }
  drawing->mutable_characteristics(drawing->characteristics_size() - 4)->set_region("pressure side");
}

void AddSections(v1::Drawing* drawing) {
  for (const char* quantity : {"SECTION_CHORD", "SECTION_THICKNESS", "SECTION_LEADING_EDGE_RADIUS",
                               "SECTION_TRAILING_EDGE_RADIUS", "SECTION_LEADING_EDGE_FORM",
                               "SECTION_TRAILING_EDGE_FORM", "SECTION_CAMBER_HEIGHT", "BOW_X", "BOW_Y", "THROAT"}) {
    v1::Characteristic& one = *Add(drawing, quantity, v1::CHARACTERISTIC_UNIT_MM);
    one.set_section("50 %");
    one.set_upper_limit(2.5);
  }
  for (const char* quantity : {"SECTION_STAGGER", "TWIST"}) {
    v1::Characteristic& one = *Add(drawing, quantity, v1::CHARACTERISTIC_UNIT_DEG);
    one.set_section("A-A");
    one.set_lower_limit(-1.5);
    one.set_upper_limit(-0.5);
  }
  v1::Characteristic& place = *Add(drawing, "SECTION_THICKNESS_PLACE", v1::CHARACTERISTIC_UNIT_RATIO);
  place.set_section("10 %");
  place.set_nominal(0.35);
  place.set_lower_limit(0.3);
  place.set_upper_limit(0.4);
  place.set_algorithm(v1::CHARACTERISTIC_ALGORITHM_TWO_POINT);
}

}  // namespace

v1::Characteristic* Of(v1::CreateDrawingRequest* request, v1::CharacteristicQuantity quantity) {
  for (v1::Characteristic& one : *request->mutable_drawing()->mutable_characteristics())
    if (one.quantity() == quantity) return &one;
  std::fprintf(stderr, "the sample has no %s\n", CharacteristicQuantity_Name(quantity).c_str());
  std::exit(1);
}

v1::CreateDrawingRequest SampleDrawing() {
  v1::CreateDrawingRequest request;
  request.set_drawing_id("vane-70");
  v1::Drawing& drawing = *request.mutable_drawing();
  drawing.set_part("parts/vane");
  drawing.add_part_revisions(1);
  drawing.add_part_revisions(2);
  drawing.set_drawing_number("70-1184");
  drawing.set_drawing_revision("C");
  drawing.set_part_number("1184-01");
  drawing.set_part_name("vane, stage 1");
  drawing.set_part_revision_level("B");
  drawing.add_additional_changes("ECN 2231");
  drawing.mutable_decision_rule()->set_kind(v1::DECISION_RULE_KIND_ISO_14253_1);
  drawing.mutable_decision_rule()->set_edition("2017");
  AddPlaces(&drawing);
  AddDatums(&drawing);
  AddHoles(&drawing);
  AddProfiles(&drawing);
  AddSections(&drawing);
  v1::Characteristic& elsewhere = *Add(&drawing, "MEASURED_ELSEWHERE", v1::CHARACTERISTIC_UNIT_UM);
  elsewhere.set_name("Ra");
  elsewhere.set_upper_limit(1.6);
  elsewhere.set_designator("KC");
  elsewhere.set_designed_tooling("T-7");
  elsewhere.mutable_decision_rule()->set_kind(v1::DECISION_RULE_KIND_GUARD_FACTOR);
  elsewhere.mutable_decision_rule()->set_guard_factor(0.5);
  v1::ProductRequirement& material = *drawing.add_product_requirements();
  material.set_kind(v1::PRODUCT_REQUIREMENT_KIND_MATERIAL);
  material.set_requirement("nickel alloy");
  material.set_specification("AMS 5663");
  material.set_code("bar");
  material.set_customer_approval(true);
  Of(&request, v1::CHARACTERISTIC_QUANTITY_SECTION_CHORD)->set_algorithm(v1::CHARACTERISTIC_ALGORITHM_NOSE_TAIL);
  Of(&request, v1::CHARACTERISTIC_QUANTITY_SECTION_STAGGER)->set_algorithm(v1::CHARACTERISTIC_ALGORITHM_TANGENT);
  Of(&request, v1::CHARACTERISTIC_QUANTITY_SECTION_STAGGER)->set_datum_system("A|B|C");
  Of(&request, v1::CHARACTERISTIC_QUANTITY_SECTION_THICKNESS)
      ->set_algorithm(v1::CHARACTERISTIC_ALGORITHM_INSCRIBED_CIRCLE);
  Of(&request, v1::CHARACTERISTIC_QUANTITY_TWIST)->set_reference_section("10 %");
  return request;
}

void RegisterVane(const storage::PlantStores& plant) {
  storage::TessellationRow described;
  described.method = "stl";
  described.triangle_count = 12;
  described.closed = true;
  described.minimum_mm = {-10, -10, 0};
  described.maximum_mm = {10, 10, 100};
  const auto tessellation =
      plant.surfaces->Keep("CAD of the vane", "surface of the vane", described, "test", testing::Soon(60));
  if (!tessellation.ok()) std::exit(1);
  for (const char content : {'1', '2', '3'}) {
    storage::PartRow part = testing::PartOf("vane", *tessellation, content);
    storage::HoleGroupRow group;
    group.group = "G1";
    group.diameter_mm = content == '3' ? 0.5 : 0.44;
    group.depth_mm = 6;
    group.axis_in_part = {0, 1, 0};
    group.position_tolerance_mm = 0.06;
    group.inclination_tolerance_deg = 0.5;
    group.position_zone = "DIAMETER";
    group.holes = {{"H1", {0, 10, 20}, {0, 1, 0}}};
    if (content != '3') group.holes.push_back({"H2", {0, 10, 30}, {0, 1, 0}});
    part.hole_groups = {group};
    for (int i = 1; i <= 6; ++i)
      part.datum_points.push_back({(content == '3' ? "E" : "D") + std::to_string(i), {1.0 * i, 10, 5}, {0, 1, 0}});
    storage::RecordEntry entry;
    entry.software_version = "test";
    const auto put = plant.parts->Record({"test.RegisterVane", "", ""}, part, entry, testing::Soon(60));
    if (put.ok()) continue;
    std::fprintf(stderr, "%s\n", put.status().ToString().c_str());
    std::exit(1);
  }
}

}  // namespace sixpoint::plant
