// What is downloaded as a file: whole, once, and told of while it comes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <filesystem>

#include "cli/document.h"
#include "sixpoint/correction/v1/reconstruction.grpc.pb.h"
#include "sixpoint/correction/v1/repair.grpc.pb.h"
#include "sixpoint/inspection/v1/deviation.grpc.pb.h"
#include "sixpoint/inspection/v1/export.grpc.pb.h"
#include "sixpoint/inspection/v1/report.grpc.pb.h"
#include "sixpoint/inspection/v1/section.grpc.pb.h"
#include "tests/cli/command_run.h"
#include "tests/cli/plant_with_inspection.h"
#include "tests/cli/terminal.h"
#include "tests/support/in_process_server.h"

namespace sixpoint::cli {
namespace {

using ::testing::HasSubstr;

struct PlantWithDownloads final : PlantWithInspection {
  grpc::Status ListEndpoints(grpc::ServerContext* context, const plant::v1::ListEndpointsRequest* in,
                             plant::v1::ListEndpointsResponse* out) override {
    auto* endpoint = out->add_endpoints();
    endpoint->set_area("correction");
    endpoint->set_address(address);
    return PlantWithInspection::ListEndpoints(context, in, out);
  }
};

// Long enough for the first second to be told; tests of what comes do not wait.
std::atomic<bool> g_is_slow{false};
void Wait() {
  if (g_is_slow) usleep(1'300'000);
}

template <typename Message>
grpc::Status Send(grpc::ServerWriter<Message>* writer, const Message& message = Message()) {
  Wait();
  writer->Write(message);
  return grpc::Status::OK;
}

struct SlowDeviations final : inspection::v1::DeviationService::Service {
  grpc::Status DownloadDeviationPatches(grpc::ServerContext*, const inspection::v1::DownloadDeviationPatchesRequest*,
                                        grpc::ServerWriter<inspection::v1::DeviationPatches>* writer) override {
    return Send(writer);
  }
  grpc::Status DownloadDeviationCloud(grpc::ServerContext*, const inspection::v1::DownloadDeviationCloudRequest*,
                                      grpc::ServerWriter<inspection::v1::DeviationCloudBlock>*) override {
    Wait();
    return grpc::Status::OK;
  }
};

struct SlowSections final : inspection::v1::SectionService::Service {
  int breaking_off_count = 0;  // so often it ends after its first message
  std::string asked;
  grpc::Status DownloadSectionOutlines(grpc::ServerContext*, const inspection::v1::DownloadSectionOutlinesRequest* in,
                                       grpc::ServerWriter<inspection::v1::SectionOutline>* writer) override {
    asked = in->name();
    inspection::v1::SectionOutline outline;
    outline.set_section("50 %");
    outline.add_nominal_mm(1);
    outline.add_nominal_mm(2);
    if (grpc::Status sent = Send(writer, outline); breaking_off_count == 0) return sent;
    --breaking_off_count;
    return {grpc::StatusCode::UNAVAILABLE, "restarting"};
  }
};

struct SlowExports final : inspection::v1::ExportService::Service {
  std::string file = "SN-1.qif";
  grpc::Status ExportResults(grpc::ServerContext*, const inspection::v1::ExportResultsRequest*,
                             grpc::ServerWriter<inspection::v1::ExportResultsResponse>* writer) override {
    inspection::v1::ExportResultsResponse piece;
    piece.set_file(file);
    piece.set_content("one ");
    writer->Write(piece);
    piece.set_content("two");
    return Send(writer, piece);
  }
};

struct SlowReports final : inspection::v1::ReportService::Service {
  grpc::Status WriteReport(grpc::ServerContext*, const inspection::v1::WriteReportRequest*,
                           grpc::ServerWriter<inspection::v1::WriteReportResponse>* writer) override {
    return Send(writer);
  }
};

struct SlowReconstructions final : correction::v1::ReconstructionService::Service {
  grpc::Status GetReconstruction(grpc::ServerContext*, const correction::v1::GetReconstructionRequest*,
                                 correction::v1::Reconstruction*) override {
    return grpc::Status::OK;
  }
  grpc::Status DownloadBlankPatches(grpc::ServerContext*, const correction::v1::DownloadBlankPatchesRequest*,
                                    grpc::ServerWriter<correction::v1::BlankPatches>* writer) override {
    return Send(writer);
  }
  grpc::Status DownloadLattice(grpc::ServerContext*, const correction::v1::DownloadLatticeRequest*,
                               grpc::ServerWriter<correction::v1::LatticePiece>* writer) override {
    correction::v1::LatticePiece piece;
    piece.set_lattice(std::string("\0\1", 2));
    writer->Write(piece);
    return Send(writer, piece);
  }
};

struct SlowRepairs final : correction::v1::RepairService::Service {
  grpc::Status DownloadTargetContours(grpc::ServerContext*, const correction::v1::DownloadTargetContoursRequest*,
                                      grpc::ServerWriter<correction::v1::TargetContour>* writer) override {
    return Send(writer);
  }
  grpc::Status DownloadRepairPath(grpc::ServerContext*, const correction::v1::DownloadRepairPathRequest*,
                                  grpc::ServerWriter<correction::v1::RepairLap>* writer) override {
    correction::v1::RepairLap lap;
    for (const double coordinate : {1, 2, 3}) lap.add_centres_in_part_mm(coordinate);
    for (const double coordinate : {0, 0, 1}) lap.add_axes_in_part(coordinate);
    writer->Write(lap);
    return Send(writer, lap);
  }
};

class Downloads : public ::testing::Test {
 protected:
  Downloads() {
    std::filesystem::create_directories(folder_);
    plant_.address = server_.address();
  }
  ~Downloads() override {
    g_is_slow = false;
    std::filesystem::remove_all(folder_);
  }
  Ended Run(const std::string& words) const {
    return RunCommand(words + " --server " + server_.address(),
                      [](Session* session) { session->credentials = grpc::InsecureChannelCredentials(); });
  }
  // What was told of it to who sits at a terminal.
  std::string Told(const std::string& words) const {
    std::string told;
    OnATerminal([&] { told = Run(words).err; });
    return told;
  }
  const std::string folder_ = ::testing::TempDir() + "/sixpoint_downloads_test";
  PlantWithDownloads plant_;
  SlowDeviations deviations_;
  SlowSections sections_;
  SlowExports exports_;
  SlowReports reports_;
  SlowReconstructions reconstructions_;
  SlowRepairs repairs_;
  testing::InProcessServer server_{
      {&plant_, &deviations_, &sections_, &exports_, &reports_, &reconstructions_, &repairs_}};
};

TEST_F(Downloads, TellForHowLongTheyLast) {
  g_is_slow = true;
  for (const auto& [words, name] :
       {std::pair("deviation patches a", "deviations/a"), std::pair("deviation points b", "deviations/b"),
        std::pair("section outlines c", "sections/c"), std::pair("reconstruction patches d", "reconstructions/d"),
        std::pair("reconstruction lattice e", "reconstructions/e"), std::pair("repair contours f", "repairs/f"),
        std::pair("repair path g", "repairs/g")})
    EXPECT_THAT(Told(std::string(words) + " --out " + folder_ + "/file.csv"),
                HasSubstr("downloading " + std::string(name) + ", 1 s"))
        << words;
  EXPECT_THAT(Told("export qif SN-1 --folder " + folder_), HasSubstr("exporting results, 1 s"));
  EXPECT_THAT(Told("report write inspections/a --out " + folder_ + "/a.pdf"), HasSubstr("writing the report, 1 s"));
  EXPECT_EQ(Told("export qif SN-1 --json --folder " + folder_), "");  // nothing where a program reads
}

TEST_F(Downloads, HoldWhatCame) {
  EXPECT_EQ(Run("section outlines sections/c --out -").out,
            "section,outline,place,x_mm,y_mm,deviation_um,before\n50 %,nominal,0,1.000000,2.000000,,\n");
  EXPECT_EQ(sections_.asked, "sections/c");
  EXPECT_EQ(Run("repair path g --out -").out,
            "lap,allowance_mm,x_mm,y_mm,z_mm,axis_x,axis_y,axis_z\n0,0,1,2,3,0,0,1\n1,0,1,2,3,0,0,1\n");
  EXPECT_EQ(Run("reconstruction lattice e --out " + folder_ + "/lattice").exit_code, kDone);
  EXPECT_EQ(*ReadFile(folder_ + "/lattice", 100), std::string("\0\1\0\1", 4));
  EXPECT_THAT(Run("deviation points b --out -").err, HasSubstr("deviations/b: no cloud was kept with it"));
  EXPECT_THAT(Run("section outlines c --out /nowhere/at/all.csv").err, HasSubstr("--out: /nowhere/at/all.csv, want"));
}

TEST_F(Downloads, BeginAnewWhereTheyBrokeOff) {
  sections_.breaking_off_count = 1;
  const Ended ended = Run("section outlines c --out -");
  EXPECT_EQ(ended.exit_code, kDone) << ended.err;
  EXPECT_EQ(sections_.breaking_off_count, 0);
  EXPECT_EQ(std::count(ended.out.begin(), ended.out.end(), '\n'), 2);
}

TEST_F(Downloads, AnExportWritesNothingOutsideItsFolder) {
  EXPECT_EQ(Run("export qif SN-1 --folder " + folder_).exit_code, kDone);
  EXPECT_EQ(*ReadFile(folder_ + "/SN-1.qif", 100), "one two");
  exports_.file = "../SN-1.qif";
  EXPECT_THAT(Run("export qif SN-1 --folder " + folder_).err, HasSubstr("file: ../SN-1.qif, want a name of letters"));
  EXPECT_FALSE(std::filesystem::exists(folder_ + "/../SN-1.qif"));
}

}  // namespace
}  // namespace sixpoint::cli
