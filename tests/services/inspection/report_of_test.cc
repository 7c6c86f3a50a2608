// A report says what its results say, each number where it was measured and nowhere else; with an assessment it says that one's verdicts.
#include "services/inspection/report_of.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "services/inspection/report_groups.h"

namespace sixpoint::inspection {
namespace {

using report::Verdict;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

void SetPoint(double x_mm, double y_mm, double z_mm, geometry::v1::Point* point) {
  point->set_x_mm(x_mm);
  point->set_y_mm(y_mm);
  point->set_z_mm(z_mm);
}

// G1 with three holes, 10 mm from each other.
plant::v1::Part Part() {
  plant::v1::Part part;
  part.set_name("parts/p1");
  part.set_revision(4);
  plant::v1::HoleGroup& group = *part.add_hole_groups();
  group.set_group("G1");
  for (int i = 0; i < 3; ++i) {
    plant::v1::Hole& hole = *group.add_holes();
    hole.set_hole("H" + std::to_string(i + 1));
    SetPoint(10 * i, 0, 0, hole.mutable_start_in_part_mm());
  }
  return part;
}

// H1 is good, H2 is out of its position, H3 was not measured.
v1::Inspection Inspection() {
  v1::Inspection inspection;
  inspection.set_name("inspections/i1");
  inspection.set_blade("blades/sn1");
  inspection.set_registration("registrations/r1");
  inspection.add_scans("scans/s1");
  inspection.set_verdict(v1::VERDICT_NOT_CONFORM);
  inspection.set_decision_rule("ISO 14253-1");
  inspection.mutable_positioning()->set_method(registration::v1::METHOD_SIX_POINT);
  inspection.mutable_recorded_at()->set_seconds(1'795'000'000);
  for (int i = 0; i < 3; ++i) {
    v1::HoleResult& hole = *inspection.add_holes();
    hole.set_group("G1");
    hole.set_hole("H" + std::to_string(i + 1));
    hole.set_position_tolerance_mm(0.1);
    hole.set_inclination_tolerance_deg(1);
    const v1::Verdict verdict = i == 0   ? v1::VERDICT_CONFORM
                                : i == 1 ? v1::VERDICT_NOT_CONFORM
                                         : v1::VERDICT_NOT_MEASURED;
    hole.set_verdict(verdict);
    hole.set_position_verdict(verdict);
    hole.set_inclination_verdict(i == 1 ? v1::VERDICT_CONFORM : verdict);
    if (i == 2) {
      hole.set_reason("no pin stands in it");
      continue;
    }
    const double off_mm = i == 0 ? 0.02 : 0.2;
    hole.set_position_error_mm(off_mm);
    hole.set_position_expanded_uncertainty_um(6);
    hole.set_inclination_error_deg(0.2);
    hole.set_inclination_expanded_uncertainty_deg(0.05);
    SetPoint(10 * i, off_mm, 0, hole.mutable_start_in_part_mm());
    uncertainty::v1::UncertaintyComponent& component = *hole.add_budget();
    component.set_source("points of the pin");
    component.set_standard_uncertainty_um(3);
  }
  return inspection;
}

v1::DeviationMap Map() {
  v1::DeviationMap map;
  map.set_name("deviations/d1");
  map.set_blade("blades/sn1");
  map.set_method(registration::v1::METHOD_BEST_FIT);
  map.mutable_recorded_at()->set_seconds(1'795'000'100);
  v1::DeviationStatistics& whole = *map.add_statistics();
  whole.set_area_mm2(100);
  whole.set_seen_area_mm2(50);
  whole.set_mean_um(3);
  whole.set_rms_um(4);
  whole.set_p50_um(2);
  whole.mutable_lowest()->set_mean_um(-7);
  whole.mutable_lowest()->set_expanded_uncertainty_um(1);
  whole.mutable_highest()->set_mean_um(9);
  whole.mutable_highest()->set_expanded_uncertainty_um(2);
  v1::DeviationStatistics& hidden = *map.add_statistics();
  hidden.set_region("root");
  hidden.set_area_mm2(20);
  return map;
}

v1::ProfileFinding& AddProfile(v1::Verdict verdict, v1::DeviationMap* map) {
  v1::ProfileFinding& profile = *map->add_profiles();
  profile.mutable_tolerance()->set_characteristic(std::to_string(17 + map->profiles_size()));
  profile.mutable_tolerance()->set_zone(v1::PROFILE_ZONE_FORM_AND_LOCATION);
  profile.mutable_tolerance()->set_lower_mm(-0.02);
  profile.mutable_tolerance()->set_upper_mm(0.1);
  profile.set_verdict(verdict);
  profile.mutable_lowest()->set_mean_um(-15);
  profile.mutable_highest()->set_mean_um(20);
  return profile;
}

ReportInputs Inputs() {
  ReportInputs inputs;
  inputs.part = Part();
  inputs.inspections = {Inspection()};
  return inputs;
}

const report::Characteristic* Find(const report::Report& report, const std::string& id) {
  for (const report::CharacteristicGroup& group : report.groups)
    for (const report::Characteristic& one : group.characteristics)
      if (one.id == id) return &one;
  return nullptr;
}

TEST(ReportOf, TellsEachHoleAndWhatWasNotMeasuredHasNoNumber) {
  const report::Report report = ReportOf(Inputs());
  EXPECT_TRUE(Check(report).ok()) << Check(report);
  EXPECT_EQ(report.serial, "sn1");
  EXPECT_EQ(report.part_revision, "4");
  EXPECT_EQ(report.verdict, Verdict::kNotConform);
  ASSERT_THAT(report.holes, SizeIs(3));
  EXPECT_EQ(report.holes[0].id, "G1/H1");
  EXPECT_THAT(*report.holes[1].displacement_mm, ElementsAre(0, 0.2, 0));
  EXPECT_DOUBLE_EQ(*report.holes[1].position_expanded_uncertainty_mm, 0.006);
  EXPECT_EQ(report.holes[1].verdict, Verdict::kNotConform);
  const report::Hole& missing = report.holes[2];
  EXPECT_EQ(missing.verdict, Verdict::kNotMeasured);
  EXPECT_FALSE(missing.displacement_mm || missing.position_expanded_uncertainty_mm || missing.inclination_deg ||
               missing.inclination_expanded_uncertainty_deg);
  EXPECT_EQ(missing.reason, "no pin stands in it");
  const report::Characteristic* position = Find(report, "G1/H3/position");
  ASSERT_NE(position, nullptr);
  EXPECT_FALSE(position->value || position->expanded_uncertainty);
  EXPECT_EQ(position->verdict, Verdict::kNotMeasured);
  EXPECT_EQ(position->upper, 0.1);
  EXPECT_EQ(Find(report, "G1/H2/inclination")->verdict, Verdict::kConform);
  EXPECT_EQ(report.groups[0].rule, "");  // the report's
  EXPECT_THAT(report.groups[0].fit_state, HasSubstr("six datum points"));
  // The budget of the hole that takes most of its tolerance.
  ASSERT_THAT(report.traceability.budgets, SizeIs(1));
  EXPECT_EQ(report.traceability.budgets[0].of, "G1/H2/position");
  EXPECT_EQ(report.traceability.budgets[0].expanded_uncertainty, 6);
}

TEST(ReportOf, OfAMapTellsWhatWasSeen) {
  ReportInputs inputs;
  inputs.maps = {Map()};
  const report::Report unjudged = ReportOf(inputs);
  EXPECT_TRUE(Check(unjudged).ok()) << Check(unjudged);
  EXPECT_EQ(unjudged.verdict, Verdict::kNotMeasured);
  EXPECT_THAT(unjudged.reason, HasSubstr("No tolerance was judged"));
  ASSERT_THAT(unjudged.regions, SizeIs(2));
  EXPECT_EQ(unjudged.regions[0].values->lowest_um, -7);
  EXPECT_EQ(unjudged.regions[0].values->expanded_uncertainty_um, 2);
  EXPECT_FALSE(unjudged.regions[1].values.has_value());
  EXPECT_EQ(unjudged.regions[1].reason, "nothing of it was seen");

  // Too little of it was seen: what was seen is no value of the tolerance.
  AddProfile(v1::VERDICT_CONFORM, &inputs.maps[0]);
  AddProfile(v1::VERDICT_NOT_MEASURED, &inputs.maps[0]).set_reason("0 % were seen, want 95 %");
  inputs.maps[0].set_verdict(v1::VERDICT_NOT_MEASURED);
  const report::Report judged = ReportOf(inputs);
  EXPECT_TRUE(Check(judged).ok()) << Check(judged);
  EXPECT_DOUBLE_EQ(*Find(judged, "18")->value, -0.015);  // nearer to its limit
  EXPECT_FALSE(Find(judged, "19")->value.has_value());
  EXPECT_FALSE(Find(judged, "19")->expanded_uncertainty.has_value());
}

// A square of 20 mm about the origin, counter-clockwise, measured 0.1 mm outside, not seen between the corners 1 and 2.
TEST(ReportOf, ASectionHasItsGapsAndNoVerdict) {
  ReportInputs inputs;
  v1::SectionMeasurement& measurement = inputs.sections.emplace_back();
  measurement.set_name("sections/x1");
  measurement.set_blade("blades/sn1");
  v1::Section& section = *measurement.add_sections();
  section.mutable_plane()->set_section("50 %");
  section.mutable_plane()->mutable_origin_in_part_mm()->set_z_mm(40);
  v1::SectionValue& chord = *section.add_values();
  chord.set_parameter(v1::SECTION_PARAMETER_CHORD_NOSE_TAIL);
  chord.set_unit(v1::SECTION_UNIT_MM);
  chord.set_nominal(20);
  chord.set_value(20.2);
  chord.set_by_noise(0.001);
  v1::SectionValue& radius = *section.add_values();
  radius.set_parameter(v1::SECTION_PARAMETER_LEADING_RADIUS);
  radius.set_unit(v1::SECTION_UNIT_MM);
  radius.set_nominal(1);
  radius.set_reason("the leading end is square: it has no radius");
  v1::SectionOutline& outline = inputs.outlines.emplace_back().emplace_back();
  const int corners[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
  for (int side = 0; side < 4; ++side)
    for (int i = 0; i < 20; ++i) {
      const double t = i / 20.0;
      const auto at = [&](int k) { return 10.0 * ((1 - t) * corners[side][k] + t * corners[(side + 1) % 4][k]); };
      outline.add_nominal_mm(at(0));
      outline.add_nominal_mm(at(1));
      if (side == 1) continue;
      // Outward of this side.
      const double x = side == 3 ? -0.1 : 0, y = side == 0 ? -0.1 : side == 2 ? 0.1 : 0;
      outline.add_measured_mm(at(0) + x);
      outline.add_measured_mm(at(1) + y);
      outline.add_deviations_um(100);
    }
  outline.add_gaps_before(20);
  const report::Report report = ReportOf(inputs);
  EXPECT_TRUE(Check(report).ok()) << Check(report);
  ASSERT_THAT(report.sections, SizeIs(1));
  const report::Section& told = report.sections[0];
  EXPECT_EQ(told.height_mm, 40);
  ASSERT_THAT(told.outlines.nominal, SizeIs(1));
  EXPECT_TRUE(told.outlines.nominal[0].closed);
  for (const report::OutlinePoint& p : told.outlines.nominal[0].points)
    EXPECT_GT(p.x_mm * p.normal_x + p.y_mm * p.normal_y, 0);  // outward
  // One piece, from the gap's end around to its begin.
  ASSERT_THAT(told.outlines.measured, SizeIs(1));
  EXPECT_FALSE(told.outlines.measured[0].closed);
  ASSERT_THAT(told.outlines.measured[0].points, SizeIs(60));
  EXPECT_NEAR(told.outlines.measured[0].points.front().y_mm, 10.1, 1e-12);
  for (const report::OutlinePoint& p : told.outlines.measured[0].points) {
    EXPECT_DOUBLE_EQ(p.deviation_mm, 0.1);
    EXPECT_NEAR(std::hypot(p.normal_x, p.normal_y), 1, 1e-12);
  }
  EXPECT_FALSE(told.outlines.chord_mm || told.outlines.greatest_circle);  // their places were not measured
  ASSERT_THAT(told.parameters, SizeIs(2));
  EXPECT_EQ(told.parameters[0].id, "chord nose tail");
  EXPECT_EQ(told.parameters[0].value, 20.2);
  EXPECT_FALSE(told.parameters[0].expanded_uncertainty.has_value());
  EXPECT_FALSE(told.parameters[0].judged);
  EXPECT_FALSE(told.parameters[1].value.has_value());
  EXPECT_THAT(told.parameters[1].reason, HasSubstr("square"));
  EXPECT_EQ(report.traceability.budgets.at(0).of, "50 %: chord nose tail");
}

plant::v1::Characteristic& AddDrawn(const std::string& balloon, plant::v1::CharacteristicQuantity quantity,
                                    plant::v1::Drawing* drawing) {
  plant::v1::Characteristic& drawn = *drawing->add_characteristics();
  drawn.set_characteristic(balloon);
  drawn.set_name("name of " + balloon);
  drawn.set_requirement("requirement " + balloon);
  drawn.set_quantity(quantity);
  drawn.set_unit(plant::v1::CHARACTERISTIC_UNIT_UM);
  drawn.set_characteristic_class(plant::v1::CHARACTERISTIC_CLASS_MAJOR);
  return drawn;
}

v1::CharacteristicFinding& AddFinding(const plant::v1::Characteristic& drawn, const std::string& feature,
                                      v1::Verdict verdict, v1::Assessment* assessment) {
  v1::CharacteristicFinding& finding = *assessment->add_findings();
  finding.set_characteristic(drawn.characteristic());
  finding.set_feature(feature);
  finding.set_name(drawn.name());
  finding.set_quantity(drawn.quantity());
  finding.set_unit(drawn.unit());
  finding.set_verdict(verdict);
  finding.mutable_decision_rule()->set_kind(plant::v1::DECISION_RULE_KIND_SIMPLE_ACCEPTANCE);
  if (verdict == v1::VERDICT_NOT_MEASURED) return finding;
  finding.set_result("inspections/i1");
  finding.set_method(registration::v1::METHOD_SIX_POINT);
  finding.set_value(42);
  finding.set_expanded_uncertainty(5);
  finding.set_upper_limit(50);
  return finding;
}

TEST(ReportOf, AnAssessmentsVerdictsTakeThePlaceOfTheResults) {
  ReportInputs inputs = Inputs();
  inputs.drawing.set_drawing_number("DWG-1");
  inputs.drawing.set_drawing_revision("C");
  inputs.drawing.mutable_decision_rule()->set_kind(plant::v1::DECISION_RULE_KIND_SIMPLE_ACCEPTANCE);
  plant::v1::Characteristic position =
      AddDrawn("12", plant::v1::CHARACTERISTIC_QUANTITY_HOLE_POSITION, &inputs.drawing);
  inputs.drawing.mutable_characteristics(0)->set_hole_group("G1");
  inputs.drawing.mutable_characteristics(0)->set_datum_system("A|B|C");
  plant::v1::DatumSystem& system = *inputs.drawing.add_datum_systems();
  system.set_datum_system("A|B|C");
  system.set_positioning(plant::v1::DATUM_POSITIONING_SIX_POINT_NORMALS);
  const plant::v1::Characteristic profile =
      AddDrawn("13", plant::v1::CHARACTERISTIC_QUANTITY_PROFILE_FORM, &inputs.drawing);
  v1::Assessment& assessment = inputs.assessment.emplace();
  assessment.set_name("assessments/a1");
  assessment.set_blade("blades/sn1");
  assessment.set_stage(v1::ASSESSMENT_STAGE_MACHINED);
  assessment.set_verdict(v1::VERDICT_NOT_MEASURED);
  v1::CharacteristicFinding& measured_twice = AddFinding(position, "H1", v1::VERDICT_CONFORM, &assessment);
  v1::OtherValue& by_cmm = *measured_twice.add_others();
  by_cmm.set_result("measurements/x1");
  by_cmm.set_value(40);
  v1::OtherValue& otherwise = *measured_twice.add_others();
  otherwise.set_result("inspections/i1");
  otherwise.set_method(registration::v1::METHOD_BEST_FIT);
  otherwise.set_value(39);
  otherwise.set_expanded_uncertainty(6);
  v1::Measurement& measurement = inputs.measurements.emplace_back();
  measurement.set_name("measurements/x1");
  measurement.set_file_sha256(std::string(64, 'a'));
  measurement.mutable_instrument()->set_kind(v1::INSTRUMENT_KIND_CMM);
  measurement.mutable_instrument()->set_manufacturer("Acme");
  measurement.mutable_instrument()->set_model("Nine");
  measurement.mutable_instrument()->set_serial_number("17");
  AddFinding(position, "H2", v1::VERDICT_UNDECIDABLE, &assessment).set_reason("nearer to its limit than U");
  v1::CharacteristicFinding& open = AddFinding(profile, "", v1::VERDICT_NOT_MEASURED, &assessment);
  open.set_reason("no map was among the results");
  open.mutable_decision_rule()->set_kind(plant::v1::DECISION_RULE_KIND_GUARD_FACTOR);
  open.mutable_decision_rule()->set_guard_factor(0.5);

  const report::Report report = ReportOf(inputs);
  EXPECT_TRUE(Check(report).ok()) << Check(report);
  EXPECT_EQ(report.verdict, Verdict::kNotMeasured);  // not NOT_CONFORM, as the inspection has it by the part's record
  EXPECT_EQ(report.drawing, "DWG-1");
  EXPECT_EQ(report.drawing_revision, "C");
  EXPECT_THAT(report.decision_rule, HasSubstr("simple acceptance"));
  ASSERT_THAT(report.groups, SizeIs(2));
  EXPECT_EQ(report.groups[0].name, "Holes G1");
  EXPECT_THAT(report.groups[0].fit_state, HasSubstr("A|B|C: six datum points, exactly"));
  EXPECT_EQ(report.groups[0].rule, "");
  EXPECT_EQ(report.groups[1].name, "Surface");
  EXPECT_THAT(report.groups[1].rule, HasSubstr("by 0.5 U"));
  const report::Characteristic* h1 = Find(report, "12 H1: name of 12");
  ASSERT_NE(h1, nullptr);
  EXPECT_EQ(h1->requirement, "requirement 12");
  EXPECT_EQ(h1->designator, "MAJOR");
  EXPECT_EQ(h1->value, 42);
  EXPECT_EQ(h1->unit, "um");
  ASSERT_THAT(h1->others, SizeIs(2));
  EXPECT_EQ(h1->others[0].source, "CMM Acme Nine, serial number 17");
  EXPECT_EQ(h1->others[0].value, 40);
  EXPECT_FALSE(h1->others[0].expanded_uncertainty.has_value());
  EXPECT_THAT(h1->others[1].source, HasSubstr("best fit"));
  EXPECT_EQ(h1->others[1].expanded_uncertainty, 6);
  ASSERT_THAT(report.traceability.instruments, SizeIs(1));
  EXPECT_EQ(report.traceability.instruments[0].measurement, "measurements/x1");
  const report::Characteristic* surface = Find(report, "13: name of 13");
  ASSERT_NE(surface, nullptr);
  EXPECT_FALSE(surface->value || surface->expanded_uncertainty);
  EXPECT_EQ(surface->reason, "no map was among the results");
  // Each hole by the drawing; what that does not ask of is told without a verdict.
  EXPECT_EQ(report.holes[0].verdict, Verdict::kConform);
  EXPECT_DOUBLE_EQ(*report.holes[0].position_limit_mm, 0.05);
  EXPECT_FALSE(report.holes[0].inclination_limit_deg.has_value());
  EXPECT_EQ(report.holes[1].verdict, Verdict::kUndecidable);
  EXPECT_FALSE(report.holes[2].judged);
  EXPECT_FALSE(report.holes[2].position_limit_mm.has_value());
  EXPECT_THAT(report.traceability.results, ElementsAre("assessments/a1", "inspections/i1"));
}

TEST(ReportOf, CalibrationsAreToldAsTheyWereWhenTheScansCame) {
  ReportInputs inputs = Inputs();
  registration::v1::Registration& registration = inputs.registrations.emplace_back();
  registration.set_name("registrations/r1");
  registration.set_sensor_calibration("calibrations/c1");
  registration.set_rotation_calibration("calibrations/c2");
  registration.mutable_scans_received_at()->set_seconds(1000);
  const auto add = [&](const std::string& name, std::int64_t until_s) -> calibration::v1::Calibration& {
    calibration::v1::Calibration& calibration = inputs.calibrations.emplace_back();
    calibration.set_name(name);
    calibration.set_kind(calibration::v1::CALIBRATION_KIND_SENSOR);
    calibration.mutable_valid_until()->set_seconds(until_s);
    // Over by now: what is told is of then.
    calibration.set_state(calibration::v1::CALIBRATION_STATE_EXPIRED);
    return calibration;
  };
  add("calibrations/c1", 2000);
  add("calibrations/c2", 900);
  add("calibrations/c3", 2000).mutable_withdrawal()->set_reason("collision");
  ingest::v1::Scan& scan = inputs.scans.emplace_back();
  scan.set_name("scans/s1");
  scan.set_sha256(std::string(64, 'a'));
  const report::Traceability told = ReportOf(inputs).traceability;
  ASSERT_THAT(told.calibrations, SizeIs(3));
  EXPECT_EQ(told.calibrations[0].state, "valid when the scans came");
  EXPECT_EQ(told.calibrations[0].kind, "sensor");
  EXPECT_FALSE(told.calibrations[0].valid_from.has_value());
  EXPECT_EQ(told.calibrations[1].state, "not valid any more when the scans came");
  EXPECT_EQ(told.calibrations[2].state, "withdrawn: collision");
  EXPECT_EQ(told.scans.at(0).sha256, std::string(64, 'a'));
  EXPECT_FALSE(told.scans[0].received_at || told.scans[0].point_count);
  EXPECT_THAT(told.registrations, ElementsAre("registrations/r1"));
  EXPECT_THAT(told.software, IsEmpty());
}

}  // namespace
}  // namespace sixpoint::inspection
