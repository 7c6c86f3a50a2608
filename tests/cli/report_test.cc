// `sixpoint report` asks for what its words say, and its file is what came; what people know of a first article is read as the docs write it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "cli/document.h"
#include "cli/first_article_document.h"
#include "sixpoint/inspection/v1/report.grpc.pb.h"
#include "tests/cli/command_run.h"
#include "tests/cli/example.h"
#include "tests/cli/plant_with_inspection.h"
#include "tests/support/in_process_server.h"

namespace sixpoint::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

struct FakeReports final : inspection::v1::ReportService::Service {
  inspection::v1::WriteReportRequest report;
  inspection::v1::WriteFirstArticleRequest first_article;
  template <typename Response>
  static grpc::Status InTwoPieces(grpc::ServerWriter<Response>* writer) {
    for (const char* content : {"one ", "two"}) {
      Response piece;
      piece.set_file("sn-1.pdf");
      piece.set_content(content);
      writer->Write(piece);
    }
    return grpc::Status::OK;
  }
  grpc::Status WriteReport(grpc::ServerContext*, const inspection::v1::WriteReportRequest* in,
                           grpc::ServerWriter<inspection::v1::WriteReportResponse>* writer) override {
    report = *in;
    return InTwoPieces(writer);
  }
  grpc::Status WriteFirstArticle(grpc::ServerContext*, const inspection::v1::WriteFirstArticleRequest* in,
                                 grpc::ServerWriter<inspection::v1::WriteFirstArticleResponse>* writer) override {
    first_article = *in;
    return InTwoPieces(writer);
  }
};

class ReportCommands : public ::testing::Test {
 protected:
  ReportCommands() {
    std::filesystem::create_directories(folder_);
    plant_.address = server_.address();
  }
  Ended Run(const std::string& words) const {
    return RunCommand(words + " --server " + server_.address(),
                      [](Session* session) { session->credentials = grpc::InsecureChannelCredentials(); });
  }
  std::string Written(const std::string& file) const { return *ReadFile(folder_ + "/" + file, 1000); }
  std::string Changed(const std::string& from, const std::string& to) const {
    std::string text = *ReadFile(Example("first_article.yaml"), kGreatestDocumentBytes);
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    EXPECT_TRUE(WriteFile(folder_ + "/fields.yaml", text.replace(at, from.size(), to)).ok());
    return folder_ + "/fields.yaml";
  }
  const std::string folder_ = ::testing::TempDir() + "/report";
  PlantWithInspection plant_;
  FakeReports reports_;
  testing::InProcessServer server_{{&plant_, &reports_}};
};

TEST_F(ReportCommands, AReportIsWrittenInTheFormatOfItsFile) {
  const Ended ended = Run("report write inspections/a deviations/b --out " + folder_ + "/sn-1.pdf");
  EXPECT_EQ(ended.exit_code, kDone) << ended.err;
  EXPECT_EQ(Written("sn-1.pdf"), "one two");
  EXPECT_THAT(ended.out, HasSubstr("sn-1.pdf: 7 bytes"));
  EXPECT_THAT(reports_.report.results(), ElementsAre("inspections/a", "deviations/b"));
  EXPECT_EQ(reports_.report.format(), inspection::v1::REPORT_FORMAT_PDF);
  const Ended piped = Run("report write assessments/a --format html --out -");
  EXPECT_EQ(piped.out, "one two");
  EXPECT_THAT(piped.err, HasSubstr("standard output: 7 bytes"));
  EXPECT_EQ(reports_.report.format(), inspection::v1::REPORT_FORMAT_HTML);
  EXPECT_EQ(Run("report write a --out " + folder_ + "/sn-1.html --json").json()["bytes"], 7);
  EXPECT_THAT(Run("report write a --out " + folder_ + "/sn-1.txt").err, HasSubstr("--format: txt, want html or pdf"));
  EXPECT_THAT(Run("report write a --out " + folder_ + "/none/sn-1.pdf").err, HasSubstr("a folder that exists"));
}

TEST_F(ReportCommands, AFirstArticleTakesWhatPeopleKnow) {
  const Ended ended =
      Run("report first-article a --fields " + Example("first_article.yaml") + " --out " + folder_ + "/fair.json");
  EXPECT_EQ(ended.exit_code, kDone) << ended.err;
  EXPECT_EQ(Written("fair.json"), "one two");
  EXPECT_EQ(reports_.first_article.assessment(), "assessments/a");
  EXPECT_EQ(reports_.first_article.format(), inspection::v1::REPORT_FORMAT_JSON);
  const inspection::v1::FirstArticleFields& fields = reports_.first_article.fields();
  EXPECT_EQ(fields.fair_identifier(), "FAIR-2026-018");
  EXPECT_EQ(fields.purchase_order(), "PO-88123");
  EXPECT_TRUE(fields.partial());
  EXPECT_EQ(fields.reason_for_partial(), "New coating");
  EXPECT_EQ(fields.verified().name(), "J. Doe");
  EXPECT_GT(fields.verified().signed_at().seconds(), 1'795'000'000);
  EXPECT_FALSE(fields.has_reviewed());
  ASSERT_EQ(fields.evidence_size(), 1);
  EXPECT_EQ(fields.evidence(0).customer_approval(), "Yes");
  ASSERT_EQ(fields.nonconformances_size(), 1);
  EXPECT_EQ(fields.nonconformances(0).characteristic(), "12");
}

TEST_F(ReportCommands, AFileSaysWhereItIsOdd) {
  const auto refusal = [this](const std::string& from, const std::string& to) {
    return std::string(LoadFirstArticleFields(Changed(from, to)).status().message());
  };
  EXPECT_THAT(refusal("fair_identifier:", "fair_identifer:"), HasSubstr("fair_identifer"));
  EXPECT_THAT(refusal("  name: J. Doe\n", ""), HasSubstr("verified.name"));
  EXPECT_THAT(refusal("\"2026-11-26\"", "\"next week\""), HasSubstr("verified.signed_at"));
  EXPECT_THAT(refusal("characteristic: \"12\"", "characteristic: 12"), HasSubstr("nonconformances[0].characteristic"));
  EXPECT_THAT(refusal("partial: true", "partial: maybe"), HasSubstr("partial"));
}

}  // namespace
}  // namespace sixpoint::cli
