// A first article's forms account for all of a drawing; nobody's number, name or certificate is made up.
#include "services/inspection/first_article_of.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace sixpoint::inspection {
namespace {

using report::FirstArticle;
using report::Verdict;
using ::testing::HasSubstr;
using ::testing::SizeIs;

plant::v1::Drawing DrawingOfVane() {
  plant::v1::Drawing drawing;
  drawing.set_name("drawings/dwg");
  drawing.set_drawing_number("DWG-1");
  drawing.set_drawing_revision("C");
  drawing.set_part_number("vane-4711");
  drawing.set_part_name("Vane, stage 2");
  drawing.set_part_revision_level("3");
  drawing.add_additional_changes("ECO-1");
  drawing.add_additional_changes("ECO-2");
  for (const char* balloon : {"1", "2", "3"}) {
    plant::v1::Characteristic& drawn = *drawing.add_characteristics();
    drawn.set_characteristic(balloon);
    drawn.set_name(std::string("name ") + balloon);
    drawn.set_requirement(std::string("requirement ") + balloon);
    drawn.set_reference_location("sheet 1, zone C4");
    drawn.set_characteristic_class(plant::v1::CHARACTERISTIC_CLASS_CRITICAL);
    drawn.set_designator("KC");
    drawn.set_unit(plant::v1::CHARACTERISTIC_UNIT_MM);
  }
  drawing.mutable_characteristics(2)->set_designed_tooling("gauge T-5");
  const auto require = [&](plant::v1::ProductRequirementKind kind, const char* what, bool approval) {
    plant::v1::ProductRequirement& requirement = *drawing.add_product_requirements();
    requirement.set_kind(kind);
    requirement.set_requirement(what);
    requirement.set_specification(std::string("spec of ") + what);
    requirement.set_customer_approval(approval);
  };
  require(plant::v1::PRODUCT_REQUIREMENT_KIND_MATERIAL, "alloy", false);
  require(plant::v1::PRODUCT_REQUIREMENT_KIND_SPECIAL_PROCESS, "coating", true);
  require(plant::v1::PRODUCT_REQUIREMENT_KIND_FUNCTIONAL_TEST, "flow", false);
  return drawing;
}

// Characteristic 1 at two holes, one of them out; 2 conforms; of 3 there is nothing.
v1::Assessment AssessmentOfVane() {
  v1::Assessment assessment;
  assessment.set_name("assessments/a1");
  assessment.set_blade("blades/sn1");
  assessment.mutable_recorded_at()->set_seconds(1'795'000'000);
  const auto add = [&](const char* balloon, const char* feature, v1::Verdict verdict) {
    v1::CharacteristicFinding& finding = *assessment.add_findings();
    finding.set_characteristic(balloon);
    finding.set_feature(feature);
    finding.set_name("name");
    finding.set_unit(plant::v1::CHARACTERISTIC_UNIT_MM);
    finding.set_verdict(verdict);
    finding.set_value(0.5);
    finding.set_expanded_uncertainty(0.01);
    finding.set_result("inspections/i1");
  };
  add("1", "h1", v1::VERDICT_CONFORM);
  add("1", "h2", v1::VERDICT_NOT_CONFORM);
  add("2", "", v1::VERDICT_CONFORM);
  return assessment;
}

std::string RefusalOf(const v1::FirstArticleFields& fields) {
  return std::string(FirstArticleOf(AssessmentOfVane(), DrawingOfVane(), fields).status().message());
}

TEST(FirstArticleOf, LeavesBlankWhatNobodyGave) {
  const auto made = FirstArticleOf(AssessmentOfVane(), DrawingOfVane(), {});
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_TRUE(Check(*made).ok()) << Check(*made);
  EXPECT_EQ(made->part_number, "vane-4711");
  EXPECT_EQ(made->serial_number, "sn1");
  EXPECT_EQ(made->fair_identifier, "");
  EXPECT_EQ(made->form1.drawing_revision, "C");
  EXPECT_EQ(made->form1.additional_changes, "ECO-1, ECO-2");
  EXPECT_EQ(made->form1.organization_name, "");
  EXPECT_EQ(made->form1.verified.name, "");
  EXPECT_FALSE(made->form1.verified.date.has_value());
  ASSERT_THAT(made->form2.materials, SizeIs(2));
  EXPECT_EQ(made->form2.materials[0].specification, "spec of alloy");
  EXPECT_EQ(made->form2.materials[0].customer_approval, "NA");
  EXPECT_EQ(made->form2.materials[1].customer_approval, "");  // asked for, and not given
  EXPECT_EQ(made->form2.materials[1].certificate, "");
  ASSERT_THAT(made->form2.tests, SizeIs(1));
  EXPECT_EQ(made->form2.tests[0].procedure, "spec of flow");
}

TEST(FirstArticleOf, AccountsForEveryCharacteristicOfTheDrawing) {
  const auto made = FirstArticleOf(AssessmentOfVane(), DrawingOfVane(), {});
  ASSERT_TRUE(made.ok()) << made.status();
  ASSERT_THAT(made->form3, SizeIs(4));
  const FirstArticle::Line &first = made->form3[0], &out = made->form3[1], &missing = made->form3[3];
  EXPECT_EQ(first.number, "1 h1");
  EXPECT_EQ(first.reference_location, "sheet 1, zone C4");
  EXPECT_EQ(first.characteristic.requirement, "requirement 1");
  EXPECT_EQ(first.characteristic.designator, "CRITICAL, KC");
  EXPECT_THAT(first.comments, HasSubstr("inspections/i1"));
  EXPECT_EQ(out.characteristic.verdict, Verdict::kNotConform);
  EXPECT_EQ(out.nonconformance, "");
  EXPECT_EQ(missing.number, "3");
  EXPECT_EQ(missing.tooling, "gauge T-5");
  EXPECT_FALSE(missing.characteristic.value || missing.characteristic.expanded_uncertainty);
  EXPECT_EQ(missing.characteristic.verdict, Verdict::kNotMeasured);
  EXPECT_THAT(missing.characteristic.reason, HasSubstr("says nothing of it"));
  EXPECT_EQ(NonconformanceOf(*made), report::Nonconformance::kYes);
  v1::Assessment good = AssessmentOfVane();
  good.mutable_findings(1)->set_verdict(v1::VERDICT_CONFORM);
  EXPECT_EQ(NonconformanceOf(*FirstArticleOf(good, DrawingOfVane(), {})),
            report::Nonconformance::kOpen);  // 3 is missing
}

TEST(FirstArticleOf, TakesWhatPeopleKnow) {
  v1::FirstArticleFields fields;
  fields.set_fair_identifier("FAIR-7");
  fields.set_organization_name("Plant A");
  fields.set_assembly(true);
  fields.add_members()->set_part_number("pin-1");
  fields.set_partial(true);
  fields.set_reason_for_partial("new coating");
  fields.mutable_verified()->set_name("J. Doe");
  fields.mutable_verified()->mutable_signed_at()->set_seconds(1'795'100'000);
  v1::ProductEvidence& coating = *fields.add_evidence();
  coating.set_requirement("coating");
  coating.set_customer_approval("Yes");
  coating.set_certificate("CoC-1");
  v1::ProductEvidence& flow = *fields.add_evidence();
  flow.set_requirement("flow");
  flow.set_certificate("AR-2");
  v1::NonconformanceNumber& number = *fields.add_nonconformances();
  number.set_characteristic("1");
  number.set_number("NC-3");
  const auto made = FirstArticleOf(AssessmentOfVane(), DrawingOfVane(), fields);
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(made->fair_identifier, "FAIR-7");
  EXPECT_TRUE(made->form1.is_assembly);
  EXPECT_EQ(made->form1.parts.at(0).part_number, "pin-1");
  EXPECT_EQ(made->form1.reason_for_partial, "new coating");
  EXPECT_EQ(made->form1.verified.name, "J. Doe");
  EXPECT_TRUE(made->form1.verified.date.has_value());
  EXPECT_EQ(made->form2.materials[1].customer_approval, "Yes");
  EXPECT_EQ(made->form2.materials[1].certificate, "CoC-1");
  EXPECT_EQ(made->form2.tests[0].acceptance_report, "AR-2");
  EXPECT_EQ(made->form3[0].nonconformance, "");  // this hole conforms
  EXPECT_EQ(made->form3[1].nonconformance, "NC-3");
}

TEST(FirstArticleOf, RefusesFieldsThatCannotBeMeant) {
  v1::FirstArticleFields fields;
  fields.set_partial(true);
  EXPECT_THAT(RefusalOf(fields), HasSubstr("fields.reason_for_partial: empty, want why it is a partial one"));
  fields.Clear();
  fields.set_reason_for_partial("new coating");
  EXPECT_THAT(RefusalOf(fields), HasSubstr("fields.reason_for_partial: new coating, want none, for it is a full one"));
  fields.Clear();
  fields.add_members();
  EXPECT_THAT(RefusalOf(fields), HasSubstr("fields.members: 1, want none, for it is a detail"));
  fields.Clear();
  fields.mutable_customer();
  EXPECT_THAT(RefusalOf(fields), HasSubstr("fields.customer.name: empty, want who signed"));
  fields.Clear();
  fields.add_evidence()->set_requirement("paint");
  EXPECT_THAT(RefusalOf(fields),
              HasSubstr("fields.evidence[0].requirement: paint, want a product requirement of drawings/dwg"));
  fields.Clear();
  for (int i = 0; i < 2; ++i) fields.add_evidence()->set_requirement("flow");
  EXPECT_THAT(RefusalOf(fields), HasSubstr("fields.evidence[1].requirement: flow, want another one"));
  fields.Clear();
  fields.add_nonconformances()->set_characteristic("9");
  fields.mutable_nonconformances(0)->set_number("NC-1");
  EXPECT_THAT(RefusalOf(fields), HasSubstr("fields.nonconformances[0].characteristic: 9, want a characteristic of"));
  fields.mutable_nonconformances(0)->set_characteristic("2");
  EXPECT_THAT(RefusalOf(fields),
              HasSubstr("fields.nonconformances[0].characteristic: 2, want one that does not conform"));
}

}  // namespace
}  // namespace sixpoint::inspection
