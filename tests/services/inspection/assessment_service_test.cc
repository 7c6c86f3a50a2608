// The pinned block against a drawing: what its inspection and its map have is judged, what they have not is told, and a blank that no
// motion cures is discarded.
#include "services/inspection/assessment_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "exchange/aqdef.h"
#include "exchange/csv.h"
#include "exchange/qif.h"
#include "services/inspection/assessment_messages.h"
#include "services/inspection/deviation_service.h"
#include "services/inspection/export_service.h"
#include "services/inspection/inspection_service.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "storage/correction_events.h"
#include "storage/events.h"
#include "storage/record.h"
#include "tests/services/correction/judged_plant.h"
#include "tests/support/customers_parts.h"
#include "tests/support/sanitizer.h"
#include "tests/support/some_uuid.h"

namespace sixpoint::inspection {
namespace {

using sixpoint::testing::kSomeUuid;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class AssessmentServiceTest : public ::testing::Test {
 protected:
  AssessmentServiceTest() {
    for (const std::string& scan : plant_.scans) plant_.registration.registration.add_scans(scan);
    auto transaction = plant_.database.database()->Begin(testing::Soon());
    testing::PutDrawingOf(*transaction, "p1", "d1");
    EXPECT_TRUE(transaction->Commit().ok());
    drawing_.set_name("drawings/d1");
    drawing_.set_revision(1);
    drawing_.set_part("parts/p1");
    drawing_.add_part_revisions(1);
    drawing_.mutable_decision_rule()->set_kind(plant::v1::DECISION_RULE_KIND_ISO_14253_1);
    drawing_.mutable_decision_rule()->set_edition("2013");
    plant::v1::DatumSystem& system = *drawing_.add_datum_systems();
    system.set_datum_system("A|B|C");
    system.set_positioning(plant::v1::DATUM_POSITIONING_SIX_POINT);
    plant::v1::DrawingRegion& top = *drawing_.add_regions();
    top.set_region("top side");
    top.mutable_facing_in_part()->set_z(1);
    plant::v1::DrawingSection& section = *drawing_.add_sections();
    section.set_section("50 %");
    section.set_height_mm(-5);
    section.set_half_width_mm(0.1);
  }

  plant::v1::Characteristic& Add(plant::v1::CharacteristicQuantity quantity, plant::v1::CharacteristicUnit unit,
                                 double upper, plant::v1::ToleranceZone zone = plant::v1::TOLERANCE_ZONE_UNSPECIFIED) {
    plant::v1::Characteristic& one = *drawing_.add_characteristics();
    one.set_characteristic(std::to_string(drawing_.characteristics_size()));
    one.set_name("the " + one.characteristic());
    one.set_characteristic_class(plant::v1::CHARACTERISTIC_CLASS_MAJOR);
    one.set_quantity(quantity);
    one.set_unit(unit);
    one.set_upper_limit(upper);
    one.set_zone(zone);
    return one;
  }
  plant::v1::Characteristic& AddHoles(plant::v1::CharacteristicQuantity quantity, plant::v1::CharacteristicUnit unit,
                                      double upper,
                                      plant::v1::ToleranceZone zone = plant::v1::TOLERANCE_ZONE_UNSPECIFIED) {
    plant::v1::Characteristic& one = Add(quantity, unit, upper, zone);
    one.set_hole_group("G1");
    one.set_datum_system("A|B|C");
    return one;
  }
  plant::v1::Characteristic& AddTop(plant::v1::CharacteristicQuantity quantity, double lower_mm, double upper_mm) {
    plant::v1::Characteristic& one =
        Add(quantity, plant::v1::CHARACTERISTIC_UNIT_MM, upper_mm, plant::v1::TOLERANCE_ZONE_BORDERS);
    one.set_lower_limit(lower_mm);
    one.set_region("top side");
    one.set_least_coverage(0.5);
    if (quantity == plant::v1::CHARACTERISTIC_QUANTITY_PROFILE_FORM_AND_LOCATION) one.set_datum_system("A|B|C");
    return one;
  }
  // As the plant has it from now on.
  void Draw() {
    for (const char* name : {"drawings/d1", "drawings/d1@1"}) plant_.drawings.drawings[name] = drawing_;
  }
  v1::AssessmentPlan Plan(v1::AssessmentStage stage = v1::ASSESSMENT_STAGE_MACHINED) {
    Draw();
    v1::PlanAssessmentRequest request;
    request.set_drawing("drawings/d1");
    request.set_stage(stage);
    v1::AssessmentPlan plan;
    const grpc::Status status = stub_->PlanAssessment(runtime::ContextFor(10).get(), request, &plan);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return plan;
  }
  // All that the plan asks for, from the only registration that there is.
  std::vector<std::string> Measure(const v1::AssessmentPlan& plan, double patch_mm = 2) {
    std::vector<std::string> names;
    for (const v1::MeasurementOrder& order : plan.orders()) {
      if (order.has_map()) {
        v1::MapDeviationRequest request = order.map();
        request.set_registration(testing::kRegistration);
        request.set_patch_mm(patch_mm);
        v1::DeviationMap map;
        const grpc::Status status =
            maps_stub_->MapDeviation(runtime::ContextFor(sixpoint::testing::kPatience * 60).get(), request, &map);
        EXPECT_TRUE(status.ok()) << status.error_message();
        names.push_back(map.name());
      } else if (order.has_inspect()) {
        v1::InspectRequest request = order.inspect();
        request.set_blade("blades/sn1");
        for (const std::string& scan : plant_.scans) request.add_scans(scan);
        v1::Inspection inspection;
        const grpc::Status status = inspections_stub_->Inspect(
            runtime::ContextFor(sixpoint::testing::kPatience * 60).get(), request, &inspection);
        EXPECT_TRUE(status.ok()) << status.error_message();
        names.push_back(inspection.name());
      }
    }
    return names;
  }
  static v1::AssessBladeRequest Request(const std::vector<std::string>& results,
                                        v1::AssessmentStage stage = v1::ASSESSMENT_STAGE_MACHINED) {
    v1::AssessBladeRequest request;
    request.set_blade("blades/sn1");
    request.set_drawing("drawings/d1");
    for (const std::string& result : results) request.add_results(result);
    request.set_stage(stage);
    return request;
  }
  absl::StatusOr<v1::Assessment> Assess(const v1::AssessBladeRequest& request) {
    v1::Assessment assessment;
    const grpc::Status status =
        stub_->AssessBlade(runtime::ContextFor(sixpoint::testing::kPatience * 60).get(), request, &assessment);
    if (!status.ok()) return runtime::FromGrpc(status);
    return assessment;
  }
  static const v1::CharacteristicFinding& FindingOf(const v1::Assessment& assessment, const std::string& characteristic,
                                                    const std::string& feature = "") {
    for (const v1::CharacteristicFinding& finding : assessment.findings())
      if (finding.characteristic() == characteristic && finding.feature() == feature) return finding;
    ADD_FAILURE() << characteristic << " " << feature;
    return v1::CharacteristicFinding::default_instance();
  }
  std::string ScrappedBy() {
    const auto found = storage::CorrectionEventsIn(plant_.database.database())->ScrappedBy("sn1", testing::Soon());
    EXPECT_TRUE(found.ok()) << found.status();
    return found.ok() ? found->value_or("") : "";
  }
  std::unique_ptr<clients::BladePeers> NewPeers() {
    return std::make_unique<clients::BladePeers>(plant_.Connect(), plant_.Connect(), plant_.Connect(),
                                                 plant_.Connect());
  }

  testing::JudgedPlant plant_;
  plant::v1::Drawing drawing_;
  inspection::InspectionService inspections_{storage::InspectionsIn(plant_.database.database()), NewPeers(), {}};
  inspection::DeviationService maps_{storage::DeviationsIn(plant_.database.database()), NewPeers(), {}};
  inspection::AssessmentService service_{
      storage::AssessmentsIn(plant_.database.database()),
      {storage::InspectionsIn(plant_.database.database()), storage::DeviationsIn(plant_.database.database()),
       storage::SectionsIn(plant_.database.database()), storage::MeasurementsIn(plant_.database.database())},
      NewPeers(),
      {}};
  inspection::ExportService exports_{storage::InspectionsIn(plant_.database.database()),
                                     storage::DeviationsIn(plant_.database.database()),
                                     storage::AssessmentsIn(plant_.database.database()), NewPeers()};
  testing::InProcessServer server_{{&inspections_, &maps_, &service_, &exports_}};
  std::unique_ptr<v1::InspectionService::Stub> inspections_stub_ = v1::InspectionService::NewStub(server_.Connect());
  std::unique_ptr<v1::DeviationService::Stub> maps_stub_ = v1::DeviationService::NewStub(server_.Connect());
  std::unique_ptr<v1::AssessmentService::Stub> stub_ = v1::AssessmentService::NewStub(server_.Connect());
};

TEST_F(AssessmentServiceTest, JudgesEachCharacteristicAndReadsBackTheSame) {
  AddHoles(plant::v1::CHARACTERISTIC_QUANTITY_HOLE_POSITION, plant::v1::CHARACTERISTIC_UNIT_UM, 120,
           plant::v1::TOLERANCE_ZONE_DIAMETER);
  AddTop(plant::v1::CHARACTERISTIC_QUANTITY_PROFILE_FORM_AND_LOCATION, -0.02, 0.02);
  AddTop(plant::v1::CHARACTERISTIC_QUANTITY_PROFILE_FORM, -0.02, 0.02);
  AddHoles(plant::v1::CHARACTERISTIC_QUANTITY_HOLE_INCLINATION, plant::v1::CHARACTERISTIC_UNIT_DEG, 0.5).set_hole("H1");
  plant::v1::Characteristic& pitch =
      AddHoles(plant::v1::CHARACTERISTIC_QUANTITY_HOLE_PITCH, plant::v1::CHARACTERISTIC_UNIT_MM, 100);
  pitch.clear_datum_system();
  Add(plant::v1::CHARACTERISTIC_QUANTITY_MEASURED_ELSEWHERE, plant::v1::CHARACTERISTIC_UNIT_MM, 1);
  plant::v1::Characteristic& chord =
      Add(plant::v1::CHARACTERISTIC_QUANTITY_SECTION_CHORD, plant::v1::CHARACTERISTIC_UNIT_MM, 1);
  chord.set_section("50 %");
  chord.set_algorithm(plant::v1::CHARACTERISTIC_ALGORITHM_CALIPER);
  const v1::AssessmentPlan plan = Plan();
  ASSERT_EQ(plan.orders_size(), 3) << plan.DebugString();
  EXPECT_THAT(plan.orders(0).characteristics(), ElementsAre("1", "4", "5"));
  EXPECT_THAT(plan.orders(1).characteristics(), ElementsAre("2", "3"));
  EXPECT_EQ(plan.orders(1).method(), registration::v1::METHOD_SIX_POINT);
  EXPECT_EQ(plan.orders(2).sections().sections_size(), 1);
  EXPECT_THAT(plan.measured_elsewhere(), ElementsAre("6"));
  const auto results = Measure(plan);
  ASSERT_EQ(results.size(), 2u);
  const auto assessment = Assess(Request(results));
  ASSERT_TRUE(assessment.ok()) << assessment.status();
  ASSERT_EQ(assessment->findings_size(), 8);
  EXPECT_EQ(assessment->verdict(), v1::VERDICT_NOT_CONFORM);
  EXPECT_EQ(assessment->fate(), v1::BLANK_FATE_UNSPECIFIED);
  EXPECT_EQ(assessment->drawing(), "drawings/d1@1");

  // The inspection's own verdict is by the part's 0.06: the same radius.
  const v1::CharacteristicFinding &good = FindingOf(*assessment, "1", "H1"), &bad = FindingOf(*assessment, "1", "H2");
  const double position_um = 1e3 * (plant_.block.pins[0].start_mm - plant_.block.holes[0].pin.start_mm).norm();
  EXPECT_NEAR(good.value(), position_um, 1);
  EXPECT_EQ(good.upper_limit(), 60);
  EXPECT_FALSE(good.has_lower_limit());
  EXPECT_EQ(good.verdict(), v1::VERDICT_CONFORM) << good.reason();
  EXPECT_EQ(good.result(), results[0]);
  EXPECT_EQ(good.method(), registration::v1::METHOD_SIX_POINT);
  EXPECT_EQ(bad.verdict(), v1::VERDICT_NOT_CONFORM);
  EXPECT_EQ(bad.reason(), "");
  const v1::CharacteristicFinding& located = FindingOf(*assessment, "2");
  EXPECT_EQ(located.verdict(), v1::VERDICT_CONFORM) << located.reason();
  EXPECT_NEAR(located.value(), 0.005, 0.004);
  EXPECT_EQ(located.result(), results[1]);
  EXPECT_NEAR(FindingOf(*assessment, "3").value(), 0, 0.004);
  EXPECT_EQ(FindingOf(*assessment, "4", "H1").verdict(), v1::VERDICT_CONFORM);
  EXPECT_NEAR(FindingOf(*assessment, "5", "H1 to H2").value(), FindingOf(*assessment, "5", "H1 to H2").nominal(), 0.1);
  for (const char* missing : {"6", "7"}) {
    EXPECT_EQ(FindingOf(*assessment, missing).verdict(), v1::VERDICT_NOT_MEASURED);
    EXPECT_FALSE(FindingOf(*assessment, missing).has_value());
    EXPECT_EQ(FindingOf(*assessment, missing).result(), "");
  }
  EXPECT_THAT(FindingOf(*assessment, "7").reason(), HasSubstr("want a measurement of this section"));
  ASSERT_EQ(assessment->groups_size(), 4);
  EXPECT_EQ(assessment->groups(0).group(), "G1");
  EXPECT_EQ(assessment->groups(0).verdict(), v1::VERDICT_NOT_CONFORM);
  EXPECT_EQ(assessment->groups(0).finding_count(), 4);
  EXPECT_EQ(assessment->groups(0).conform_count(), 3);
  EXPECT_EQ(assessment->groups(1).group(), "top side");
  EXPECT_EQ(assessment->groups(1).verdict(), v1::VERDICT_CONFORM);

  v1::GetAssessmentRequest get;
  get.set_name(assessment->name());
  v1::Assessment back;
  ASSERT_TRUE(stub_->GetAssessment(runtime::ContextFor(10).get(), get, &back).ok());
  EXPECT_EQ(back.DebugString(), assessment->DebugString());
  v1::ListAssessmentsRequest list;
  list.set_blade("blades/sn1");
  list.set_machine("machines/m1");
  list.set_calibration(testing::kSensorCalibration);
  list.set_verdict(v1::VERDICT_NOT_CONFORM);
  v1::ListAssessmentsResponse listed;
  ASSERT_TRUE(stub_->ListAssessments(runtime::ContextFor(10).get(), list, &listed).ok());
  ASSERT_EQ(listed.assessments_size(), 1);
  EXPECT_THAT(listed.assessments(0).findings(), IsEmpty());
  EXPECT_EQ(listed.assessments(0).groups_size(), 4);
  list.set_view(list::v1::VIEW_FULL);
  ASSERT_TRUE(stub_->ListAssessments(runtime::ContextFor(10).get(), list, &listed).ok());
  ASSERT_EQ(listed.assessments_size(), 1);
  EXPECT_EQ(listed.assessments(0).DebugString(), assessment->DebugString());
  list.set_verdict(v1::VERDICT_CONFORM);
  ASSERT_TRUE(stub_->ListAssessments(runtime::ContextFor(10).get(), list, &listed).ok());
  EXPECT_THAT(listed.assessments(), IsEmpty());

  v1::ReplayAssessmentRequest again;
  again.set_name(assessment->name());
  replay::v1::Replay replay;
  ASSERT_TRUE(stub_->ReplayAssessment(runtime::ContextFor(30).get(), again, &replay).ok());
  EXPECT_EQ(replay.outcome(), replay::v1::REPLAY_OUTCOME_SAME_BITS) << replay.DebugString();
  auto transaction = plant_.database.database()->Begin(testing::Soon());
  const auto derived = storage::DerivedFrom(*transaction, testing::kSensorCalibration);
  ASSERT_TRUE(derived.ok());
  std::vector<std::string> names, verdicts;
  for (const storage::JournalEntry& journal : *derived) {
    names.push_back(journal.entry.name);
    if (journal.entry.name == assessment->name()) verdicts.push_back(journal.verdict);
  }
  EXPECT_THAT(names, Contains(assessment->name()));
  EXPECT_THAT(verdicts, ElementsAre("NOT_CONFORM"));
}

// 20 um off along X, 10 along Y: what the drawing asks along X, along Y, and across them.
TEST_F(AssessmentServiceTest, TellsDisplacementsAlongTheDrawnDirection) {
  AddHoles(plant::v1::CHARACTERISTIC_QUANTITY_HOLE_DISPLACEMENT_ALONG, plant::v1::CHARACTERISTIC_UNIT_UM, 60,
           plant::v1::TOLERANCE_ZONE_HALF_WIDTH)
      .mutable_along_in_part()
      ->set_y(1);
  AddHoles(plant::v1::CHARACTERISTIC_QUANTITY_HOLE_DISPLACEMENT_ACROSS, plant::v1::CHARACTERISTIC_UNIT_UM, 60,
           plant::v1::TOLERANCE_ZONE_WIDTH)
      .mutable_along_in_part()
      ->set_y(1);
  const auto assessment = Assess(Request(Measure(Plan())));
  ASSERT_TRUE(assessment.ok()) << assessment.status();
  const Eigen::Vector3d off_um = 1e3 * (plant_.block.pins[0].start_mm - plant_.block.holes[0].pin.start_mm);
  const Eigen::Vector3d axis = plant_.block.holes[0].pin.axis;
  const Eigen::Vector3d along = (Eigen::Vector3d::UnitY() - axis.y() * axis).normalized();
  EXPECT_NEAR(FindingOf(*assessment, "1", "H1").value(), along.dot(off_um), 1);
  EXPECT_NEAR(FindingOf(*assessment, "2", "H1").value(), axis.cross(along).dot(off_um), 1);
  EXPECT_EQ(FindingOf(*assessment, "1", "H1").lower_limit(), -60);
  EXPECT_EQ(FindingOf(*assessment, "2", "H1").lower_limit(), -30);
}

// Another datum system's result stands beside, and is not judged; without one of its own there is none.
TEST_F(AssessmentServiceTest, JudgesTheDatumSystemsOwnResultAlone) {
  AddHoles(plant::v1::CHARACTERISTIC_QUANTITY_HOLE_POSITION, plant::v1::CHARACTERISTIC_UNIT_MM, 0.06,
           plant::v1::TOLERANCE_ZONE_RADIUS)
      .set_hole("H1");
  const auto six_point = Measure(Plan());
  drawing_.mutable_datum_systems(0)->set_positioning(plant::v1::DATUM_POSITIONING_BEST_FIT);
  const auto best_fit = Measure(Plan());
  const auto assessment = Assess(Request({six_point[0], best_fit[0]}));
  ASSERT_TRUE(assessment.ok()) << assessment.status();
  const v1::CharacteristicFinding& finding = FindingOf(*assessment, "1", "H1");
  EXPECT_EQ(finding.result(), best_fit[0]);
  ASSERT_EQ(finding.others_size(), 1);
  EXPECT_EQ(finding.others(0).result(), six_point[0]);
  EXPECT_EQ(finding.others(0).method(), registration::v1::METHOD_SIX_POINT);
  const auto without = Assess(Request({six_point[0]}));
  EXPECT_EQ(FindingOf(*without, "1", "H1").verdict(), v1::VERDICT_NOT_MEASURED);
  EXPECT_THAT(FindingOf(*without, "1", "H1").reason(), HasSubstr("positioned by BEST_FIT (A|B|C)"));
  EXPECT_EQ(FindingOf(*without, "1", "H1").others_size(), 1);
}

// 22 um with some U against 22.5: each rule by its name.
TEST_F(AssessmentServiceTest, JudgesByTheRuleThatTheDrawingNames) {
  const auto rule = [](plant::v1::DecisionRuleKind kind, const std::string& edition, double factor,
                       plant::v1::Characteristic* one) {
    one->mutable_decision_rule()->set_kind(kind);
    one->mutable_decision_rule()->set_edition(edition);
    if (factor > 0) one->mutable_decision_rule()->set_guard_factor(factor);
  };
  for (int i = 0; i < 4; ++i)
    AddHoles(plant::v1::CHARACTERISTIC_QUANTITY_HOLE_POSITION, plant::v1::CHARACTERISTIC_UNIT_UM, 60,
             plant::v1::TOLERANCE_ZONE_RADIUS)
        .set_hole("H1");
  const auto results = Measure(Plan());
  const auto before = Assess(Request(results));
  const double value = FindingOf(*before, "1", "H1").value(), u = FindingOf(*before, "1", "H1").expanded_uncertainty();
  for (plant::v1::Characteristic& one : *drawing_.mutable_characteristics()) one.set_upper_limit(value + 0.9 * u);
  rule(plant::v1::DECISION_RULE_KIND_SIMPLE_ACCEPTANCE, "", 0, drawing_.mutable_characteristics(1));
  rule(plant::v1::DECISION_RULE_KIND_GUARD_FACTOR, "", 0.5, drawing_.mutable_characteristics(2));
  rule(plant::v1::DECISION_RULE_KIND_ISO_14253_1, "2017", 0, drawing_.mutable_characteristics(3));
  Draw();
  const auto assessment = Assess(Request(results));
  ASSERT_TRUE(assessment.ok()) << assessment.status();
  EXPECT_EQ(FindingOf(*assessment, "1", "H1").verdict(), v1::VERDICT_UNDECIDABLE);
  EXPECT_THAT(FindingOf(*assessment, "1", "H1").reason(), HasSubstr("the decision rule leaves it open"));
  EXPECT_EQ(FindingOf(*assessment, "1", "H1").decision_rule().edition(), "2013");
  EXPECT_EQ(FindingOf(*assessment, "2", "H1").verdict(), v1::VERDICT_CONFORM);
  EXPECT_EQ(FindingOf(*assessment, "3", "H1").verdict(), v1::VERDICT_CONFORM);
  EXPECT_EQ(FindingOf(*assessment, "3", "H1").decision_rule().guard_factor(), 0.5);
  EXPECT_EQ(FindingOf(*assessment, "4", "H1").verdict(), v1::VERDICT_CONFORM);  // 0.9 U is 1.8 u, beyond 1.645
}

// Where nobody says how loosely the pin stands its hole is not passed, unless one 1.6 times as wide would be too.
TEST_F(AssessmentServiceTest, PassesNoHoleWhosePinMayStandLoose) {
  plant_.plant.part.mutable_hole_groups(0)->clear_gauge_pin();
  AddHoles(plant::v1::CHARACTERISTIC_QUANTITY_HOLE_POSITION, plant::v1::CHARACTERISTIC_UNIT_MM, 0.06,
           plant::v1::TOLERANCE_ZONE_RADIUS)
      .set_hole("H1");
  AddHoles(plant::v1::CHARACTERISTIC_QUANTITY_HOLE_POSITION, plant::v1::CHARACTERISTIC_UNIT_MM, 2,
           plant::v1::TOLERANCE_ZONE_RADIUS)
      .set_hole("H1");
  const auto assessment = Assess(Request(Measure(Plan())));
  ASSERT_TRUE(assessment.ok()) << assessment.status();
  EXPECT_EQ(FindingOf(*assessment, "1", "H1").verdict(), v1::VERDICT_UNDECIDABLE);
  EXPECT_THAT(FindingOf(*assessment, "1", "H1").reason(), HasSubstr("how loosely the pin stands"));
  EXPECT_EQ(FindingOf(*assessment, "2", "H1").verdict(), v1::VERDICT_CONFORM);
}

TEST_F(AssessmentServiceTest, DiscardsABlankThatNoMotionCures) {
  // Its top is 5 um high: out of the first, which a shift cures.
  AddTop(plant::v1::CHARACTERISTIC_QUANTITY_PROFILE_FORM_AND_LOCATION, -0.02, 0.001);
  AddHoles(plant::v1::CHARACTERISTIC_QUANTITY_HOLE_POSITION, plant::v1::CHARACTERISTIC_UNIT_MM, 0.06,
           plant::v1::TOLERANCE_ZONE_RADIUS);
  const auto stage = v1::ASSESSMENT_STAGE_BEFORE_MACHINING;
  const v1::AssessmentPlan plan = Plan(stage);
  ASSERT_EQ(plan.orders_size(), 1) << "holes are not due";
  const auto curable = Assess(Request(Measure(plan), stage));
  ASSERT_TRUE(curable.ok()) << curable.status();
  ASSERT_EQ(curable->findings_size(), 1);
  EXPECT_EQ(curable->verdict(), v1::VERDICT_NOT_CONFORM);
  EXPECT_EQ(curable->findings(0).cure(), v1::CURE_POSSIBLE);
  EXPECT_EQ(curable->fate(), v1::BLANK_FATE_MACHINABLE) << curable->fate_reason();
  EXPECT_EQ(ScrappedBy(), "");

  // Nothing is at once above 8 um and below -8 um.
  drawing_.mutable_characteristics(0)->set_upper_limit(-0.008);
  AddTop(plant::v1::CHARACTERISTIC_QUANTITY_PROFILE_FORM_AND_LOCATION, 0.008, 0.02);
  const auto hopeless = Assess(Request(Measure(Plan(stage)), stage));
  ASSERT_TRUE(hopeless.ok()) << hopeless.status();
  EXPECT_EQ(hopeless->fate(), v1::BLANK_FATE_DISCARD);
  EXPECT_THAT(hopeless->fate_reason(), HasSubstr("no rigid motion of the part brings it within its limits"));
  EXPECT_EQ(FindingOf(*hopeless, "1").cure(), v1::CURE_NONE);
  ASSERT_GE(hopeless->conflicts_size(), 2);
  EXPECT_GT(hopeless->conflicts(0).share(), 0);
  EXPECT_GT(hopeless->conflicts(0).patch().expanded_uncertainty_um(), 0);
  EXPECT_EQ(ScrappedBy(), hopeless->name());
  v1::GetAssessmentRequest get;
  get.set_name(hopeless->name());
  v1::Assessment back;
  ASSERT_TRUE(stub_->GetAssessment(runtime::ContextFor(10).get(), get, &back).ok());
  EXPECT_EQ(back.DebugString(), hopeless->DebugString());

  // Another drawing that asks for less lifts nothing.
  auto transaction = plant_.database.database()->Begin(testing::Soon());
  testing::PutDrawingOf(*transaction, "p1", "d2");
  ASSERT_TRUE(transaction->Commit().ok());
  drawing_.clear_characteristics();
  AddTop(plant::v1::CHARACTERISTIC_QUANTITY_PROFILE_FORM_AND_LOCATION, -0.5, 0.5);
  const auto wide = Measure(Plan(stage));
  plant_.drawings.drawings["drawings/d2"] = drawing_;
  plant_.drawings.drawings["drawings/d2"].set_name("drawings/d2");
  v1::AssessBladeRequest by_other = Request(wide, stage);
  by_other.set_drawing("drawings/d2");
  EXPECT_EQ(Assess(by_other)->fate(), v1::BLANK_FATE_MACHINABLE);
  EXPECT_EQ(ScrappedBy(), hopeless->name());

  // What says nothing lifts nothing; what says MACHINABLE does.
  drawing_.clear_characteristics();
  AddTop(plant::v1::CHARACTERISTIC_QUANTITY_PROFILE_FORM_AND_LOCATION, -0.02, 0.02).set_least_coverage(1);
  const auto unseen = Assess(Request(Measure(Plan(stage)), stage));
  EXPECT_EQ(unseen->fate(), v1::BLANK_FATE_UNDECIDED);
  EXPECT_THAT(unseen->fate_reason(), HasSubstr("were seen, want 100 %"));
  EXPECT_EQ(ScrappedBy(), hopeless->name());
  drawing_.mutable_characteristics(0)->set_least_coverage(0.5);
  EXPECT_EQ(Assess(Request(Measure(Plan(stage)), stage))->fate(), v1::BLANK_FATE_MACHINABLE);
  EXPECT_EQ(ScrappedBy(), "");
}

// A CMM's value is judged where the drawing asks for another instrument, and stands beside ours everywhere else.
TEST_F(AssessmentServiceTest, TakesAnotherInstrumentsValueWhereTheDrawingAsksForIt) {
  auto transaction = plant_.database.database()->Begin(testing::Soon());
  const std::string measured =
      testing::PutMeasurementOf(*transaction, "p1", "sn1", "drawings/d1");  // 1: 30.02 mm, U 0.002
  ASSERT_TRUE(transaction->Commit().ok());
  Add(plant::v1::CHARACTERISTIC_QUANTITY_MEASURED_ELSEWHERE, plant::v1::CHARACTERISTIC_UNIT_UM, 30021)
      .set_lower_limit(30000);
  Draw();
  const auto alone = Assess(Request({measured}));
  ASSERT_TRUE(alone.ok()) << alone.status();
  ASSERT_EQ(alone->findings_size(), 1);
  EXPECT_DOUBLE_EQ(alone->findings(0).value(), 30020);
  EXPECT_DOUBLE_EQ(alone->findings(0).expanded_uncertainty(), 2);
  EXPECT_EQ(alone->findings(0).verdict(), v1::VERDICT_UNDECIDABLE);
  EXPECT_EQ(alone->findings(0).result(), measured);
  EXPECT_EQ(alone->findings(0).method(), registration::v1::METHOD_UNSPECIFIED);
  v1::GetAssessmentRequest get;
  get.set_name(alone->name());
  v1::Assessment back;
  ASSERT_TRUE(stub_->GetAssessment(runtime::ContextFor(10).get(), get, &back).ok());
  EXPECT_EQ(back.DebugString(), alone->DebugString());

  drawing_.clear_characteristics();
  AddTop(plant::v1::CHARACTERISTIC_QUANTITY_PROFILE_FORM, -0.02, 0.02);
  const auto results = Measure(Plan());
  const auto beside = Assess(Request({measured, results[0]}));
  ASSERT_TRUE(beside.ok()) << beside.status();
  EXPECT_EQ(beside->findings(0).result(), results[0]);
  EXPECT_EQ(beside->findings(0).verdict(), v1::VERDICT_CONFORM);
  ASSERT_EQ(beside->findings(0).others_size(), 1);
  EXPECT_EQ(beside->findings(0).others(0).result(), measured);
  EXPECT_DOUBLE_EQ(beside->findings(0).others(0).value(), 30.02);
  EXPECT_EQ(Assess(Request({measured}))->findings(0).verdict(), v1::VERDICT_NOT_MEASURED) << "ours alone is judged";
  drawing_.set_revision(2);
  Draw();
  EXPECT_THAT(std::string(Assess(Request({measured})).status().message()),
              HasSubstr(measured + " by drawings/d1@1, want one by drawings/d1@2"));
}

// What a motion moves besides, and nobody can follow, makes its cure unsure.
TEST_F(AssessmentServiceTest, ClaimsNoCureThatMayTakeSomethingElseOut) {
  AddTop(plant::v1::CHARACTERISTIC_QUANTITY_PROFILE_FORM_AND_LOCATION, -0.02, 0.001);
  const auto stage = v1::ASSESSMENT_STAGE_BEFORE_MACHINING;
  const auto results = Measure(Plan(stage));
  ASSERT_EQ(Assess(Request(results, stage))->findings(0).cure(), v1::CURE_POSSIBLE);
  plant::v1::Characteristic& stagger =
      Add(plant::v1::CHARACTERISTIC_QUANTITY_SECTION_STAGGER, plant::v1::CHARACTERISTIC_UNIT_DEG, 1);
  stagger.set_section("50 %");
  stagger.set_datum_system("A|B|C");
  Draw();
  const auto assessment = Assess(Request(results, stage));
  EXPECT_EQ(assessment->findings(0).cure(), v1::CURE_UNKNOWN);
  EXPECT_EQ(assessment->fate(), v1::BLANK_FATE_UNDECIDED);
}

// A map whose profile is not the drawing's has nothing of it: other limits, another region, another rule.
TEST_F(AssessmentServiceTest, TakesAProfileThatWasJudgedAsDrawnAlone) {
  AddTop(plant::v1::CHARACTERISTIC_QUANTITY_PROFILE_FORM_AND_LOCATION, -0.02, 0.02);
  const auto results = Measure(Plan());
  ASSERT_EQ(Assess(Request(results))->verdict(), v1::VERDICT_CONFORM);
  const plant::v1::Drawing good = drawing_;
  const auto expect_none = [&] {
    Draw();
    const auto assessment = Assess(Request(results));
    EXPECT_EQ(assessment->verdict(), v1::VERDICT_NOT_MEASURED);
    EXPECT_THAT(assessment->findings(0).reason(), HasSubstr("want a deviation map with this profile tolerance"));
    drawing_ = good;
  };
  drawing_.mutable_characteristics(0)->set_upper_limit(0.021);
  expect_none();
  drawing_.mutable_characteristics(0)->set_least_coverage(0.6);
  expect_none();
  drawing_.mutable_regions(0)->set_facing_within_deg(30);
  expect_none();
  drawing_.mutable_decision_rule()->set_edition("2017");
  expect_none();
  drawing_.mutable_characteristics(0)->set_region("");
  expect_none();
  EXPECT_EQ(Assess(Request(Measure(Plan(), 3)))->verdict(), v1::VERDICT_NOT_MEASURED)
      << "a dent would be averaged away";
  drawing_.mutable_decision_rule()->set_edition("1998");  // does the same as 2013
  Draw();
  EXPECT_EQ(Assess(Request(results))->verdict(), v1::VERDICT_CONFORM);
}

TEST_F(AssessmentServiceTest, RefusesWhatIsNotOfThatBladeAndDrawing) {
  AddHoles(plant::v1::CHARACTERISTIC_QUANTITY_HOLE_POSITION, plant::v1::CHARACTERISTIC_UNIT_MM, 0.06,
           plant::v1::TOLERANCE_ZONE_RADIUS);
  const auto results = Measure(Plan());
  const auto expect = [&](const v1::AssessBladeRequest& request, absl::StatusCode code, const std::string& message) {
    const absl::Status status = Assess(request).status();
    EXPECT_EQ(status.code(), code) << status;
    EXPECT_THAT(std::string(status.message()), HasSubstr(message));
  };
  constexpr auto kBad = absl::StatusCode::kInvalidArgument;
  v1::AssessBladeRequest request = Request(results);
  request.set_blade("blades/sn2");
  expect(request, kBad, "results[0]: " + results[0] + " of blades/sn1, want a result of blades/sn2");
  request = Request({results[0], results[0]});
  expect(request, kBad, "results[1]: " + results[0] + ", want each once");
  expect(Request({}), kBad, "results: none");
  expect(Request({"scans/s1"}), kBad, "results[0]: scans/s1");
  request = Request(results);
  request.set_stage(v1::ASSESSMENT_STAGE_UNSPECIFIED);
  expect(request, kBad, "stage");
  for (const char* name : {"inspections/", "deviations/", "sections/"})
    expect(Request({std::string(name) + kSomeUuid}), absl::StatusCode::kNotFound, kSomeUuid);
  request = Request(results);
  request.set_drawing("drawings/d9");
  expect(request, absl::StatusCode::kNotFound, "d9");
  drawing_.set_part("parts/p9");
  Draw();
  expect(Request(results), kBad, "want a drawing of parts/p1");
  drawing_.set_part("parts/p1");
  drawing_.set_part_revisions(0, 2);
  Draw();
  expect(Request(results), kBad, "one that is valid for parts/p1@1");
  drawing_.set_part_revisions(0, 1);
  Draw();
  expect(Request(results, v1::ASSESSMENT_STAGE_BEFORE_MACHINING), kBad, "characteristic that is due");
  v1::GetAssessmentRequest get;
  get.set_name(std::string("assessments/") + kSomeUuid);
  v1::Assessment none;
  const absl::Status missing = runtime::FromGrpc(stub_->GetAssessment(runtime::ContextFor(10).get(), get, &none));
  EXPECT_EQ(runtime::ReasonOf(missing), "ASSESSMENT_NOT_FOUND");
}

// By balloon and feature, lengths in mm; each format reads back to the same.
TEST_F(AssessmentServiceTest, LeavesAsFilesThatReadBackToItsValues) {
  AddHoles(plant::v1::CHARACTERISTIC_QUANTITY_HOLE_POSITION, plant::v1::CHARACTERISTIC_UNIT_UM, 120,
           plant::v1::TOLERANCE_ZONE_DIAMETER);
  AddHoles(plant::v1::CHARACTERISTIC_QUANTITY_HOLE_PITCH_OVER_DIAMETER, plant::v1::CHARACTERISTIC_UNIT_RATIO, 100)
      .clear_datum_system();
  AddHoles(plant::v1::CHARACTERISTIC_QUANTITY_HOLE_DIAMETER, plant::v1::CHARACTERISTIC_UNIT_MM, 1).clear_datum_system();
  AddTop(plant::v1::CHARACTERISTIC_QUANTITY_PROFILE_FORM, -0.02, 0.02);
  const auto assessment = Assess(Request(Measure(Plan())));
  ASSERT_TRUE(assessment.ok()) << assessment.status();
  const auto stub = v1::ExportService::NewStub(server_.Connect());
  for (const v1::ExportFormat format : {v1::EXPORT_FORMAT_QIF, v1::EXPORT_FORMAT_CSV, v1::EXPORT_FORMAT_AQDEF}) {
    SCOPED_TRACE(v1::ExportFormat_Name(format));
    v1::ExportResultsRequest request;
    request.set_format(format);
    request.set_assessments(true);
    const auto context = runtime::ContextFor(30);
    const auto reader = stub->ExportResults(context.get(), request);
    std::string file, newest;
    for (v1::ExportResultsResponse piece; reader->Read(&piece);) {
      if (piece.file() != newest) file.clear();
      newest = piece.file();
      file += piece.content();
    }
    const grpc::Status status = reader->Finish();
    ASSERT_TRUE(status.ok()) << status.error_message();
    std::vector<exchange::InspectedPart> parts;
    if (format == v1::EXPORT_FORMAT_QIF) {
      auto part = exchange::FromQif(file);
      ASSERT_TRUE(part.ok()) << part.status();
      parts = {*std::move(part)};
    } else {
      auto read = format == v1::EXPORT_FORMAT_CSV ? exchange::FromCsv(file) : exchange::FromAqdef(file);
      ASSERT_TRUE(read.ok()) << read.status();
      parts = *std::move(read);
    }
    ASSERT_EQ(parts.size(), 1u);
    std::map<std::string, std::size_t> at;
    for (std::size_t i = 0; i < parts[0].characteristics.size(); ++i) at[parts[0].characteristics[i].name] = i;
    for (const v1::CharacteristicFinding& finding : assessment->findings()) {
      const std::string name = finding.characteristic() + (finding.feature().empty() ? "" : "/" + finding.feature());
      SCOPED_TRACE(name);
      ASSERT_EQ(at.count(name), 1u);
      const double mm = finding.unit() == plant::v1::CHARACTERISTIC_UNIT_UM ? 1e-3 : 1;
      const exchange::MeasuredValue& value = parts[0].values[at[name]];
      ASSERT_EQ(value.value.has_value(), finding.verdict() != v1::VERDICT_NOT_MEASURED);
      if (!value.value) continue;
      EXPECT_DOUBLE_EQ(*value.value, mm * (name == "4" ? std::abs(finding.value()) : finding.value()));
      EXPECT_NEAR(*value.expanded_uncertainty, mm * finding.expanded_uncertainty(), 1e-12);
      EXPECT_EQ(static_cast<int>(value.verdict) + 1, finding.verdict());
      EXPECT_DOUBLE_EQ(*parts[0].characteristics[at[name]].upper, mm * finding.upper_limit());
    }
  }
}

TEST_F(AssessmentServiceTest, AnswersARetryAsItDidAndStoresOnce) {
  AddHoles(plant::v1::CHARACTERISTIC_QUANTITY_HOLE_POSITION, plant::v1::CHARACTERISTIC_UNIT_MM, 0.06,
           plant::v1::TOLERANCE_ZONE_RADIUS);
  v1::AssessBladeRequest request = Request(Measure(Plan()));
  request.set_request_id(kSomeUuid);
  const auto first = Assess(request), second = Assess(request);
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_EQ(first->DebugString(), second->DebugString());
}

}  // namespace
}  // namespace sixpoint::inspection
