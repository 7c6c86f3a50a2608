// The handlers of reports and of first articles' forms on fake stores: no PostgreSQL, and nothing is measured. What a file says is tested in
// report_of_test.cc, first_article_of_test.cc and tests/report.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <nlohmann/json.hpp>

#include "metrology/inspection/surface_patches.h"
#include "services/inspection/report_service.h"
#include "tests/report/read_report.h"
#include "tests/services/correction/stand_ins.h"
#include "tests/support/becomes.h"
#include "tests/support/call.h"
#include "tests/support/exposed.h"
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

class ReportHandlersTest : public ::testing::Test {
 protected:
  using Stub = v1::ReportService::Stub;
  using FormsRequest = v1::WriteFirstArticleRequest;

  // Characteristic 1, which the sample assessment judges, and 2, which it says nothing of.
  ReportHandlersTest() {
    plant::v1::Drawing& drawing = plant_.drawings.drawings["drawings/d1@1"];
    drawing.set_name("drawings/d1");
    drawing.set_drawing_number("DWG-4711");
    drawing.mutable_decision_rule()->set_kind(plant::v1::DECISION_RULE_KIND_SIMPLE_ACCEPTANCE);
    for (const char* balloon : {"1", "2"}) {
      plant::v1::Characteristic& drawn = *drawing.add_characteristics();
      drawn.set_characteristic(balloon);
      drawn.set_name(std::string("name of ") + balloon);
      drawn.set_unit(plant::v1::CHARACTERISTIC_UNIT_MM);
    }
  }
  // Of the blade, by the stand-ins' registration of it.
  template <typename Row>
  static Row Registered(Row row) {
    row.blade_serial = "sn1";
    row.part_id = "p1";
    row.part_revision = 1;
    row.registration_id = std::string(testing::kRegistration).substr(14);
    row.scan_ids = {"s0", "s1"};
    return row;
  }
  static storage::InspectionRow Inspected() { return Registered(testing::SampleInspection()); }
  static storage::SectionMeasurementRow Cut() { return Registered(testing::SampleSections()); }
  // Its patches are those of the stand-ins' surface.
  static storage::DeviationMapRow Mapped() {
    storage::DeviationMapRow row = Registered(testing::SampleDeviation());
    row.patch_mm = 2;
    row.patches = {};
    const auto surface = testing::Must(metrology::Surface::Prepare(metrology::BlockMesh()));
    const auto patches = testing::Must(metrology::SurfacePatches::Make(*surface, row.patch_mm));
    row.patches.means_um.assign(patches.patches().size(), 3);
    row.patch_count = static_cast<int>(patches.patches().size());
    return row;
  }
  static storage::AssessmentRow Assessed(const std::vector<std::string>& results) {
    storage::AssessmentRow row = testing::SampleAssessment();
    row.blade_serial = "sn1";
    row.part_id = "p1";
    row.drawing_id = "d1";
    row.results = results;
    return row;
  }
  template <typename Store, typename Row>
  static std::string PutIn(Store& store, const std::string& collection, std::string Row::*id, Row row) {
    row.*id = storage::NewUuid();
    testing::Must(store.Record({}, row, {}, {}).status());
    return collection + row.*id;
  }
  // Each gives the name.
  std::string Put(const storage::InspectionRow& row) {
    return PutIn(*inspections_, "inspections/", &storage::InspectionRow::inspection_id, row);
  }
  std::string Put(const storage::DeviationMapRow& row) {
    return PutIn(*deviations_, "deviations/", &storage::DeviationMapRow::deviation_id, row);
  }
  std::string Put(const storage::SectionMeasurementRow& row) {
    return PutIn(*sections_, "sections/", &storage::SectionMeasurementRow::section_measurement_id, row);
  }
  std::string Put(const storage::AssessmentRow& row) {
    return PutIn(*assessments_, "assessments/", &storage::AssessmentRow::assessment_id, row);
  }
  std::string PutMeasurement() {
    storage::MeasurementImport import;
    storage::MeasurementRow& row = import.measurements.emplace_back(testing::SampleMeasurement());
    row.measurement_id = storage::NewUuid();
    row.blade_serial = "sn1";
    testing::Must(measurements_->Record({}, import, {}, {}).status());
    return "measurements/" + import.measurements.front().measurement_id;
  }
  struct File {
    std::string name, content;
    std::vector<std::size_t> piece_sizes;
    absl::Status status;
  };
  template <typename Response>
  static File FileOf(const testing::Streamed<Response>& streamed) {
    File file;
    file.status = streamed.status;
    for (const Response& piece : streamed.messages) {
      file.name = piece.file();
      file.content += piece.content();
      file.piece_sizes.push_back(piece.content().size());
    }
    return file;
  }
  File Write(const std::vector<std::string>& results, v1::ReportFormat format = v1::REPORT_FORMAT_HTML) {
    v1::WriteReportRequest request;
    for (const std::string& result : results) request.add_results(result);
    request.set_format(format);
    return FileOf(testing::CallStream(*stub_, &Stub::WriteReport, request));
  }
  File WriteForms(
      const std::string& assessment, const std::function<void(FormsRequest*)>& ask = [](FormsRequest*) {}) {
    FormsRequest request;
    request.set_assessment(assessment);
    request.set_format(v1::REPORT_FORMAT_JSON);
    ask(&request);
    return FileOf(testing::CallStream(*stub_, &Stub::WriteFirstArticle, request));
  }
  static auto Is(const char* field, const std::string& value, const std::string& wanted) {
    return ElementsAre(Violation{field, value, wanted});
  }
  static std::string IdIn(const std::string& name) { return name.substr(name.find('/') + 1); }
  ReportSources Sources() { return {inspections_, deviations_, sections_, measurements_, AssessmentsOf(assessments_)}; }

  testing::StandIns plant_;
  std::shared_ptr<testing::FakeInspections> inspections_ = std::make_shared<testing::FakeInspections>();
  std::shared_ptr<testing::FakeDeviations> deviations_ = std::make_shared<testing::FakeDeviations>();
  std::shared_ptr<testing::FakeSections> sections_ = std::make_shared<testing::FakeSections>();
  std::shared_ptr<testing::FakeMeasurements> measurements_ = std::make_shared<testing::FakeMeasurements>();
  std::shared_ptr<testing::FakeAssessments> assessments_ = std::make_shared<testing::FakeAssessments>();
  ReportService service_{Sources(), std::make_shared<const clients::BladePeers>(plant_.Connect(), plant_.Connect(),
                                                                                plant_.Connect(), plant_.Connect())};
  testing::InProcessServer server_{{&service_}};
  std::unique_ptr<Stub> stub_ = v1::ReportService::NewStub(server_.Connect());
};

TEST_F(ReportHandlersTest, TellsTheResultsAndAllThatTheyRestOn) {
  const std::vector<std::string> results = {Put(Inspected()), Put(Mapped()), Put(Cut())};
  const File html = Write(results);
  EXPECT_EQ(html.name, "sn1_" + IdIn(results[0]) + ".html") << html.status;
  const std::string text = report::HtmlText(html.content);
  for (const std::string& result : results) EXPECT_THAT(text, HasSubstr(result));
  for (const char* fact :
       {testing::kRegistration, testing::kSensorCalibration, testing::kRotationCalibration, "scans/s0", "scans/s1",
        "m1, revision 1", "G1/H1/position", "no pin stands in it", "50 %", "chord nose tail", "seen from: front"})
    EXPECT_THAT(text, HasSubstr(report::Packed(fact)));
  EXPECT_EQ(Write(results).content, html.content);  // the same bytes
  const File pdf = Write({results[0]}, v1::REPORT_FORMAT_PDF);
  EXPECT_EQ(pdf.name, "sn1_" + IdIn(results[0]) + ".pdf") << pdf.status;
  EXPECT_THAT(pdf.content, ::testing::StartsWith("%PDF"));
}

TEST_F(ReportHandlersTest, OfAnAssessmentTheResultsAreThoseThatItNames) {
  const std::string inspection = Put(Inspected()), measurement = PutMeasurement();
  const std::string assessment = Put(Assessed({inspection, measurement}));
  const File html = Write({assessment});
  EXPECT_EQ(html.name, "sn1_" + IdIn(assessment) + ".html") << html.status;
  const std::string text = report::HtmlText(html.content);
  for (const std::string& name : {assessment, inspection, measurement}) EXPECT_THAT(text, HasSubstr(name));
  for (const char* fact : {"DWG-4711", "NOT CONFORM", "simple acceptance"})
    EXPECT_THAT(text, HasSubstr(report::Packed(fact)));
}

TEST_F(ReportHandlersTest, AFirstArticleIsOfTheAssessmentItsDrawingAndWhatWasGiven) {
  const std::string assessment = Put(Assessed({Put(Inspected())}));
  const auto ask = [](FormsRequest* r) {
    r->mutable_fields()->set_fair_identifier("FAIR-7");
    r->mutable_fields()->add_nonconformances()->set_characteristic("1");
    r->mutable_fields()->mutable_nonconformances(0)->set_number("NC-12");
  };
  const File data = WriteForms(assessment, ask);
  ASSERT_TRUE(data.status.ok()) << data.status;
  EXPECT_EQ(data.name, "sn1_" + IdIn(assessment) + "_first_article.json");
  EXPECT_TRUE(nlohmann::json::accept(data.content));
  for (const char* fact : {"FAIR-7", "DWG-4711", "NC-12", "the assessment says nothing of it"})
    EXPECT_THAT(data.content, HasSubstr(fact));
  EXPECT_EQ(WriteForms(assessment, ask).content, data.content);
  const File html = WriteForms(assessment, [](FormsRequest* r) { r->set_format(v1::REPORT_FORMAT_HTML); });
  EXPECT_EQ(html.name, "sn1_" + IdIn(assessment) + "_first_article.html") << html.status;
  EXPECT_THAT(report::HtmlText(html.content), HasSubstr("DWG-4711"));
}

TEST_F(ReportHandlersTest, AFileLeavesInPiecesOfAMegabyte) {
  const std::string assessment = Put(Assessed({Put(Inspected())}));
  const std::string comment(std::size_t{3} << 20, 'x');
  const File data = WriteForms(assessment, [&](FormsRequest* r) { r->mutable_fields()->set_form1_comments(comment); });
  ASSERT_TRUE(data.status.ok()) << data.status;
  ASSERT_THAT(data.piece_sizes, SizeIs(4));
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(data.piece_sizes[i], std::size_t{1} << 20);
  EXPECT_NE(data.content.find(comment), std::string::npos);
}

TEST_F(ReportHandlersTest, RefusesResultsByTheirPlaceAndWhatIsWanted) {
  const std::string name = Put(Inspected()), assessment = std::string("assessments/") + kSomeUuid;
  const auto refused = [this](const std::vector<std::string>& results,
                              v1::ReportFormat format = v1::REPORT_FORMAT_HTML) {
    const File file = Write(results, format);
    EXPECT_THAT(file.piece_sizes, IsEmpty());
    return ViolationsOf(file.status);
  };
  const char* const kinds = "inspections/, deviations/ or sections/ and a UUID, or one of assessments/";
  EXPECT_THAT(refused({}), Is("results", "0", "1 to 64 of one blade"));
  EXPECT_THAT(refused(std::vector<std::string>(65, name)), Is("results", "65", "1 to 64 of one blade"));
  EXPECT_THAT(refused({name, name}), Is("results[1]", name, "each once"));
  EXPECT_THAT(refused({"scans/s1"}), Is("results[0]", "scans/s1", kinds));
  EXPECT_THAT(refused({name, "measurements/m"}), Is("results[1]", "measurements/m", kinds));
  EXPECT_THAT(refused({"sections/"}),
              Is("results[0]", "sections/",
                 "sections/{id}, the id 1 to 64 of A-Z, a-z, 0-9, '.', '_', '-', the first not '.'"));
  EXPECT_THAT(refused({name, assessment}), Is("results[1]", assessment, "it alone: it names its results"));
  const char* const formats = "REPORT_FORMAT_HTML or REPORT_FORMAT_PDF";
  EXPECT_THAT(refused({name}, v1::REPORT_FORMAT_JSON), Is("format", "REPORT_FORMAT_JSON", formats));
  EXPECT_THAT(refused({name}, static_cast<v1::ReportFormat>(9)), Is("format", "9", formats));
  EXPECT_THAT(refused({}, v1::REPORT_FORMAT_UNSPECIFIED), SizeIs(2)) << "all that is wrong is told at once";
  storage::InspectionRow other = Inspected();
  other.blade_serial = "sn2";
  const std::string of_other = Put(other);
  EXPECT_THAT(refused({name, of_other}), Is("results[1]", of_other + " of blades/sn2", "a result of blades/sn1"));
  storage::SectionMeasurementRow many = Cut();
  many.sections.resize(101, many.sections.front());
  EXPECT_THAT(refused({Put(many)}), Is("results", "101 sections", "100 at most"));
  storage::AssessmentRow revised = Assessed({name});
  revised.part_revision = 2;
  EXPECT_THAT(
      refused({Put(revised)}),
      Is("results", std::string("one by ") + testing::kRegistration + " against parts/p1@1", "all against parts/p1@2"));
}

TEST_F(ReportHandlersTest, RefusesWhatAFirstArticleCannotSay) {
  const std::string assessment = Put(Assessed({Put(Inspected())}));
  const auto refused = [&](const std::function<void(FormsRequest*)>& ask) {
    const File file = WriteForms(assessment, ask);
    EXPECT_THAT(file.piece_sizes, IsEmpty());
    return ViolationsOf(file.status);
  };
  EXPECT_THAT(refused([](FormsRequest* r) { r->set_assessment("sections/s1"); }),
              Is("assessment", "sections/s1",
                 "assessments/{id}, the id 1 to 64 of A-Z, a-z, 0-9, '.', '_', '-', the first not '.'"));
  EXPECT_THAT(refused([](FormsRequest* r) { r->clear_format(); }),
              Is("format", "REPORT_FORMAT_UNSPECIFIED", "REPORT_FORMAT_HTML, REPORT_FORMAT_PDF or REPORT_FORMAT_JSON"));
  EXPECT_THAT(refused([](FormsRequest* r) { r->mutable_fields()->set_partial(true); }),
              Is("fields.reason_for_partial", "empty", "why it is a partial one"));
  EXPECT_THAT(refused([](FormsRequest* r) { r->mutable_fields()->add_evidence()->set_requirement("alloy"); }),
              Is("fields.evidence[0].requirement", "alloy", "a product requirement of drawings/d1"));
  const auto number = [](const char* characteristic) {
    return [characteristic](FormsRequest* r) {
      r->mutable_fields()->add_nonconformances()->set_characteristic(characteristic);
      r->mutable_fields()->mutable_nonconformances(0)->set_number("NC-12");
    };
  };
  EXPECT_THAT(refused(number("9")),
              Is("fields.nonconformances[0].characteristic", "9", "a characteristic of drawings/d1"));
  EXPECT_THAT(refused(number("2")), Is("fields.nonconformances[0].characteristic", "2", "one that does not conform"));
  EXPECT_THAT(refused([](FormsRequest* r) {
                r->clear_assessment();
                r->clear_format();
                r->mutable_fields()->set_partial(true);
              }),
              SizeIs(3))
      << "all that is wrong is told at once";
}

TEST_F(ReportHandlersTest, WhatIsNotRecordedIsNotFoundByItsOwnReason) {
  const auto expect = [](const absl::Status& status, const std::string& reason, const std::string& name) {
    EXPECT_EQ(status.code(), absl::StatusCode::kNotFound) << status;
    EXPECT_EQ(runtime::ReasonOf(status), reason);
    EXPECT_EQ(runtime::MetadataOf(status)["resource"], name);
  };
  for (const auto& [collection, reason] :
       {std::pair("inspections/", "INSPECTION_NOT_FOUND"), std::pair("deviations/", "DEVIATION_MAP_NOT_FOUND"),
        std::pair("sections/", "SECTION_MEASUREMENT_NOT_FOUND"), std::pair("assessments/", "ASSESSMENT_NOT_FOUND")})
    expect(Write({std::string(collection) + kSomeUuid}).status, reason, std::string(collection) + kSomeUuid);
  expect(WriteForms(std::string("assessments/") + kSomeUuid).status, "ASSESSMENT_NOT_FOUND",
         std::string("assessments/") + kSomeUuid);
  const std::string lost = std::string("measurements/") + kSomeUuid;
  expect(Write({Put(Assessed({lost}))}).status, "MEASUREMENT_NOT_FOUND", lost);
  storage::InspectionRow unregistered = Inspected();  // and what others do not know is told as they say it
  unregistered.registration_id = kSomeUuid;
  const absl::Status status = Write({Put(unregistered)}).status;
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound) << status;
  EXPECT_THAT(std::string(status.message()), HasSubstr(std::string("registrations/") + kSomeUuid));
  storage::AssessmentRow undrawn = Assessed({lost});
  undrawn.drawing_id = "d2";
  const std::string name = Put(undrawn);
  for (const absl::Status& drawn : {Write({name}).status, WriteForms(name).status})
    EXPECT_THAT(std::string(drawn.message()), HasSubstr("drawings/d2@1 is not known"));
}

// Rows of a newer release, after a step back to this one, or of a hand.
TEST_F(ReportHandlersTest, WhatCannotBeReadIsDataLoss) {
  storage::InspectionRow inspection = Inspected();
  inspection.holes[0].verdict = "TORN";
  storage::DeviationMapRow map = Mapped(), other_patches = Mapped();
  map.profiles[0].zone = "ORIENTATION";
  other_patches.patches.means_um.pop_back();
  storage::SectionMeasurementRow sections = Cut(), outlines = Cut();
  sections.sections[0].values[0].parameter = "CHORD_GUESSED";
  outlines.outlines.clear();
  const std::string of_patches = Put(other_patches), of_outlines = Put(outlines);
  for (const std::string& name : {Put(inspection), Put(map), of_patches, Put(sections), of_outlines}) {
    const File file = Write({name});
    EXPECT_EQ(file.status.code(), absl::StatusCode::kDataLoss) << name << ": " << file.status;
    EXPECT_THAT(file.piece_sizes, IsEmpty());
  }
  EXPECT_THAT(std::string(Write({of_patches}).status.message()), HasSubstr("as its part's surface has"));
  EXPECT_THAT(std::string(Write({of_outlines}).status.message()), HasSubstr("outlines of 0 sections, want 1"));
  storage::AssessmentRow assessment = Assessed({Put(Inspected())}), undrawn = assessment;
  assessment.findings[0].result_index = 1;  // there is one result
  undrawn.findings[0].characteristic = "9";
  const std::string misplaced = Put(assessment);
  for (const absl::Status& status :
       {Write({misplaced}).status, WriteForms(misplaced).status, WriteForms(Put(undrawn)).status})
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss) << status;
}

TEST_F(ReportHandlersTest, SaysWhatTheStoresSay) {
  const std::string inspection = Put(Inspected()), map = Put(Mapped()), sections = Put(Cut());
  const std::string assessment = Put(Assessed({inspection})), measured = Put(Assessed({PutMeasurement()}));
  inspections_->Fail(absl::UnavailableError("database: away"));
  const absl::Status away = Write({inspection}).status;
  EXPECT_EQ(away.code(), absl::StatusCode::kUnavailable) << away;
  EXPECT_THAT(std::string(away.message()), HasSubstr("database: away"));
  const absl::Status full = absl::ResourceExhaustedError("database: full");
  deviations_->Fail(full);
  sections_->Fail(full);
  measurements_->Fail(full);
  for (const std::string& name : {map, sections, measured})
    EXPECT_EQ(Write({name}).status.code(), absl::StatusCode::kResourceExhausted) << name;
  assessments_->Fail(full);
  for (const absl::Status& status : {Write({assessment}).status, WriteForms(assessment).status})
    EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted) << status;
}

// Its answer is waited for by a client that goes away.
class RegistrationsOfNobody final : public registration::v1::RegistrationService::Service {
 public:
  explicit RegistrationsOfNobody(grpc::ClientContext* client) : client_(client) {}
  std::atomic<int> asked_count{0};
  grpc::Status GetRegistration(grpc::ServerContext* context, const registration::v1::GetRegistrationRequest*,
                               registration::v1::Registration*) override {
    ++asked_count;
    client_->TryCancel();
    EXPECT_TRUE(testing::Becomes(std::chrono::seconds(30), [&] { return context->IsCancelled(); }));
    return grpc::Status::OK;
  }

 private:
  grpc::ClientContext* const client_;
};

TEST_F(ReportHandlersTest, NothingIsFetchedOnForAClientThatIsGone) {
  const std::unique_ptr<grpc::ClientContext> context = runtime::ContextFor(60);
  RegistrationsOfNobody registrations(context.get());
  testing::InProcessServer registration_server({&registrations});
  ReportService service(
      Sources(), std::make_shared<const clients::BladePeers>(plant_.Connect(), plant_.Connect(), plant_.Connect(),
                                                             registration_server.Connect()));
  testing::InProcessServer server({&service});
  const auto stub = v1::ReportService::NewStub(server.Connect());
  storage::InspectionRow another = Inspected();
  another.registration_id = kSomeUuid;
  v1::WriteReportRequest request;
  request.add_results(Put(Inspected()));
  request.add_results(Put(another));
  request.set_format(v1::REPORT_FORMAT_HTML);
  const auto reader = stub->WriteReport(context.get(), request);
  for (v1::WriteReportResponse piece; reader->Read(&piece);) ADD_FAILURE() << piece.file();
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::CANCELLED);
  EXPECT_TRUE(testing::Becomes(std::chrono::seconds(30),
                               [] { return testing::Exposed("sixpoint_pool_running{pool=\"reports\"}") == 0; }));
  EXPECT_EQ(registrations.asked_count, 1);
}

}  // namespace
}  // namespace sixpoint::inspection
