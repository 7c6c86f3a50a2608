// Command lines against services that only remember.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "cli/app.h"
#include "cli/document.h"
#include "services/runtime/errors.h"
#include "sixpoint/correction/v1/correction.grpc.pb.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"
#include "sixpoint/ingest/v1/store.grpc.pb.h"
#include "sixpoint/plant/v1/fleet.grpc.pb.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"
#include "sixpoint/plant/v1/record.grpc.pb.h"
#include "sixpoint/registration/v1/registration.grpc.pb.h"
#include "tests/cli/command_run.h"
#include "tests/support/in_process_server.h"

namespace sixpoint::cli {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

struct PlantOfTenBlades final : plant::v1::PlantService::Service {
  std::string address;
  std::vector<int> page_sizes;
  grpc::Status ListEndpoints(grpc::ServerContext*, const plant::v1::ListEndpointsRequest*,
                             plant::v1::ListEndpointsResponse* out) override {
    for (const char* area : {"ingest", "registration", "correction"}) {
      auto* endpoint = out->add_endpoints();
      endpoint->set_area(area);
      endpoint->set_address(address);
    }
    return grpc::Status::OK;
  }
  // Ten blades, four a page at most.
  grpc::Status ListBlades(grpc::ServerContext*, const plant::v1::ListBladesRequest* in,
                          plant::v1::ListBladesResponse* out) override {
    page_sizes.push_back(in->page_size());
    const int from = in->page_token().empty() ? 0 : std::stoi(in->page_token());
    const int end = std::min(10, from + (in->page_size() == 0 ? 4 : std::min(4, in->page_size())));
    for (int i = from; i < end; ++i) out->add_blades()->set_name("blades/SN-" + std::to_string(i));
    if (end < 10) out->set_next_page_token(std::to_string(end));
    return grpc::Status::OK;
  }
};

struct FakeStore final : ingest::v1::CloudStoreService::Service {
  std::vector<std::string> deleted;
  grpc::Status DeleteScanPoints(grpc::ServerContext*, const ingest::v1::DeleteScanPointsRequest* in,
                                ingest::v1::DeleteScanPointsResponse* out) override {
    deleted.push_back(in->name());
    out->mutable_deletion()->set_scan(in->name());
    return grpc::Status::OK;
  }
};

struct FakeScans final : ingest::v1::ScanService::Service {
  grpc::Status PreviewScan(grpc::ServerContext*, const ingest::v1::PreviewScanRequest*,
                           ingest::v1::PreviewScanResponse* out) override {
    const float point_mm[] = {1, 2.5, -3};
    out->set_point_count(1);
    out->set_xyz_f32(std::string(reinterpret_cast<const char*>(point_mm), sizeof point_mm));
    out->mutable_scan()->mutable_header()->set_point_count(100);
    return grpc::Status::OK;
  }
};

struct FakeRegistrations final : registration::v1::RegistrationService::Service {
  std::vector<registration::v1::ListRegistrationsRequest> listed;
  std::vector<std::string> got;
  grpc::Status ListRegistrations(grpc::ServerContext*, const registration::v1::ListRegistrationsRequest* in,
                                 registration::v1::ListRegistrationsResponse* out) override {
    listed.push_back(*in);
    auto* one = out->add_registrations();
    one->set_name("registrations/r1");
    one->set_blade("blades/SN-1");
    one->mutable_evidence()->set_outcome(registration::v1::OUTCOME_NOT_CONVERGED);
    return grpc::Status::OK;
  }
  grpc::Status GetRegistration(grpc::ServerContext*, const registration::v1::GetRegistrationRequest* in,
                               registration::v1::Registration* out) override {
    got.push_back(in->name());
    out->set_name(in->name());
    out->mutable_evidence()->set_remark("something to say");
    return grpc::Status::OK;
  }
};

struct FakeCorrections final : correction::v1::CorrectionService::Service {
  bool released = true;
  int count = 0;
  grpc::Status Correct(grpc::ServerContext*, const correction::v1::CorrectRequest*,
                       correction::v1::Correction* out) override {
    ++count;
    out->set_name("corrections/c1");
    out->set_release(released ? correction::v1::RELEASE_AUTOMATIC : correction::v1::RELEASE_AWAITING_PERSON);
    out->set_state(released ? correction::v1::CORRECTION_STATE_RELEASED : correction::v1::CORRECTION_STATE_DRAFT);
    if (released) out->set_nc_program("N10 G0 X1\n");
    correction::v1::ReleaseCheck& check = *out->add_checks();
    check.set_kind(correction::v1::RELEASE_CHECK_KIND_START_UNCERTAINTY);
    check.set_subject("G1/H1");
    check.set_value(released ? 9 : 119);
    check.set_limit(10);
    check.set_passed(released);
    check.set_failed_count(released ? 0 : 3);
    return grpc::Status::OK;
  }
  std::vector<std::string> decided;
  template <typename Request>
  grpc::Status Decided(const char* what, const Request& in, correction::v1::Correction* out) {
    decided.push_back(what + (" " + in.name()) + ": " + in.reason());
    out->set_name(in.name());
    out->set_state(correction::v1::CORRECTION_STATE_RELEASED);
    return grpc::Status::OK;
  }
  grpc::Status ReleaseCorrection(grpc::ServerContext*, const correction::v1::ReleaseCorrectionRequest* in,
                                 correction::v1::Correction* out) override {
    return Decided("release", *in, out);
  }
  grpc::Status RefuseCorrection(grpc::ServerContext*, const correction::v1::RefuseCorrectionRequest* in,
                                correction::v1::Correction* out) override {
    return Decided("refuse", *in, out);
  }
  grpc::Status FetchProgram(grpc::ServerContext*, const correction::v1::FetchProgramRequest* in,
                            correction::v1::FetchProgramResponse* out) override {
    decided.push_back("fetch " + in->name() + " " + in->machine() + " " + in->blade() + " " + in->clamping());
    out->set_name("fetches/f1");
    out->set_correction(in->name());
    out->set_nc_program("N10 G0 X1\n");
    out->set_hole_count(1);
    out->set_cut_count(2);
    return grpc::Status::OK;
  }
  grpc::Status ReportCut(grpc::ServerContext*, const correction::v1::ReportCutRequest* in,
                         correction::v1::Correction* out) override {
    for (const auto& hole : in->holes()) decided.push_back("cut " + hole.group() + " " + hole.hole());
    out->set_name(in->name());
    return grpc::Status::OK;
  }
};

struct FleetOfFive final : plant::v1::FleetService::Service {
  std::vector<int> page_sizes;
  grpc::Status ListMachineStates(grpc::ServerContext*, const plant::v1::ListMachineStatesRequest* in,
                                 plant::v1::ListMachineStatesResponse* out) override {
    page_sizes.push_back(in->page_size());
    for (int i = 0; i < (in->page_size() == 0 ? 5 : std::min(5, in->page_size())); ++i)
      out->add_machines()->set_machine("machines/m" + std::to_string(i));
    return grpc::Status::OK;
  }
};

struct FakeRecord final : plant::v1::RecordService::Service {
  std::vector<plant::v1::RecallRequest> asked;
  grpc::Status Recall(grpc::ServerContext*, const plant::v1::RecallRequest* in,
                      plant::v1::RecallResponse* out) override {
    asked.push_back(*in);
    if (in->name() == "calibrations/unused") return grpc::Status::OK;
    for (const std::string& kind : in->kinds())
      if (kind == "registrations")
        return runtime::ToGrpc(runtime::Refuse("kinds[0]", kind, "one of inspection, registration"));
    auto* entry = out->add_entries();
    entry->set_kind("registration");
    entry->set_name("registrations/r1");
    entry->set_record_sequence(7);
    return grpc::Status::OK;
  }
};

class CommandsTest : public ::testing::Test {
 protected:
  CommandsTest() : server_({&plant_, &store_, &scans_, &registrations_, &corrections_, &record_, &fleet_}) {
    plant_.address = server_.address();
    folder_ = std::filesystem::path(::testing::TempDir()) / "sixpoint_commands_test";
    std::filesystem::create_directories(folder_);
  }
  ~CommandsTest() override { std::filesystem::remove_all(folder_); }

  static void WithoutTls(Session* session) { session->credentials = grpc::InsecureChannelCredentials(); }
  Ended Run(const std::string& words) const { return RunCommand(words + " --server " + server_.address(), WithoutTls); }
  std::string Template() const {
    const std::string file = (folder_ / "template.nc").string();
    std::ofstream(file) << "%\n";
    return file;
  }

  PlantOfTenBlades plant_;
  FakeStore store_;
  FakeScans scans_;
  FakeRegistrations registrations_;
  FakeCorrections corrections_;
  FakeRecord record_;
  FleetOfFive fleet_;
  testing::InProcessServer server_;
  std::filesystem::path folder_;
};

TEST_F(CommandsTest, ListsAllOrNoMoreThanTheLimit) {
  EXPECT_EQ(Run("blade list --json").json().size(), 10u);
  plant_.page_sizes.clear();
  EXPECT_EQ(Run("blade list --json --limit 6").json().size(), 6u);
  EXPECT_THAT(plant_.page_sizes, ElementsAre(6, 2));  // no more is asked for than is shown
  EXPECT_THAT(Run("blade list --limit 2").out, AllOf(HasSubstr("SN-1"), Not(HasSubstr("SN-2"))));
  EXPECT_EQ(Run("fleet list --json").json().size(), 5u);
  EXPECT_THAT(Run("fleet list --limit 2").out, AllOf(HasSubstr("m1"), Not(HasSubstr("m2"))));
  EXPECT_THAT(fleet_.page_sizes, ElementsAre(0, 2));
}

TEST_F(CommandsTest, TakesAScanByItsIdOrItsName) {
  EXPECT_EQ(Run("scan delete-points s1 --reason x").exit_code, kDone);
  EXPECT_EQ(Run("scan delete-points scans/s1 --reason x").exit_code, kDone);
  EXPECT_THAT(store_.deleted, ElementsAre("scans/s1", "scans/s1"));
}

TEST_F(CommandsTest, PrintsZerosAndPlainIntegers) {
  const nlohmann::json answer = Run("scan delete-points s1 --reason x --json").json();
  EXPECT_EQ(answer["freed_bytes"].dump(), "0");
  EXPECT_EQ(answer["already_deleted"], false);
}

TEST_F(CommandsTest, ShowsRegistrations) {
  const Ended list = Run("registration list --blade SN-1 --only-disagreeing --without-for-inspection");
  EXPECT_EQ(list.exit_code, kDone);  // shown is done, whatever is shown
  EXPECT_THAT(list.out, HasSubstr("NOT_CONVERGED"));
  ASSERT_EQ(registrations_.listed.size(), 1u);
  EXPECT_EQ(registrations_.listed[0].blade(), "blades/SN-1");
  EXPECT_TRUE(registrations_.listed[0].only_disagreeing());
  EXPECT_TRUE(registrations_.listed[0].without_for_inspection());
  EXPECT_THAT(Run("registration show r1").out, HasSubstr("remark: something to say"));
  Run("registration show registrations/r1");
  EXPECT_THAT(registrations_.got, ElementsAre("registrations/r1", "registrations/r1"));
}

// Every filter that the contract has is an option.
TEST_F(CommandsTest, ListsWhatIsAskedFor) {
  EXPECT_EQ(Run("registration list --machine m1 --part parts/p1 --calibration c1 --outcome NOT-CONVERGED "
                "--since 2026-11-21 --until 2026-11-22T01:00:00Z")
                .exit_code,
            kDone);
  ASSERT_EQ(registrations_.listed.size(), 1u);
  const registration::v1::ListRegistrationsRequest& asked = registrations_.listed[0];
  EXPECT_EQ(asked.machine(), "machines/m1");
  EXPECT_EQ(asked.part(), "parts/p1");
  EXPECT_EQ(asked.calibration(), "calibrations/c1");
  EXPECT_EQ(asked.outcome(), registration::v1::OUTCOME_NOT_CONVERGED);
  EXPECT_EQ(asked.recorded().until().seconds() - asked.recorded().from().seconds(), 25 * 3600);
  Run("registration list --since 2026-11-21");
  EXPECT_FALSE(registrations_.listed[1].recorded().has_until());
  Run("registration list");
  EXPECT_FALSE(registrations_.listed[2].has_recorded());
  EXPECT_THAT(Run("registration list --since yesterday").err, HasSubstr("--since: yesterday"));
  EXPECT_THAT(Run("registration list --outcome perhaps").err, HasSubstr("--outcome: perhaps not in"));
}

TEST_F(CommandsTest, SeedsAPlantOfThisComputerAlone) {
  EXPECT_THAT(Run("seed --data /var/empty-of-plants").err, HasSubstr("want a folder made by `sixpoint up`"));
  EXPECT_THAT(Run("seed --machines 4").err, HasSubstr("--machines: Value 4 not in range"));
  EXPECT_THAT(Run("seed --full --blades 10").err, HasSubstr("excludes"));
}

TEST_F(CommandsTest, RecallsWhatRestsOnAThing) {
  EXPECT_THAT(Run("recall calibrations/c1 --kinds registration,correction --limit 5").out,
              HasSubstr("registrations/r1"));
  ASSERT_EQ(record_.asked.size(), 1u);
  EXPECT_EQ(record_.asked[0].name(), "calibrations/c1");
  EXPECT_THAT(record_.asked[0].kinds(), ElementsAre("registration", "correction"));
  EXPECT_EQ(record_.asked[0].page_size(), 5);
  EXPECT_EQ(Run("recall calibrations/c1 --json").json()[0]["record_sequence"].dump(), "7");
  EXPECT_EQ(Run("recall calibrations/unused").out, "nothing rests on calibrations/unused\n");
  EXPECT_EQ(Run("recall calibrations/unused --json").json(), nlohmann::json::array());
  EXPECT_THAT(Run("recall c1").err, HasSubstr("NAME: c1, want a name with its collection"));
  Run("recall sensors/LJ-1 --since 2026-11-21 --until 2026-11-22");
  EXPECT_EQ(record_.asked.back().name(), "sensors/LJ-1");
  EXPECT_EQ(record_.asked.back().recorded().until().seconds() - record_.asked.back().recorded().from().seconds(),
            86400);
  Run("recall --since 2026-11-21");
  EXPECT_EQ(record_.asked.back().name(), "");
  EXPECT_TRUE(record_.asked.back().recorded().has_from());
  EXPECT_THAT(Run("recall").err, HasSubstr("want a name with its collection"));
  // A kind that the plant does not know: not the same as nothing that rests on it.
  const Ended unknown = Run("recall calibrations/c1 --kinds registrations");
  EXPECT_EQ(unknown.exit_code, kFailed);
  EXPECT_EQ(unknown.out, "");
  EXPECT_THAT(unknown.err, HasSubstr("kinds[0]: registrations, want one of inspection, registration\nnext: correct"));
}

TEST_F(CommandsTest, CallsAnyMethod) {
  EXPECT_EQ(Run("call ScanService/PreviewScan").json()["point_count"], 1);
  EXPECT_EQ(Run("call sixpoint.plant.v1.RecordService/Recall").json()["entries"].size(), 1u);
  EXPECT_THAT(Run("call Nothing/AtAll").err, HasSubstr("PlantService, DrawingService, RecordService, EventService, "
                                                       "FleetService, LedgerService, WebhookService, ScanService"));
}

TEST_F(CommandsTest, WritesAFileOrStandardOutput) {
  const std::string program = (folder_ / "program.nc").string();
  const std::string correct = "correct --registration r1 --template " + Template() + " --out ";
  const Ended to_file = Run(correct + program);
  EXPECT_EQ(to_file.exit_code, kDone);
  EXPECT_THAT(to_file.out, HasSubstr("program written to " + program));
  EXPECT_EQ(*ReadFile(program, 1000), "N10 G0 X1\n");
  const Ended to_stdout = Run(correct + "-");
  EXPECT_EQ(to_stdout.out, "N10 G0 X1\n");  // the program alone
  EXPECT_THAT(to_stdout.err, HasSubstr("corrections/c1"));
  EXPECT_EQ(Run("scan preview s1 --out -").out, "1 2.5 -3\n");
}

// Before anything is stored.
TEST_F(CommandsTest, RefusesAnOutThatCannotBeWritten) {
  const std::string correct = "correct --registration r1 --template " + Template() + " --out ";
  EXPECT_EQ(Run(correct + "/nowhere/at/all.nc").exit_code, kFailed);
  EXPECT_EQ(Run(correct + "- --json").exit_code, kFailed);
  EXPECT_EQ(corrections_.count, 0);
  EXPECT_EQ(Run("scan preview s1 --out cloud.obj").exit_code, kFailed);
}

TEST_F(CommandsTest, WritesNoProgramThatWaitsForAPerson) {
  corrections_.released = false;
  const Ended ended = Run("correct --registration r1 --template " + Template() + " --out -");
  EXPECT_EQ(ended.exit_code, kNotUsable);
  EXPECT_EQ(ended.out, "");
}

TEST_F(CommandsTest, SaysWhatSpeaksAgainstAProgram) {
  corrections_.released = false;
  const Ended ended = Run("correct --registration r1 --template " + Template() + " --dry-run");
  EXPECT_EQ(ended.exit_code, kNotUsable);
  EXPECT_THAT(ended.out, ::testing::ContainsRegex("start-uncertainty +G1/H1 +119 +10 +NO, 3"));
}

TEST_F(CommandsTest, APersonDecidesAndAMachineFetchesAndReports) {
  EXPECT_THAT(Run("correction release c1").err, HasSubstr("--reason"));  // why
  EXPECT_EQ(Run("correction release c1 --reason seen").exit_code, kDone);
  EXPECT_EQ(Run("correction refuse corrections/c1 --reason foil").exit_code, kDone);
  const Ended fetched = Run("correction fetch c1 --machine m1 --blade SN-1 --clamping 7 --folder " + folder_.string());
  EXPECT_EQ(fetched.exit_code, kDone) << fetched.err;
  EXPECT_THAT(fetched.out, AllOf(HasSubstr("fetches/f1: program of corrections/c1, 1 holes, 2 cut before and left out"),
                                 HasSubstr("program written to " + (folder_ / "SN-1.nc").string())));
  EXPECT_EQ(*ReadFile((folder_ / "SN-1.nc").string(), 1000), "N10 G0 X1\n");
  EXPECT_EQ(Run("correction cut c1 --holes G1/H1,G2/H3").exit_code, kDone);
  EXPECT_EQ(Run("correction cut c1 --holes H1").exit_code, kFailed);
  EXPECT_THAT(corrections_.decided,
              ElementsAre("release corrections/c1: seen", "refuse corrections/c1: foil",
                          "fetch corrections/c1 machines/m1 blades/SN-1 7", "cut G1 H1", "cut G2 H3"));
}

TEST_F(CommandsTest, IsNotDoneWhereItsOutputIsLost) {
  Session session;
  WithoutTls(&session);
  CommandLine line;
  AddCommands(line.root(), &session);
  ASSERT_EQ(line.Parse("blade list --server " + server_.address()), "");
  std::ofstream full("/dev/full");
  std::streambuf* const before = std::cout.rdbuf(full.rdbuf());
  const int exit_code = session.Run();
  std::cout.rdbuf(before);
  std::cout.clear();
  EXPECT_EQ(exit_code, kFailed);
}

}  // namespace
}  // namespace sixpoint::cli
