// What is refused of drawings, each with its field, its value and what was wanted.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <vector>

#include "tests/services/plant/drawing_service_fixture.h"

namespace sixpoint::plant {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

using DrawingRefusalsTest = DrawingServiceTest;

constexpr auto kAlong = v1::CHARACTERISTIC_QUANTITY_HOLE_DISPLACEMENT_ALONG;
constexpr auto kInclination = v1::CHARACTERISTIC_QUANTITY_HOLE_INCLINATION;
constexpr auto kDiameter = v1::CHARACTERISTIC_QUANTITY_HOLE_DIAMETER;
constexpr auto kPitch = v1::CHARACTERISTIC_QUANTITY_HOLE_PITCH;
constexpr auto kForm = v1::CHARACTERISTIC_QUANTITY_PROFILE_FORM;
constexpr auto kLocation = v1::CHARACTERISTIC_QUANTITY_PROFILE_FORM_AND_LOCATION;
constexpr auto kChord = v1::CHARACTERISTIC_QUANTITY_SECTION_CHORD;
constexpr auto kStagger = v1::CHARACTERISTIC_QUANTITY_SECTION_STAGGER;
constexpr auto kThickness = v1::CHARACTERISTIC_QUANTITY_SECTION_THICKNESS;
constexpr auto kPlace = v1::CHARACTERISTIC_QUANTITY_SECTION_THICKNESS_PLACE;
constexpr auto kTwist = v1::CHARACTERISTIC_QUANTITY_TWIST;

TEST_F(DrawingRefusalsTest, APartOrARevisionThatIsNotThereIsRefused) {
  v1::CreateDrawingRequest request = SampleDrawing();
  request.mutable_drawing()->set_part("parts/disc");
  EXPECT_EQ(runtime::ReasonOf(Create(request).status()), "PART_NOT_FOUND");
  EXPECT_THAT(Refused([](auto* r) { r->mutable_drawing()->add_part_revisions(9); }),
              HasSubstr("drawing.part_revisions[2]: 9, want a revision of parts/vane, whose newest is 3"));
  EXPECT_THAT(Refused([](auto* r) { r->mutable_drawing()->clear_part_revisions(); }),
              HasSubstr("drawing.part_revisions: none"));
  EXPECT_THAT(Refused([](auto* r) { r->mutable_drawing()->add_part_revisions(2); }), HasSubstr("each revision once"));
  EXPECT_THAT(Refused([](auto* r) { r->mutable_drawing()->set_part_revisions(0, 0); }), HasSubstr("1 or more"));
}

TEST_F(DrawingRefusalsTest, WhatARevisionOfThePartDoesNotHaveIsRefused) {
  EXPECT_THAT(
      Refused([](auto* r) { r->mutable_drawing()->add_part_revisions(3); }),
      AllOf(HasSubstr("datum_systems[0].datums[0].datum_points[0]: D1, want a datum point of parts/vane@3 (E1, E2"),
            HasSubstr("characteristics[3].hole: H2, want a hole of G1 of parts/vane@3 (H1)"),
            HasSubstr("characteristics[4].nominal: 0.44, want 0.5 mm, the diameter of G1 in parts/vane@3"),
            HasSubstr("characteristics[5].to_hole: H2"), Not(HasSubstr("@2"))));
  EXPECT_THAT(Refused([](auto* r) {
                const v1::Characteristic ratio = *Of(r, v1::CHARACTERISTIC_QUANTITY_HOLE_PITCH_OVER_DIAMETER);
                r->mutable_drawing()->clear_datum_systems();
                r->mutable_drawing()->clear_characteristics();
                *r->mutable_drawing()->add_characteristics() = ratio;
                r->mutable_drawing()->add_part_revisions(3);
              }),
              HasSubstr("hole_group: G1, want a group of two holes or more in parts/vane@3"));
  EXPECT_THAT(RefusedOf(kPosition, [](auto* c) { c->set_hole_group("G9"); }),
              AllOf(HasSubstr("characteristics[0].hole_group: G9, want a hole group of parts/vane@1 (G1)"),
                    HasSubstr("parts/vane@2 (G1)")));
  EXPECT_THAT(RefusedOf(kAlong,
                        [](auto* c) {
                          c->mutable_along_in_part()->set_x(0);
                          c->mutable_along_in_part()->set_y(1);
                          c->mutable_along_in_part()->set_z(0);
                        }),
              HasSubstr("more than 1 deg off the axis of G1"));
  EXPECT_THAT(
      Refused([](auto* r) { r->mutable_drawing()->mutable_sections(0)->set_height_mm(100.5); }),
      HasSubstr("sections[0].height_mm: 100.5, want a plane that cuts the CAD's box of parts/vane@1, 0 to 100"));
  EXPECT_THAT(
      Refused([](auto* r) { r->mutable_drawing()->mutable_sections(2)->mutable_origin_in_part_mm()->set_z_mm(200); }),
      HasSubstr("sections[2].origin_in_part_mm"));
  EXPECT_THAT(
      Refused([](auto* r) { r->mutable_drawing()->mutable_regions(0)->mutable_maximum_in_part_mm()->set_z_mm(-0.5); }),
      HasSubstr("regions[0].maximum_in_part_mm.z_mm: -0.5, want a box with some of the CAD"));
}

TEST_F(DrawingRefusalsTest, ATitleBlockIsWhole) {
  EXPECT_THAT(
      Refused([](auto* r) {
        v1::Drawing& drawing = *r->mutable_drawing();
        drawing.set_part("vane");
        drawing.clear_drawing_number();
        drawing.set_drawing_revision(" C");
        drawing.set_part_number("a\tb");
        drawing.clear_part_name();
        drawing.add_additional_changes("ECN 2231");
        drawing.clear_characteristics();
        drawing.mutable_product_requirements(0)->clear_kind();
        drawing.mutable_product_requirements(0)->clear_specification();
      }),
      AllOf(HasSubstr("drawing.part: vane"), HasSubstr("drawing.drawing_number: empty"),
            HasSubstr("drawing.drawing_revision:  C, want a text without blanks"),
            HasSubstr("drawing.part_number: text with control characters"), HasSubstr("drawing.part_name: empty"),
            HasSubstr("additional_changes[1]: ECN 2231, want another one"),
            HasSubstr("drawing.characteristics: none, want at least one"),
            HasSubstr("product_requirements[0].kind: empty, want MATERIAL, SPECIAL_PROCESS or FUNCTIONAL_TEST"),
            HasSubstr("product_requirements[0].specification: empty")))
      << "all at once";
  EXPECT_THAT(Refused([](auto* r) { r->set_drawing_id(".hidden"); }), HasSubstr("drawing_id: .hidden"));
}

TEST_F(DrawingRefusalsTest, ADecisionRuleSaysAllOfItselfAndNoMore) {
  const auto rule = [this](const std::function<void(v1::DecisionRule*)>& spoil) {
    return Refused([&](auto* r) { spoil(r->mutable_drawing()->mutable_decision_rule()); });
  };
  EXPECT_THAT(rule([](auto* r) { r->Clear(); }),
              HasSubstr("decision_rule.kind: empty, want ISO_14253_1, SIMPLE_ACCEPTANCE or GUARD_FACTOR"));
  EXPECT_THAT(rule([](auto* r) { r->set_kind(static_cast<v1::DecisionRuleKind>(99)); }), HasSubstr("kind: 99"));
  EXPECT_THAT(rule([](auto* r) { r->clear_edition(); }), HasSubstr("edition: empty, want 1998, 2013 or 2017"));
  EXPECT_THAT(rule([](auto* r) { r->set_edition("2018"); }), HasSubstr("edition: 2018"));
  EXPECT_THAT(rule([](auto* r) { r->set_guard_factor(1); }), HasSubstr("guard_factor: 1, want none, for ISO_14253_1"));
  EXPECT_THAT(rule([](auto* r) { r->set_kind(v1::DECISION_RULE_KIND_SIMPLE_ACCEPTANCE); }),
              HasSubstr("edition: 2017, want none, for SIMPLE_ACCEPTANCE"));
  EXPECT_THAT(rule([](auto* r) { r->set_kind(v1::DECISION_RULE_KIND_GUARD_FACTOR); }),
              AllOf(HasSubstr("edition: 2017"), HasSubstr("guard_factor: empty")));
  for (const double factor : {0.0, -1.0, 3.5, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_THAT(RefusedOf(kElsewhere, [&](auto* c) { c->mutable_decision_rule()->set_guard_factor(factor); }),
                HasSubstr("decision_rule.guard_factor: "));
}

TEST_F(DrawingRefusalsTest, DatumSystemsAreWhatTheirNamesSay) {
  const auto system = [this](int i, const std::function<void(v1::DatumSystem*)>& spoil) {
    return Refused([&](auto* r) { spoil(r->mutable_drawing()->mutable_datum_systems(i)); });
  };
  EXPECT_THAT(system(0, [](auto* s) { s->set_datum_system("A|C|B"); }),
              HasSubstr("datum_system: A|C|B, want the letters of its datums, A|B|C"));
  EXPECT_THAT(system(0, [](auto* s) { s->clear_positioning(); }),
              HasSubstr("positioning: empty, want BEST_FIT, LOCAL"));
  EXPECT_THAT(system(0, [](auto* s) { s->set_region("root"); }), HasSubstr("region: root, want none"));
  EXPECT_THAT(system(0, [](auto* s) { s->mutable_datums(0)->set_datum_points(2, "D1"); }),
              HasSubstr("datum_points[2]: D1, want another one"));
  EXPECT_THAT(system(0, [](auto* s) { s->mutable_datums(0)->add_datum_points("D7"); }),
              HasSubstr("datums[0].datum_points: 4 points, want 3 of the primary"));
  EXPECT_THAT(system(0, [](auto* s) { s->mutable_datums(1)->set_datum("b"); }), HasSubstr("datums[1].datum: b"));
  EXPECT_THAT(system(0, [](auto* s) { s->mutable_datums()->RemoveLast(); }), HasSubstr("datums: 2 datums, want 3"));
  EXPECT_THAT(system(1, [](auto* s) { s->set_region("nowhere"); }), HasSubstr("region: nowhere, want one of"));
  EXPECT_THAT(system(1, [](auto* s) { s->mutable_datums(0)->add_datum_points("D1"); }),
              HasSubstr("datum_points: 1 points, want none, for LOCAL"));
  EXPECT_THAT(system(1, [](auto* s) { s->clear_datums(); }), HasSubstr("datums: 0 datums, want 1 to 3"));
}

TEST_F(DrawingRefusalsTest, PlacesAreWhole) {
  const auto drawing = [this](const std::function<void(v1::Drawing*)>& spoil) {
    return Refused([&](auto* r) { spoil(r->mutable_drawing()); });
  };
  EXPECT_THAT(drawing([](auto* d) { d->mutable_sections(1)->set_section("10 %"); }),
              HasSubstr("sections[1].section: 10 %, want another one"));
  EXPECT_THAT(drawing([](auto* d) { d->mutable_sections(0)->clear_height_mm(); }), HasSubstr("height_mm: empty"));
  EXPECT_THAT(drawing([](auto* d) { d->mutable_sections(2)->set_height_mm(3); }), HasSubstr("one beside an origin"));
  EXPECT_THAT(drawing([](auto* d) { d->mutable_sections(0)->set_half_width_mm(0); }), HasSubstr("half_width_mm: 0"));
  EXPECT_THAT(
      drawing([](auto* d) { *d->mutable_sections(2)->mutable_reference_in_part() = d->sections(2).normal_in_part(); }),
      HasSubstr("reference_in_part: along the normal"));
  EXPECT_THAT(drawing([](auto* d) {
                d->mutable_sections(2)->mutable_normal_in_part()->set_y(std::numeric_limits<double>::infinity());
              }),
              HasSubstr("sections[2].normal_in_part"));
  EXPECT_THAT(drawing([](auto* d) { d->mutable_regions(0)->mutable_maximum_in_part_mm()->set_x_mm(-30); }),
              HasSubstr("regions[0].maximum_in_part_mm.x_mm: -30, want above minimum_in_part_mm, -20"));
  EXPECT_THAT(drawing([](auto* d) { d->mutable_regions(1)->clear_facing_in_part(); }), HasSubstr("not bounded"));
  EXPECT_THAT(drawing([](auto* d) { d->mutable_regions(1)->set_facing_within_deg(181); }), HasSubstr("181"));
  EXPECT_THAT(drawing([](auto* d) { d->clear_neighbour(); }), HasSubstr("drawing.neighbour: empty, want"));
  EXPECT_THAT(drawing([](auto* d) { d->mutable_neighbour()->mutable_offset_in_part_mm()->Clear(); }),
              HasSubstr("neighbour.offset_in_part_mm: 0, 0, 0"));
  EXPECT_THAT(drawing([](auto* d) { d->mutable_neighbour()->clear_standard_uncertainty_um(); }),
              HasSubstr("neighbour.standard_uncertainty_um: empty"));
  EXPECT_THAT(drawing([](auto* d) { d->mutable_sections()->DeleteSubrange(0, 1); }),
              AllOf(HasSubstr("2 sections, want at least 3, for a BOW_X"), HasSubstr("one of the drawing's sections")));
}

TEST_F(DrawingRefusalsTest, ToleranceWithoutUnitOrWithLimitsTheWrongWayRoundIsRefused) {
  EXPECT_THAT(RefusedOf(kDiameter, [](auto* c) { c->clear_unit(); }),
              HasSubstr("characteristics[4].unit: empty, want MM, UM, DEG or RATIO"));
  EXPECT_THAT(RefusedOf(kDiameter, [](auto* c) { c->set_unit(v1::CHARACTERISTIC_UNIT_DEG); }),
              HasSubstr("unit: DEG, want MM or UM, for HOLE_DIAMETER"));
  EXPECT_THAT(RefusedOf(kInclination, [](auto* c) { c->set_unit(v1::CHARACTERISTIC_UNIT_MM); }),
              HasSubstr("unit: MM, want DEG, for HOLE_INCLINATION"));
  EXPECT_THAT(RefusedOf(kDiameter, [](auto* c) { c->set_lower_limit(0.48); }),
              HasSubstr("lower_limit: 0.48, want below upper_limit, 0.47"));
  EXPECT_THAT(RefusedOf(kDiameter, [](auto* c) { c->set_lower_limit(0.47); }), HasSubstr("below upper_limit"));
  EXPECT_THAT(RefusedOf(kElsewhere, [](auto* c) { c->clear_upper_limit(); }),
              HasSubstr("upper_limit: empty, want a lower or an upper limit"));
  for (const double limit : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e9})
    for (const auto quantity : {kPosition, kDiameter, kStagger, kForm})
      EXPECT_THAT(RefusedOf(quantity, [&](auto* c) { c->set_upper_limit(limit); }), HasSubstr(".upper_limit: "));
  EXPECT_THAT(RefusedOf(kDiameter, [](auto* c) { c->set_lower_limit(-0.1); }),
              HasSubstr("lower_limit: -0.1, want 0 to"));
  EXPECT_THAT(RefusedOf(kPlace, [](auto* c) { c->set_upper_limit(1.2); }), HasSubstr("0 to 1 RATIO"));
  EXPECT_THAT(RefusedOf(kInclination, [](auto* c) { c->set_lower_limit(0.1); }), HasSubstr("0 is best"));
  EXPECT_THAT(RefusedOf(kInclination, [](auto* c) { c->set_nominal(0.1); }), HasSubstr("the CAD is the nominal"));
  EXPECT_THAT(RefusedOf(kTwist, [](auto* c) { c->set_nominal(0.1); }), HasSubstr("the CAD is the nominal"));
}

TEST_F(DrawingRefusalsTest, HalfOrWholeIsNotGuessed) {
  EXPECT_THAT(RefusedOf(kPosition, [](auto* c) { c->clear_zone(); }),
              HasSubstr("zone: empty, want DIAMETER or RADIUS, for HOLE_POSITION: half or whole is not guessed"));
  EXPECT_THAT(RefusedOf(kPosition, [](auto* c) { c->set_zone(v1::TOLERANCE_ZONE_WIDTH); }), HasSubstr("zone: WIDTH"));
  EXPECT_THAT(RefusedOf(kForm, [](auto* c) { c->clear_zone(); }), HasSubstr("WIDTH, HALF_WIDTH or BORDERS"));
  EXPECT_THAT(RefusedOf(kDiameter, [](auto* c) { c->set_zone(v1::TOLERANCE_ZONE_DIAMETER); }),
              HasSubstr("zone: DIAMETER, want none"));
  EXPECT_THAT(RefusedOf(kForm, [](auto* c) { c->set_lower_limit(-0.1); }),
              HasSubstr("lower_limit: -0.1, want none with zone WIDTH"));
  EXPECT_THAT(RefusedOf(kForm, [](auto* c) { c->set_upper_limit(-0.1); }), HasSubstr("more than 0: the zone's size"));
  EXPECT_THAT(RefusedOf(kAlong, [](auto* c) { c->clear_lower_limit(); }), HasSubstr("the zone's lower border"));
  EXPECT_THAT(RefusedOf(kForm, [](auto* c) { c->set_nominal(0); }), HasSubstr("the CAD is the nominal"));
}

TEST_F(DrawingRefusalsTest, ACharacteristicNamesWhatItsQuantityNeedsAndNoMore) {
  EXPECT_THAT(RefusedOf(kPosition, [](auto* c) { c->clear_datum_system(); }),
              HasSubstr("datum_system: empty, want a datum system of the drawing, for HOLE_POSITION"));
  EXPECT_THAT(RefusedOf(kPosition, [](auto* c) { c->set_datum_system("A|B"); }),
              HasSubstr("datum_system: A|B, want one of the drawing's datum systems (A|B|C, D)"));
  EXPECT_THAT(RefusedOf(kForm, [](auto* c) { c->set_datum_system("D"); }), HasSubstr("none, for PROFILE_FORM"));
  EXPECT_THAT(RefusedOf(kLocation, [](auto* c) { c->clear_datum_system(); }),
              HasSubstr("for PROFILE_FORM_AND_LOCATION"));
  EXPECT_THAT(RefusedOf(kLocation, [](auto* c) { c->set_hole_group("G1"); }), HasSubstr("hole_group: G1, want none"));
  EXPECT_THAT(RefusedOf(kLocation, [](auto* c) { c->set_region("blade"); }),
              HasSubstr("region: blade, want one of the drawing's regions (root, pressure side)"));
  EXPECT_THAT(RefusedOf(kLocation, [](auto* c) { c->set_least_coverage(1.1); }), HasSubstr("least_coverage: 1.1"));
  EXPECT_THAT(RefusedOf(kChord, [](auto* c) { c->set_least_coverage(0.5); }),
              HasSubstr("least_coverage: 0.5, want none"));
  EXPECT_THAT(RefusedOf(kChord, [](auto* c) { c->clear_section(); }), HasSubstr("section: empty"));
  EXPECT_THAT(RefusedOf(kChord, [](auto* c) { c->set_section("51 %"); }), HasSubstr("(10 %, 50 %, A-A)"));
  EXPECT_THAT(RefusedOf(kChord, [](auto* c) { c->clear_algorithm(); }),
              HasSubstr("algorithm: empty, want NOSE_TAIL, CALIPER or TANGENT, for SECTION_CHORD"));
  EXPECT_THAT(RefusedOf(kThickness, [](auto* c) { c->set_algorithm(v1::CHARACTERISTIC_ALGORITHM_CALIPER); }),
              HasSubstr("algorithm: CALIPER, want INSCRIBED_CIRCLE or TWO_POINT"));
  EXPECT_THAT(RefusedOf(kForm, [](auto* c) { c->set_algorithm(v1::CHARACTERISTIC_ALGORITHM_CALIPER); }),
              HasSubstr("algorithm: CALIPER, want none"));
  EXPECT_THAT(RefusedOf(kTwist, [](auto* c) { c->clear_reference_section(); }), HasSubstr("reference_section: empty"));
  EXPECT_THAT(RefusedOf(kTwist, [](auto* c) { c->set_reference_section("A-A"); }), HasSubstr("another section"));
  EXPECT_THAT(RefusedOf(kPitch, [](auto* c) { c->clear_to_hole(); }), HasSubstr("to_hole: empty"));
  EXPECT_THAT(RefusedOf(kPitch, [](auto* c) { c->clear_hole(); }), HasSubstr("to_hole: H2, want none"));
  EXPECT_THAT(RefusedOf(kPitch, [](auto* c) { c->set_to_hole("H1"); }), HasSubstr("another hole than `hole`"));
  EXPECT_THAT(RefusedOf(kAlong, [](auto* c) { c->clear_along_in_part(); }), HasSubstr("along_in_part: empty"));
  EXPECT_THAT(RefusedOf(kPosition, [](auto* c) { c->mutable_along_in_part()->set_x(1); }),
              HasSubstr("along_in_part: a direction, want none"));
  EXPECT_THAT(RefusedOf(kElsewhere, [](auto* c) { c->set_hole("H1"); }), HasSubstr("the group of hole H1"));
}

TEST_F(DrawingRefusalsTest, BalloonsAndWordsAreChecked) {
  EXPECT_THAT(RefusedOf(kDiameter, [](auto* c) { c->set_characteristic("1"); }),
              HasSubstr("characteristics[4].characteristic: 1, want another one"));
  EXPECT_THAT(RefusedOf(kDiameter,
                        [](auto* c) {
                          c->clear_characteristic();
                          c->clear_name();
                          c->clear_requirement();
                          c->clear_reference_location();
                          c->clear_characteristic_class();
                          c->clear_quantity();
                        }),
              AllOf(HasSubstr("[4].characteristic: empty"), HasSubstr("[4].name: empty"),
                    HasSubstr("[4].requirement: empty"), HasSubstr("[4].reference_location: empty"),
                    HasSubstr("[4].characteristic_class: empty, want MINOR, MAJOR or CRITICAL"),
                    HasSubstr("[4].quantity: empty, want HOLE_POSITION, ")));
  EXPECT_THAT(RefusedOf(kDiameter, [](auto* c) { c->set_quantity(static_cast<v1::CharacteristicQuantity>(77)); }),
              HasSubstr("quantity: 77"));
  EXPECT_THAT(Refused([](auto* r) {
                v1::Characteristic again = *Of(r, kElsewhere);
                again.set_characteristic("99");
                *r->mutable_drawing()->add_characteristics() = again;
              }),
              HasSubstr("name: Ra, want another one: its import has it once"));
}

// What the checks let through and the tables do not would be an INTERNAL: every word of every enum in every characteristic, and figures at random.
TEST_F(DrawingRefusalsTest, WhateverIsSentIsTakenOrRefused) {
  const auto judge = [this](const v1::CreateDrawingRequest& request) {
    const auto created = Create(request);
    EXPECT_TRUE(created.ok() || absl::IsInvalidArgument(created.status()))
        << created.status() << request.drawing().ShortDebugString();
    return created.ok();
  };
  v1::CreateDrawingRequest sample = SampleDrawing();
  std::mt19937 random(17);
  const std::vector<double> figures = {-1e6, -360, -1, -0.5, 0, 1e-9, 0.44, 1, 3, 90, 360, 1000, 1e4, 1e6, 1e7};
  int taken = 0;
  for (int i = 0; i < sample.drawing().characteristics_size(); ++i)
    for (int words = 0; words < 40; ++words) {
      v1::CreateDrawingRequest request = sample;
      v1::Characteristic& one = *request.mutable_drawing()->mutable_characteristics(i);
      const auto& fields = *v1::Characteristic::GetReflection();
      for (int changes = 1 + words % 3; changes > 0; --changes) {
        const auto* const field = v1::Characteristic::descriptor()->field(
            static_cast<int>(random() % static_cast<unsigned>(v1::Characteristic::descriptor()->field_count())));
        if (field->enum_type() != nullptr)
          fields.SetEnumValue(&one, field, static_cast<int>(random() % 27));
        else if (field->cpp_type() == google::protobuf::FieldDescriptor::CPPTYPE_DOUBLE)
          fields.SetDouble(&one, field, figures[random() % figures.size()]);
        else if (random() % 2 == 0)
          fields.ClearField(&one, field);
        else if (field->cpp_type() == google::protobuf::FieldDescriptor::CPPTYPE_STRING)
          fields.SetString(&one, field, random() % 2 == 0 ? "50 %" : "H1");
      }
      taken += judge(request) ? 1 : 0;
    }
  EXPECT_GT(taken, 50);
}

}  // namespace
}  // namespace sixpoint::plant
