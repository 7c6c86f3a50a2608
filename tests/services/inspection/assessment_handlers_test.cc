// The handlers of assessments on fake stores: no PostgreSQL, and nothing is measured. What is judged lies in the stores already.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "services/inspection/assessment_service.h"
#include "tests/services/correction/stand_ins.h"
#include "tests/support/call.h"
#include "tests/support/fake_assessments.h"
#include "tests/support/fake_deviations.h"
#include "tests/support/fake_inspections.h"
#include "tests/support/fake_measurements.h"
#include "tests/support/fake_sections.h"
#include "tests/support/listed_results.h"
#include "tests/support/must.h"
#include "tests/support/sample_results.h"
#include "tests/support/some_uuid.h"

namespace sixpoint::inspection {
namespace {

using sixpoint::testing::kSomeUuid;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class AssessmentHandlersTest : public ::testing::Test {
 protected:
  using Row = storage::AssessmentRow;
  using Stub = v1::AssessmentService::Stub;

  // A chord, which a section has, and what another instrument measures.
  AssessmentHandlersTest() {
    plant::v1::Drawing drawing;
    drawing.set_name("drawings/d1");
    drawing.set_revision(1);
    drawing.set_part("parts/p1");
    drawing.add_part_revisions(1);
    drawing.mutable_decision_rule()->set_kind(plant::v1::DECISION_RULE_KIND_ISO_14253_1);
    drawing.mutable_decision_rule()->set_edition("2013");
    plant::v1::DrawingSection& section = *drawing.add_sections();
    section.set_section("50 %");
    section.set_height_mm(0);
    section.set_half_width_mm(0.1);
    plant::v1::Characteristic& chord = *drawing.add_characteristics();
    chord.set_characteristic("1");
    chord.set_name("chord");
    chord.set_characteristic_class(plant::v1::CHARACTERISTIC_CLASS_MAJOR);
    chord.set_quantity(plant::v1::CHARACTERISTIC_QUANTITY_SECTION_CHORD);
    chord.set_algorithm(plant::v1::CHARACTERISTIC_ALGORITHM_NOSE_TAIL);
    chord.set_section("50 %");
    chord.set_unit(plant::v1::CHARACTERISTIC_UNIT_MM);
    chord.set_lower_limit(29.9);
    chord.set_upper_limit(30.1);
    plant::v1::Characteristic& roughness = *drawing.add_characteristics();
    roughness.set_characteristic("2");
    roughness.set_name("Ra");
    roughness.set_characteristic_class(plant::v1::CHARACTERISTIC_CLASS_MINOR);
    roughness.set_quantity(plant::v1::CHARACTERISTIC_QUANTITY_MEASURED_ELSEWHERE);
    roughness.set_unit(plant::v1::CHARACTERISTIC_UNIT_UM);
    roughness.set_upper_limit(0.8);
    Draw(drawing);
  }
  // As the plant has it from now on.
  void Draw(const plant::v1::Drawing& drawing) {
    for (const char* name : {"drawings/d1", "drawings/d1@1"}) plant_.drawings.drawings[name] = drawing;
  }
  plant::v1::Drawing Drawn() const { return plant_.drawings.drawings.at("drawings/d1"); }

  std::string PutSections(const std::string& serial = "sn1") {
    storage::SectionMeasurementRow row = testing::SampleSections();
    row.section_measurement_id = storage::NewUuid();
    row.blade_serial = serial;
    row.registration_id = std::string(testing::kRegistration).substr(14);
    testing::Must(sections_->Record({}, row, {}, {}).status());
    return "sections/" + row.section_measurement_id;
  }
  // Of roughness, um.
  std::string PutMeasurement(double value, int drawing_revision = 1) {
    storage::MeasurementImport import;
    storage::MeasurementRow& row = import.measurements.emplace_back(testing::SampleMeasurement());
    row.measurement_id = storage::NewUuid();
    row.blade_serial = "sn1";
    row.file.drawing_id = "d1";
    row.file.drawing_revision = drawing_revision;
    row.file.part_id = "p1";
    row.values = {{"2", "", "UM", "", value, 0.05, ""}};
    storage::CountValues(&row);
    const std::string id = row.measurement_id;
    testing::Must(measurements_->Record({}, import, {}, {}).status());
    return "measurements/" + id;
  }
  // As if the request had been answered with it; gives its name.
  static Row Sample() {
    Row row = testing::SampleAssessment();
    row.blade_serial = "sn1";
    row.part_id = "p1";
    row.drawing_id = "d1";
    row.results = {std::string("deviations/") + kSomeUuid};
    return row;
  }
  std::string Put(Row row = Sample(), const v1::AssessBladeRequest& request = {}) {
    row.assessment_id = storage::NewUuid();
    testing::Must(
        store_->Record(runtime::RecordedRequestOf("inspection.AssessBlade", request, ""), row, {}, {}).status());
    return "assessments/" + row.assessment_id;
  }
  static v1::AssessBladeRequest Request(const std::vector<std::string>& results, const std::string& request_id = "") {
    v1::AssessBladeRequest request;
    request.set_blade("blades/sn1");
    request.set_drawing("drawings/d1");
    for (const std::string& result : results) request.add_results(result);
    request.set_stage(v1::ASSESSMENT_STAGE_MACHINED);
    request.set_request_id(request_id);
    return request;
  }
  absl::StatusOr<v1::Assessment> Assess(const v1::AssessBladeRequest& request) {
    return testing::Call(*stub_, &Stub::AssessBlade, request);
  }
  absl::StatusOr<v1::Assessment> Get(const std::string& name) {
    v1::GetAssessmentRequest request;
    request.set_name(name);
    return testing::Call(*stub_, &Stub::GetAssessment, request);
  }
  absl::StatusOr<v1::ListAssessmentsResponse> List(const v1::ListAssessmentsRequest& request) {
    return testing::Call(*stub_, &Stub::ListAssessments, request);
  }
  absl::StatusOr<replay::v1::Replay> Replay(const std::string& name) {
    v1::ReplayAssessmentRequest request;
    request.set_name(name);
    return testing::Call(*stub_, &Stub::ReplayAssessment, request);
  }

  testing::StandIns plant_;
  std::shared_ptr<testing::FakeAssessments> store_ = std::make_shared<testing::FakeAssessments>();
  std::shared_ptr<testing::FakeInspections> inspections_ = std::make_shared<testing::FakeInspections>();
  std::shared_ptr<testing::FakeDeviations> deviations_ = std::make_shared<testing::FakeDeviations>();
  std::shared_ptr<testing::FakeSections> sections_ = std::make_shared<testing::FakeSections>();
  std::shared_ptr<testing::FakeMeasurements> measurements_ = std::make_shared<testing::FakeMeasurements>();
  AssessmentService service_{
      store_,
      {inspections_, deviations_, sections_, measurements_},
      std::make_unique<clients::BladePeers>(plant_.Connect(), plant_.Connect(), plant_.Connect(), plant_.Connect()),
      {}};
  testing::InProcessServer server_{{&service_}};
  std::unique_ptr<Stub> stub_ = v1::AssessmentService::NewStub(server_.Connect());
};

TEST_F(AssessmentHandlersTest, PlansWhatTheDrawingAsksFor) {
  v1::PlanAssessmentRequest request;
  request.set_drawing("drawings/d1");
  request.set_stage(v1::ASSESSMENT_STAGE_MACHINED);
  const auto plan = testing::Call(*stub_, &Stub::PlanAssessment, request);
  ASSERT_TRUE(plan.ok()) << plan.status();
  EXPECT_EQ(plan->drawing(), "drawings/d1@1");
  ASSERT_THAT(plan->orders(), SizeIs(1));
  EXPECT_THAT(plan->orders(0).characteristics(), ElementsAre("1"));
  EXPECT_EQ(plan->orders(0).sections().sections(0).section(), "50 %");
  EXPECT_THAT(plan->measured_elsewhere(), ElementsAre("2"));
  request.set_drawing("drawings/d2");
  EXPECT_EQ(testing::Call(*stub_, &Stub::PlanAssessment, request).status().code(), absl::StatusCode::kNotFound);
  request.set_drawing("parts/p1");
  EXPECT_EQ(testing::RefusedField(testing::Call(*stub_, &Stub::PlanAssessment, request).status()), "drawing");
  request.set_drawing("drawings/d1");
  request.clear_stage();
  EXPECT_EQ(testing::RefusedField(testing::Call(*stub_, &Stub::PlanAssessment, request).status()), "stage");
}

TEST_F(AssessmentHandlersTest, JudgesRecordedResultsAndRecordsWhatTheVerdictRestsOn) {
  const std::vector<std::string> results = {PutSections(), PutMeasurement(0.4)};
  const auto assessment = Assess(Request(results));
  ASSERT_TRUE(assessment.ok()) << assessment.status();
  ASSERT_THAT(store_->rows(), SizeIs(1));
  const Row row = store_->rows().front();
  EXPECT_EQ(assessment->name(), "assessments/" + row.assessment_id);
  EXPECT_EQ(assessment->DebugString(), Get(assessment->name())->DebugString());
  EXPECT_EQ(assessment->drawing(), "drawings/d1@1");
  EXPECT_EQ(assessment->verdict(), v1::VERDICT_CONFORM);
  ASSERT_THAT(assessment->findings(), SizeIs(2));
  EXPECT_EQ(assessment->findings(0).value(), 30.01);
  EXPECT_EQ(assessment->findings(0).result(), results[0]);
  EXPECT_EQ(assessment->findings(1).value(), 0.4);
  EXPECT_EQ(assessment->findings(1).result(), results[1]);
  EXPECT_EQ(row.machine_id, "m1");  // the registration's
  const storage::RecordEntry entry = store_->entries().front();
  EXPECT_EQ(entry.name, assessment->name());
  EXPECT_THAT(entry.inputs, ElementsAre(results[0], results[1], "drawings/d1@1"));
  EXPECT_EQ(entry.blade, "sn1");
  EXPECT_EQ(entry.method, "MACHINED");
  EXPECT_THAT(entry.summary_json, HasSubstr("CONFORM"));
}

TEST_F(AssessmentHandlersTest, WhatNoResultHasIsNotMeasuredAndWhatIsOutIsNotConform) {
  const auto without = Assess(Request({PutMeasurement(0.4)}));
  ASSERT_TRUE(without.ok()) << without.status();
  EXPECT_EQ(without->verdict(), v1::VERDICT_NOT_MEASURED);
  EXPECT_THAT(without->findings(0).reason(), HasSubstr("want a measurement of this section"));
  EXPECT_EQ(store_->rows().front().machine_id, "") << "no result of ours";
  const auto out = Assess(Request({PutSections(), PutMeasurement(0.9)}));
  ASSERT_TRUE(out.ok()) << out.status();
  EXPECT_EQ(out->verdict(), v1::VERDICT_NOT_CONFORM);
  EXPECT_EQ(out->findings(0).verdict(), v1::VERDICT_CONFORM);
}

TEST_F(AssessmentHandlersTest, AReplayJudgesTheSameAgainAndRecordsNothing) {
  const auto assessment = Assess(Request({PutSections(), PutMeasurement(0.4)}));
  ASSERT_TRUE(assessment.ok()) << assessment.status();
  const auto same = Replay(assessment->name());
  ASSERT_TRUE(same.ok()) << same.status();
  EXPECT_EQ(same->outcome(), replay::v1::REPLAY_OUTCOME_SAME_BITS);
  plant::v1::Drawing drawing = Drawn();
  drawing.mutable_characteristics(0)->set_upper_limit(30.001);  // as no revision ever changes
  Draw(drawing);
  const auto other = Replay(assessment->name());
  ASSERT_TRUE(other.ok()) << other.status();
  EXPECT_NE(other->outcome(), replay::v1::REPLAY_OUTCOME_SAME_BITS);
  EXPECT_THAT(store_->rows(), SizeIs(1));
}

TEST_F(AssessmentHandlersTest, RefusesEachFieldByItsNameAndRecordsNothing) {
  const std::string sections = PutSections();
  const auto field = [&](const std::function<void(v1::AssessBladeRequest*)>& spoil) {
    v1::AssessBladeRequest request = Request({sections});
    spoil(&request);
    return testing::RefusedField(Assess(request).status());
  };
  using R = v1::AssessBladeRequest;
  EXPECT_EQ(field([](R* r) { r->set_blade("sn1"); }), "blade");
  EXPECT_EQ(field([](R* r) { r->set_drawing("parts/p1"); }), "drawing");
  EXPECT_EQ(field([](R* r) { r->clear_stage(); }), "stage");
  EXPECT_EQ(field([](R* r) { r->clear_results(); }), "results");
  EXPECT_EQ(field([](R* r) { r->add_results("scans/s0"); }), "results[1]");
  EXPECT_EQ(field([&](R* r) { r->add_results(sections); }), "results[1]");
  EXPECT_EQ(field([&](R* r) { r->add_results(PutSections("sn2")); }), "results[1]") << "of another blade";
  EXPECT_EQ(field([&](R* r) { r->add_results(PutMeasurement(0.4, 2)); }), "results[1]") << "by another revision";
  plant::v1::Drawing drawing = Drawn();
  drawing.set_part_revisions(0, 2);
  Draw(drawing);
  EXPECT_EQ(field([](R*) {}), "drawing") << "not valid for the part that was measured";
  EXPECT_THAT(store_->rows(), IsEmpty());
  EXPECT_THAT(store_->entries(), IsEmpty());
}

TEST_F(AssessmentHandlersTest, AResultThatIsNotRecordedIsNotFoundByItsOwnReason) {
  for (const auto& [collection, reason] :
       {std::pair("inspections", "INSPECTION_NOT_FOUND"), std::pair("deviations", "DEVIATION_MAP_NOT_FOUND"),
        std::pair("sections", "SECTION_MEASUREMENT_NOT_FOUND"), std::pair("measurements", "MEASUREMENT_NOT_FOUND")}) {
    const std::string name = std::string(collection) + "/" + kSomeUuid;
    const absl::Status status = Assess(Request({name})).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kNotFound) << status;
    EXPECT_EQ(runtime::ReasonOf(status), reason);
    EXPECT_EQ(runtime::MetadataOf(status)["resource"], name);
  }
  EXPECT_THAT(store_->rows(), IsEmpty());
}

TEST_F(AssessmentHandlersTest, ListsByPagesNewestFirstAndByWhatIsAskedFor) {
  Row other = Sample();
  other.blade_serial = "sn2";
  other.verdict = "UNDECIDABLE";
  const std::vector<std::string> names = {Put(), Put(other), Put(), Put(), Put()};
  testing::ExpectPagesNewestFirst<v1::ListAssessmentsRequest>(
      names, [this](const auto& request) { return List(request); },
      [](const auto& page) { return page.assessments(); });
  v1::ListAssessmentsRequest request;
  request.set_blade("blades/sn2");
  EXPECT_THAT(testing::ListedNames(List(request)->assessments()), ElementsAre(names[1]));
  request.clear_blade();
  request.set_verdict(v1::VERDICT_UNDECIDABLE);
  EXPECT_THAT(testing::ListedNames(List(request)->assessments()), ElementsAre(names[1]));
  request.set_verdict(v1::VERDICT_CONFORM);
  EXPECT_THAT(List(request)->assessments(), IsEmpty());
  request.set_verdict(static_cast<v1::Verdict>(99));
  EXPECT_EQ(testing::RefusedField(List(request).status()), "verdict");
  testing::ExpectListRefusals<v1::ListAssessmentsRequest>([this](const auto& asked) { return List(asked); });
}

TEST_F(AssessmentHandlersTest, AListLeavesTheFindingsOutUnlessTheWholeIsAskedFor) {
  const std::string name = Put();
  v1::ListAssessmentsRequest request;
  const auto basic = List(request);
  ASSERT_TRUE(basic.ok()) << basic.status();
  ASSERT_THAT(basic->assessments(), SizeIs(1));
  EXPECT_THAT(basic->assessments(0).findings(), IsEmpty());
  EXPECT_THAT(basic->assessments(0).conflicts(), IsEmpty());
  ASSERT_THAT(basic->assessments(0).groups(), SizeIs(1));
  EXPECT_EQ(basic->assessments(0).groups(0).finding_count(), 1);
  EXPECT_EQ(basic->assessments(0).fate(), v1::BLANK_FATE_DISCARD);
  request.set_view(list::v1::VIEW_FULL);
  const auto full = List(request);
  ASSERT_TRUE(full.ok()) << full.status();
  EXPECT_THAT(full->assessments(0).findings(), SizeIs(1));
  EXPECT_EQ(full->assessments(0).DebugString(), Get(name)->DebugString());
}

TEST_F(AssessmentHandlersTest, WhatIsNotRecordedIsNotFoundAndWhatCannotBeReadIsDataLoss) {
  const std::string name = std::string("assessments/") + kSomeUuid;
  for (const absl::Status& status : {Get(name).status(), Replay(name).status()}) {
    EXPECT_EQ(status.code(), absl::StatusCode::kNotFound) << status;
    EXPECT_EQ(runtime::ReasonOf(status), "ASSESSMENT_NOT_FOUND");
    EXPECT_EQ(runtime::MetadataOf(status)["resource"], name);
  }
  EXPECT_EQ(testing::RefusedField(Get(std::string("sections/") + kSomeUuid).status()), "name");
  Row row = Sample();
  row.findings.front().result_index = 1;  // there is one result
  EXPECT_EQ(Get(Put(row)).status().code(), absl::StatusCode::kDataLoss);
}

TEST_F(AssessmentHandlersTest, SaysWhatTheStoresSay) {
  const std::string name = Put(), sections = PutSections();
  sections_->Fail(absl::DeadlineExceededError("database: slow"));
  EXPECT_EQ(Assess(Request({sections})).status().code(), absl::StatusCode::kDeadlineExceeded);
  store_->Fail(absl::ResourceExhaustedError("database: full"));
  for (const absl::Status& status :
       {Get(name).status(), Replay(name).status(), List({}).status(), Assess(Request({sections})).status()})
    EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted) << status;
  store_->Fail(absl::OkStatus());
  EXPECT_THAT(store_->rows(), SizeIs(1));
}

TEST_F(AssessmentHandlersTest, ARetryGetsWhatTheFirstCallRecordedWithoutAnyWork) {
  const v1::AssessBladeRequest request = Request({std::string("sections/") + kSomeUuid}, kSomeUuid);
  const std::string name = Put(Sample(), request);
  const auto again = Assess(request);  // its result is in no store: work would fail
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->DebugString(), Get(name)->DebugString());
  EXPECT_THAT(store_->rows(), SizeIs(1));
  EXPECT_EQ(Assess(Request({PutSections()}, kSomeUuid)).status().code(), absl::StatusCode::kAlreadyExists);
}

}  // namespace
}  // namespace sixpoint::inspection
