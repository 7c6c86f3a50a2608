// A recorded blade's file tells all that its results hold, in both formats, the same bytes each time; what cannot be meant is refused by name.
#include "services/inspection/report_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "services/inspection/deviation_service.h"
#include "services/inspection/inspection_service.h"
#include "services/inspection/section_service.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "sixpoint/plant/v1/drawing.grpc.pb.h"
#include "tests/report/read_report.h"
#include "tests/services/inspection/airfoil_plant.h"
#include "tests/support/registered.h"
#include "tests/support/sanitizer.h"

namespace sixpoint::inspection {
namespace {

using report::Packed;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr char kUnknown[] = "018f6f3e-7c1a-7e5b-9d5a-2f1c3b4a5d6e";
constexpr char kAssessment[] = "assessments/018f6f3e-7c1a-7e5b-9d5a-2f1c3b4a5d70";

class Drawings final : public plant::v1::DrawingService::Service {
 public:
  plant::v1::Drawing drawing;
  grpc::Status GetDrawing(grpc::ServerContext*, const plant::v1::GetDrawingRequest* request,
                          plant::v1::Drawing* response) override {
    if (request->name() != "drawings/dwg@1") return {grpc::StatusCode::NOT_FOUND, request->name()};
    *response = drawing;
    return grpc::Status::OK;
  }
};

template <typename Plant>
class ReportServiceTest : public ::testing::Test {
 protected:
  ReportServiceTest() {
    plant_.registration.registration.set_software_version("0.9.1");
    for (auto& [name, scan] : plant_.ingest.scans) scan.mutable_received_at()->set_seconds(1'795'000'000);
  }

  template <typename Stub, typename Request, typename Response>
  Response Record(grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*), Stub& stub,
                  const Request& request) {
    Response response;
    const grpc::Status status =
        (stub.*method)(runtime::ContextFor(sixpoint::testing::kPatience * 120).get(), request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response;
  }
  v1::Inspection Inspect() {
    v1::InspectRequest request;
    request.set_blade("blades/sn1");
    for (const std::string& scan : plant_.scans) request.add_scans(scan);
    return Record(&v1::InspectionService::Stub::Inspect, *v1::InspectionService::NewStub(server_.Connect()), request);
  }
  v1::DeviationMap Map() {
    v1::MapDeviationRequest request;
    request.set_registration(testing::kRegistration);
    request.set_patch_mm(2);
    v1::ProfileTolerance& profile = *request.add_profiles();
    profile.set_characteristic("17 profile");
    profile.set_zone(v1::PROFILE_ZONE_FORM_AND_LOCATION);
    profile.set_lower_mm(-0.02);
    profile.set_upper_mm(0.02);
    profile.set_least_coverage(0.1);
    return Record(&v1::DeviationService::Stub::MapDeviation, *v1::DeviationService::NewStub(server_.Connect()),
                  request);
  }
  v1::SectionMeasurement Cut(const std::vector<double>& heights_mm) {
    v1::MeasureSectionsRequest request;
    request.set_registration(testing::kRegistration);
    for (const double height_mm : heights_mm) {
      v1::SectionPlane& plane = *request.add_sections();
      plane.set_section("cut " + std::to_string(static_cast<int>(height_mm)));
      plane.mutable_origin_in_part_mm()->set_z_mm(height_mm);
    }
    return Record(&v1::SectionService::Stub::MeasureSections, *v1::SectionService::NewStub(server_.Connect()), request);
  }

  struct File {
    std::string name, content;
    std::size_t greatest_piece = 0;
  };
  template <typename Response>
  static absl::StatusOr<File> Read(grpc::ClientReader<Response>* reader) {
    File file;
    for (Response piece; reader->Read(&piece);) {
      file.name = piece.file();
      file.content += piece.content();
      file.greatest_piece = std::max(file.greatest_piece, piece.content().size());
    }
    const grpc::Status status = reader->Finish();
    if (!status.ok()) return runtime::FromGrpc(status);
    return file;
  }
  absl::StatusOr<File> Write(const std::vector<std::string>& results, v1::ReportFormat format) {
    v1::WriteReportRequest request;
    for (const std::string& result : results) request.add_results(result);
    request.set_format(format);
    const auto context = runtime::ContextFor(sixpoint::testing::kPatience * 60);
    return Read(v1::ReportService::NewStub(server_.Connect())->WriteReport(context.get(), request).get());
  }
  std::string RefusalOf(const std::vector<std::string>& results, v1::ReportFormat format = v1::REPORT_FORMAT_HTML) {
    return std::string(Write(results, format).status().message());
  }
  absl::StatusOr<File> WriteForms(const v1::WriteFirstArticleRequest& request) {
    const auto context = runtime::ContextFor(sixpoint::testing::kPatience * 60);
    return Read(v1::ReportService::NewStub(server_.Connect())->WriteFirstArticle(context.get(), request).get());
  }

  Plant plant_;
  Drawings drawings_;
  v1::Assessment assessment_;
  testing::InProcessServer plant_server_{{&plant_.plant, &drawings_}};
  std::shared_ptr<const clients::BladePeers> peers_ = std::make_shared<const clients::BladePeers>(
      plant_server_.Connect(), plant_.Connect(), plant_.Connect(), plant_.Connect());
  InspectionService inspections_{storage::InspectionsIn(plant_.database.database()), peers_, {}};
  DeviationService deviations_{storage::DeviationsIn(plant_.database.database()), peers_, {}};
  SectionService sections_{storage::SectionsIn(plant_.database.database()), peers_, {}};
  ReportService reports_{
      {storage::InspectionsIn(plant_.database.database()), storage::DeviationsIn(plant_.database.database()),
       storage::SectionsIn(plant_.database.database()), storage::MeasurementsIn(plant_.database.database()),
       [this](const std::string& name, storage::Deadline) -> absl::StatusOr<v1::Assessment> {
         if (name == assessment_.name()) return assessment_;
         return runtime::Failure(errors::v1::ASSESSMENT_NOT_FOUND, "name: " + name);
       }},
      peers_};
  testing::InProcessServer server_{{&inspections_, &deviations_, &sections_, &reports_}};
};

class BlockReportTest : public ReportServiceTest<testing::JudgedPlant> {
 protected:
  BlockReportTest() {
    for (const std::string& scan : plant_.scans) plant_.registration.registration.add_scans(scan);
  }
  // Judges the first hole's position by a drawing.
  void Assess(const v1::Inspection& inspection) {
    drawings_.drawing.set_name("drawings/dwg");
    drawings_.drawing.set_drawing_number("DWG-4711");
    drawings_.drawing.set_drawing_revision("C");
    drawings_.drawing.set_part_name("Block");
    drawings_.drawing.mutable_decision_rule()->set_kind(plant::v1::DECISION_RULE_KIND_SIMPLE_ACCEPTANCE);
    plant::v1::Characteristic& drawn = *drawings_.drawing.add_characteristics();
    drawn.set_characteristic("12");
    drawn.set_name("position");
    drawn.set_requirement("position 0.2 A B C");
    drawn.set_hole_group(inspection.holes(0).group());
    drawn.set_quantity(plant::v1::CHARACTERISTIC_QUANTITY_HOLE_POSITION);
    assessment_.set_name(kAssessment);
    assessment_.set_blade("blades/sn1");
    assessment_.set_drawing("drawings/dwg@1");
    assessment_.set_part("parts/p1");
    assessment_.set_part_revision(1);
    assessment_.set_stage(v1::ASSESSMENT_STAGE_MACHINED);
    assessment_.set_verdict(v1::VERDICT_CONFORM);
    assessment_.add_results(inspection.name());
    v1::CharacteristicFinding& finding = *assessment_.add_findings();
    finding.set_characteristic("12");
    finding.set_feature(inspection.holes(0).hole());
    finding.set_name("position");
    finding.set_quantity(drawn.quantity());
    finding.set_unit(plant::v1::CHARACTERISTIC_UNIT_MM);
    finding.set_upper_limit(5);
    finding.set_value(inspection.holes(0).position_error_mm());
    finding.set_expanded_uncertainty(inspection.holes(0).position_expanded_uncertainty_um() / 1e3);
    finding.set_verdict(v1::VERDICT_CONFORM);
    finding.set_result(inspection.name());
  }
};

TEST_F(BlockReportTest, TellsAllThatTheResultsHoldInBothFormatsTheSameBytesTwice) {
  const v1::Inspection inspection = Inspect();
  const v1::DeviationMap map = Map();
  ASSERT_EQ(inspection.verdict(), v1::VERDICT_NOT_CONFORM);
  const std::vector<std::string> results = {inspection.name(), map.name()};
  std::vector<std::string> facts = {"NOT CONFORM",
                                    "sn1",
                                    testing::kSensorCalibration,
                                    testing::kRotationCalibration,
                                    testing::kRegistration,
                                    "17 profile",
                                    "0.9.1",
                                    "six datum points",
                                    "m1, revision 1"};
  facts.insert(facts.end(), results.begin(), results.end());
  for (const v1::HoleResult& hole : inspection.holes()) facts.push_back(hole.group() + "/" + hole.hole() + "/position");
  for (const auto& [name, scan] : plant_.ingest.scans) facts.insert(facts.end(), {name, scan.sha256()});
  for (const uncertainty::v1::UncertaintyComponent& component : map.budget()) facts.push_back(component.source());
  for (const v1::ReportFormat format : {v1::REPORT_FORMAT_HTML, v1::REPORT_FORMAT_PDF}) {
    const auto file = Write(results, format);
    ASSERT_TRUE(file.ok()) << file.status();
    const bool is_pdf = format == v1::REPORT_FORMAT_PDF;
    EXPECT_EQ(file->name, "sn1_" + inspection.name().substr(12) + (is_pdf ? ".pdf" : ".html"));
    EXPECT_LE(file->greatest_piece, std::size_t{1} << 20);
    EXPECT_EQ(Write(results, format)->content, file->content);
    if (is_pdf && !report::HasPdfToText()) continue;  // nothing to read it with
    const std::string text = is_pdf ? Packed(report::PdfText(file->content)) : report::HtmlText(file->content);
    for (const std::string& fact : facts) EXPECT_THAT(text, HasSubstr(Packed(fact))) << v1::ReportFormat_Name(format);
    EXPECT_THAT(text, HasSubstr(is_pdf ? "page1of" : Packed("seen from: front")));
  }
}

TEST_F(BlockReportTest, WithoutAMapThereIsNoPictureAndItSaysSo) {
  const auto file = Write({Inspect().name()}, v1::REPORT_FORMAT_HTML);
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_THAT(report::HtmlText(file->content),
              HasSubstr(Packed("Deviation of the surface: not measured. No deviation map is among the results.")));
}

TEST_F(BlockReportTest, DrawsEveryMapToSixAndSaysHowManyMore) {
  std::vector<std::string> maps;
  for (int i = 0; i < 7; ++i) maps.push_back(Map().name());
  const auto file = Write(maps, v1::REPORT_FORMAT_HTML);
  ASSERT_TRUE(file.ok()) << file.status();
  const std::string text = report::HtmlText(file->content);
  for (int i = 1; i <= 6; ++i) EXPECT_THAT(text, HasSubstr("(" + std::to_string(i) + ").Greywithin"));
  EXPECT_THAT(text, Not(HasSubstr("(7).Greywithin")));
  EXPECT_THAT(text, HasSubstr(Packed("1 more deviation maps are told by region alone: 6 are drawn.")));
}

TEST_F(BlockReportTest, OfAnAssessmentTheVerdictIsItsOwn) {
  const v1::Inspection inspection = Inspect();
  Assess(inspection);
  const auto file = Write({kAssessment}, v1::REPORT_FORMAT_HTML);
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(file->name, std::string("sn1_") + (kAssessment + 12) + ".html");
  const std::string text = report::HtmlText(file->content);
  for (const char* fact :
       {"DWG-4711, revision C", "position 0.2 A B C", "not judged", "simple acceptance", kAssessment})
    EXPECT_THAT(text, HasSubstr(Packed(fact)));
  // The inspection is not conform by the part's record: nothing of that is told as the drawing's.
  EXPECT_THAT(text, Not(HasSubstr(Packed("NOT CONFORM"))));

  v1::WriteFirstArticleRequest request;
  request.set_assessment(kAssessment);
  request.set_format(v1::REPORT_FORMAT_JSON);
  request.mutable_fields()->set_fair_identifier("FAIR-7");
  const auto data = WriteForms(request);
  ASSERT_TRUE(data.ok()) << data.status();
  EXPECT_EQ(data->name, std::string("sn1_") + (kAssessment + 12) + "_first_article.json");
  EXPECT_TRUE(nlohmann::json::accept(data->content));
  EXPECT_THAT(data->content, HasSubstr("FAIR-7"));
  EXPECT_EQ(WriteForms(request)->content, data->content);
  request.set_format(v1::REPORT_FORMAT_HTML);
  EXPECT_THAT(report::HtmlText(WriteForms(request)->content), HasSubstr(Packed("DWG-4711")));
  request.set_format(v1::REPORT_FORMAT_PDF);
  const auto pdf = WriteForms(request);
  ASSERT_TRUE(pdf.ok()) << pdf.status();
  if (!report::HasPdfToText()) GTEST_SKIP() << "SKIPPED: no pdftotext (poppler-utils)";
  EXPECT_THAT(Packed(report::PdfText(pdf->content)), HasSubstr("FAIR-7"));
}

TEST_F(BlockReportTest, RefusesByNameWhatCannotBeMeant) {
  const v1::Inspection inspection = Inspect();
  EXPECT_THAT(RefusalOf({}), HasSubstr("results: 0, want 1 to 64 of one blade"));
  EXPECT_THAT(RefusalOf(std::vector<std::string>(65, inspection.name())), HasSubstr("results: 65, want 1 to 64"));
  EXPECT_THAT(RefusalOf({inspection.name(), inspection.name()}), HasSubstr("results[1]: " + inspection.name()));
  EXPECT_THAT(RefusalOf({"scans/s1"}), HasSubstr("results[0]: scans/s1, want inspections/, deviations/ or sections/"));
  EXPECT_THAT(RefusalOf({inspection.name(), kAssessment}),
              HasSubstr(std::string("results[1]: ") + kAssessment + ", want it alone"));
  EXPECT_THAT(RefusalOf({inspection.name()}, v1::REPORT_FORMAT_JSON), HasSubstr("format: REPORT_FORMAT_JSON, want"));
  EXPECT_THAT(RefusalOf({inspection.name()}, v1::REPORT_FORMAT_UNSPECIFIED), HasSubstr("format: "));
  for (const auto& [collection, reason] :
       {std::pair("inspections/", "INSPECTION_NOT_FOUND"), std::pair("deviations/", "DEVIATION_MAP_NOT_FOUND"),
        std::pair("sections/", "SECTION_MEASUREMENT_NOT_FOUND"), std::pair("assessments/", "ASSESSMENT_NOT_FOUND")})
    EXPECT_EQ(runtime::ReasonOf(Write({std::string(collection) + kUnknown}, v1::REPORT_FORMAT_HTML).status()), reason);
  v1::WriteFirstArticleRequest request;
  request.set_assessment(inspection.name());
  request.set_format(v1::REPORT_FORMAT_JSON);
  EXPECT_THAT(std::string(WriteForms(request).status().message()), HasSubstr("assessment: " + inspection.name()));
  request.set_assessment(std::string("assessments/") + kUnknown);
  EXPECT_EQ(runtime::ReasonOf(WriteForms(request).status()), "ASSESSMENT_NOT_FOUND");
}

TEST_F(BlockReportTest, RefusesResultsOfAnotherBladeAndOfAnotherRevision) {
  const v1::Inspection first = Inspect();
  // The same scans as another blade's, and of another revision of the part: as the rows say it.
  auto transaction = plant_.database.database()->Begin(testing::Soon());
  testing::RegisterBlade(*transaction, "sn2", "p1");
  ASSERT_TRUE(transaction->Commit().ok());
  plant_.registration.registration.set_blade("blades/sn2");
  const v1::DeviationMap other = Map();
  ASSERT_EQ(other.blade(), "blades/sn2");
  EXPECT_THAT(RefusalOf({first.name(), other.name()}),
              HasSubstr("results[1]: " + other.name() + " of blades/sn2, want a result of blades/sn1"));
  Assess(first);
  assessment_.set_part_revision(2);
  EXPECT_THAT(RefusalOf({kAssessment}), HasSubstr("results: one by " + std::string(testing::kRegistration) +
                                                  " against parts/p1@1, want all against parts/p1@2"));
}

// Of an airfoil whose sections were seen.
class AirfoilReportTest : public ReportServiceTest<testing::AirfoilPlant> {};

TEST_F(AirfoilReportTest, PlotsEverySectionAndTheSurface) {
  const v1::DeviationMap map = Map();
  const v1::SectionMeasurement sections = Cut({-6, 4, 8, 12});
  const auto file = Write({map.name(), sections.name()}, v1::REPORT_FORMAT_HTML);
  ASSERT_TRUE(file.ok()) << file.status();
  const std::string text = report::HtmlText(file->content);
  for (const char* name : {"cut -6", "cut 4", "cut 8", "cut 12"})
    EXPECT_THAT(text, HasSubstr(Packed("Outline of " + std::string(name) + " at")));
  EXPECT_THAT(text, HasSubstr(Packed("chord nose tail")));
  EXPECT_THAT(text, HasSubstr(Packed("Uncertainty of cut -6: chord nose tail")));
  EXPECT_THAT(text, HasSubstr(Packed("no point was seen there")));  // at 12
  EXPECT_THAT(text, HasSubstr(Packed("Deviation of the surface from the CAD, seen from: front")));
  const auto pdf = Write({map.name(), sections.name()}, v1::REPORT_FORMAT_PDF);
  ASSERT_TRUE(pdf.ok()) << pdf.status();
  EXPECT_EQ(Write({map.name(), sections.name()}, v1::REPORT_FORMAT_PDF)->content, pdf->content);
  // Without a map nothing is judged: never conform.
  const auto alone = Write({sections.name()}, v1::REPORT_FORMAT_HTML);
  ASSERT_TRUE(alone.ok()) << alone.status();
  EXPECT_THAT(report::HtmlText(alone->content), HasSubstr(Packed("No tolerance was judged.")));
  if (!report::HasPdfToText()) GTEST_SKIP() << "SKIPPED: no pdftotext (poppler-utils)";
  for (const char* name : {"cut -6", "cut 4", "cut 8", "cut 12"})
    EXPECT_THAT(Packed(report::PdfText(pdf->content)), HasSubstr(Packed(std::string(name) + " at")));
}

}  // namespace
}  // namespace sixpoint::inspection
