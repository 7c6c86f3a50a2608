// The whole run against services that only remember: what is asked of them, in which order, and what comes of a failure.
#include "cli/plant_run/plant_run.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <set>

#include "cli/cloud_files.h"
#include "cli/output.h"
#include "cli/scan_transfer.h"
#include "sixpoint/calibration/v1/calibration.grpc.pb.h"
#include "sixpoint/correction/v1/correction.grpc.pb.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"
#include "sixpoint/inspection/v1/inspection.grpc.pb.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"
#include "sixpoint/registration/v1/registration.grpc.pb.h"
#include "tests/cli/small_dataset.h"
#include "tests/support/fake_scan_service.h"
#include "tests/support/in_process_server.h"

namespace sixpoint::cli {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

struct RecordingPlant final : plant::v1::PlantService::Service {
  std::string address;
  std::vector<std::string> created;

  grpc::Status ListEndpoints(grpc::ServerContext*, const plant::v1::ListEndpointsRequest*,
                             plant::v1::ListEndpointsResponse* out) override {
    for (const char* area : {"ingest", "calibration", "registration", "correction", "inspection"}) {
      auto* endpoint = out->add_endpoints();
      endpoint->set_area(area);
      endpoint->set_address(address);
    }
    return grpc::Status::OK;
  }
  grpc::Status CreateMachine(grpc::ServerContext*, const plant::v1::CreateMachineRequest* in,
                             plant::v1::Machine* out) override {
    *out = in->machine();
    out->set_name("machines/" + in->machine_id());
    created.push_back(out->name());
    return grpc::Status::OK;
  }
  grpc::Status CreateArtefact(grpc::ServerContext*, const plant::v1::CreateArtefactRequest* in,
                              plant::v1::Artefact* out) override {
    out->set_name("artefacts/" + in->artefact_id());
    created.push_back(out->name());
    return grpc::Status::OK;
  }
  grpc::Status CreatePart(grpc::ServerContext*, const plant::v1::CreatePartRequest* in, plant::v1::Part* out) override {
    out->set_name("parts/" + in->part_id());
    created.push_back(out->name() + " with " + in->cad());
    return grpc::Status::OK;
  }
  grpc::Status CreateBlade(grpc::ServerContext*, const plant::v1::CreateBladeRequest* in,
                           plant::v1::Blade* out) override {
    out->set_name("blades/" + in->serial());
    created.push_back(out->name() + " of " + in->part());
    return grpc::Status::OK;
  }
};

struct FakeCalibration final : calibration::v1::CalibrationService::Service {
  std::vector<std::string> sensor_scans;
  int held_out_count = 0;
  bool fail_sensor = false;
  grpc::Status CalibrateSensor(grpc::ServerContext*, const calibration::v1::CalibrateSensorRequest* in,
                               calibration::v1::Calibration* out) override {
    sensor_scans = {in->scans().begin(), in->scans().end()};
    if (fail_sensor) return {grpc::StatusCode::FAILED_PRECONDITION, "cone C2 not found"};
    out->mutable_sensor();
    return grpc::Status::OK;
  }
  grpc::Status CalibrateRotation(grpc::ServerContext*, const calibration::v1::CalibrateRotationRequest* in,
                                 calibration::v1::Calibration* out) override {
    for (const auto& pose : in->poses()) held_out_count += pose.held_out();
    out->mutable_rotation();
    return grpc::Status::OK;
  }
};

struct RecordingRegistration final : registration::v1::RegistrationService::Service {
  std::mutex mutex;
  std::multiset<std::string> asked;  // "blades/SN-7 METHOD_LOCAL scans/a"
  registration::v1::Method not_determined = registration::v1::METHOD_UNSPECIFIED;
  grpc::Status Register(grpc::ServerContext*, const registration::v1::RegisterRequest* in,
                        registration::v1::Registration* out) override {
    std::lock_guard<std::mutex> lock(mutex);
    std::string scans;
    for (const std::string& scan : in->scans()) scans += " " + scan;
    asked.insert(in->blade() + " " + Method_Name(in->method()) + scans);
    out->set_name("registrations/" + Method_Name(in->method()));
    const bool determined = in->method() != not_determined;
    out->mutable_evidence()->set_outcome(determined ? registration::v1::OUTCOME_CONVERGED
                                                    : registration::v1::OUTCOME_NOT_DETERMINED);
    return grpc::Status::OK;
  }
};

struct FakeCorrection final : correction::v1::CorrectionService::Service {
  std::mutex mutex;
  std::multiset<std::string> asked;
  grpc::Status Correct(grpc::ServerContext*, const correction::v1::CorrectRequest* in,
                       correction::v1::Correction* out) override {
    std::lock_guard<std::mutex> lock(mutex);
    asked.insert(in->registration());
    out->add_groups()->set_group("G1");
    return grpc::Status::OK;
  }
};

struct FakeInspection final : inspection::v1::InspectionService::Service {
  std::vector<std::string> asked;
  grpc::Status Inspect(grpc::ServerContext*, const inspection::v1::InspectRequest* in,
                       inspection::v1::Inspection*) override {
    asked.push_back(in->blade());
    return grpc::Status::OK;
  }
};

class PlantRunTest : public ::testing::Test {
 protected:
  PlantRunTest()
      : folder_(std::filesystem::path(::testing::TempDir()) /
                ("sixpoint_plant_run_" + std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()))),
        server_({&plant_, &ingest_, &calibration_, &registration_, &correction_, &inspection_}) {
    plant_.address = server_.address();
    session_.server = server_.address();
    session_.credentials = grpc::InsecureChannelCredentials();
    session_.json = true;
    std::filesystem::create_directories(folder_);
    std::ofstream(folder_ / "cad.step") << "the CAD";
    std::ofstream(folder_ / "artefact_1.xyz") << "0 1 2\n0 2 2\n0.05 1 2\n0.05 2 2\n";
    std::ofstream(folder_ / "sn7_b000.xyz") << "0 1 3\n0 2 3\n0.2 1 3\n0.2 2 3\n";
  }
  ~PlantRunTest() override { std::filesystem::remove_all(folder_); }

  // The airfoil scan again, as another kind.
  void AddScan(const std::string& id, const std::string& kind) {
    nlohmann::json scan = json_["scans"][1];
    scan["id"] = id;
    scan["kind"] = kind;
    json_["scans"].push_back(scan);
  }
  absl::StatusOr<PlantRunResult> Run() {
    absl::StatusOr<Dataset> dataset = ParseDataset(json_);
    if (!dataset.ok()) return dataset.status();
    return RunPlant(&session_, folder_.string(), *dataset);
  }

  std::filesystem::path folder_;
  nlohmann::json json_ = SmallDataset();
  RecordingPlant plant_;
  sixpoint::testing::FakeScanService ingest_;
  FakeCalibration calibration_;
  RecordingRegistration registration_;
  FakeCorrection correction_;
  FakeInspection inspection_;
  sixpoint::testing::InProcessServer server_;
  Session session_;
};

TEST_F(PlantRunTest, DoesEveryStepOfTheIssue) {
  AddScan("sn7_local", "local");
  AddScan("sn7_pins", "pins");
  const auto result = Run();
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_THAT(result->failures, IsEmpty());
  EXPECT_THAT(plant_.created,
              ElementsAre("machines/m-1", "artefacts/plate", "parts/vane with the CAD", "blades/SN-7 of parts/vane"));
  EXPECT_EQ(ingest_.complete_scan_count(), 4u);
  EXPECT_THAT(calibration_.sensor_scans, ElementsAre("scans/artefact_1"));
  EXPECT_EQ(calibration_.held_out_count, 1);
  EXPECT_THAT(registration_.asked, UnorderedElementsAre("blades/SN-7 METHOD_SIX_POINT scans/sn7_b000",
                                                        "blades/SN-7 METHOD_BEST_FIT scans/sn7_b000",
                                                        "blades/SN-7 METHOD_LOCAL scans/sn7_local"));
  EXPECT_EQ(correction_.asked.size(), 3u);
  EXPECT_THAT(inspection_.asked, ElementsAre("blades/SN-7"));
  std::vector<std::string> methods;
  for (const auto& entry : result->corrections) methods.push_back(entry.method);
  EXPECT_THAT(methods, ElementsAre("six-point", "airfoil", "local"));
  EXPECT_EQ(result->point_count, 16);
}

TEST_F(PlantRunTest, TheSameAgainStoresNothingTwice) {
  ASSERT_TRUE(Run().ok());
  const auto again = Run();
  ASSERT_TRUE(again.ok());
  EXPECT_THAT(again->failures, IsEmpty());
  EXPECT_EQ(again->already_stored_count, 2);
  EXPECT_EQ(ingest_.complete_scan_count(), 2u);
}

TEST_F(PlantRunTest, AScanIdThatIsTakenGetsTheMachinesName) {
  ASSERT_TRUE(Run().ok());
  std::ofstream(folder_ / "artefact_1.xyz") << "0 1 2.5\n0 2 2.5\n0.05 1 2.5\n0.05 2 2.5\n";
  for (int run = 0; run < 2; ++run) {
    const auto other = Run();
    ASSERT_TRUE(other.ok());
    EXPECT_THAT(other->failures, IsEmpty());
    EXPECT_EQ(ingest_.complete_scan_count(), 3u);
    EXPECT_THAT(calibration_.sensor_scans, ElementsAre("scans/m-1.artefact_1"));
  }
}

TEST_F(PlantRunTest, AServiceThatRestartsIsWaitedFor) {
  const grpc::Status away(grpc::StatusCode::UNAVAILABLE, "restarting");
  for (int i = 0; i < 2; ++i) ingest_.Script({away, 0, false});
  const auto result = Run();
  ASSERT_TRUE(result.ok());
  EXPECT_THAT(result->failures, IsEmpty());
  EXPECT_EQ(ingest_.complete_scan_count(), 2u);
}

TEST_F(PlantRunTest, AFailedScanHoldsBackOnlyWhatNeedsIt) {
  AddScan("sn7_local", "local");
  ingest_.refused_scan = "sn7_local";
  const auto result = Run();
  ASSERT_TRUE(result.ok());
  ASSERT_EQ(result->failures.size(), 2u);
  EXPECT_EQ(result->failures[0].step, "ingest");
  EXPECT_THAT(result->failures[0].message, HasSubstr("outside the sensor's range"));
  EXPECT_EQ(result->failures[1].step, "registration");
  EXPECT_THAT(result->failures[1].message, HasSubstr("sn7_local is not stored"));
  EXPECT_EQ(result->registrations.size(), 2u);
  EXPECT_EQ(result->corrections.size(), 2u);
}

TEST_F(PlantRunTest, AFitThatIsNotDeterminedIsAFailureAndNotCorrected) {
  registration_.not_determined = registration::v1::METHOD_SIX_POINT;
  const auto result = Run();
  ASSERT_TRUE(result.ok());
  ASSERT_EQ(result->failures.size(), 1u);
  EXPECT_EQ(result->failures[0].outcome, "NOT_DETERMINED");
  EXPECT_THAT(correction_.asked, ElementsAre("registrations/METHOD_BEST_FIT"));
}

TEST_F(PlantRunTest, WithoutItsCalibrationNothingIsPositioned) {
  calibration_.fail_sensor = true;
  const auto result = Run();
  ASSERT_TRUE(result.ok());
  ASSERT_EQ(result->failures.size(), 1u);
  EXPECT_EQ(result->failures[0].message, "cone C2 not found");
  EXPECT_THAT(registration_.asked, IsEmpty());
}

TEST_F(PlantRunTest, AFileThatHoldsOtherCountsIsNotSent) {
  std::ofstream(folder_ / "sn7_b000.xyz") << "0 1 3\n";
  const auto result = Run();
  ASSERT_TRUE(result.ok());
  ASSERT_FALSE(result->failures.empty());
  EXPECT_EQ(result->failures[0].message, "sn7_b000.xyz: 1 points, want 4 as dataset.json says");
  EXPECT_EQ(ingest_.complete_scan_count(), 1u);
}

TEST_F(PlantRunTest, WhatWasSentComesBackWithinTheProvenError) {
  ASSERT_TRUE(Run().ok());
  const auto downloaded = DownloadScan(&session_, "scans/sn7_b000");
  ASSERT_TRUE(downloaded.ok()) << downloaded.status();
  const auto sent = ReadCloud((folder_ / "sn7_b000.xyz").string());
  ASSERT_TRUE(sent.ok());
  const metrology::Points& came = downloaded->scan.points_mm;
  ASSERT_EQ(came.size(), sent->size());
  for (std::size_t i = 0; i < sent->size(); ++i)
    EXPECT_LE((came[i] - (*sent)[i]).cwiseAbs().maxCoeff(), downloaded->record.proven_error_um() * 1e-3 + 1e-12);
}

TEST_F(PlantRunTest, SomeProfilesComeAlone) {
  ASSERT_TRUE(Run().ok());
  const auto second = DownloadScan(&session_, "scans/sn7_b000", clients::ProfileRange{1, 1});
  ASSERT_TRUE(second.ok()) << second.status();
  EXPECT_THAT(second->scan.points_mm, ElementsAre(Eigen::Vector3d(0.2, 1, 3), Eigen::Vector3d(0.2, 2, 3)));
}

TEST_F(PlantRunTest, NoPlantIsSaidToBeUnreachable) {
  Session session;
  session.credentials = grpc::InsecureChannelCredentials();
  session.server = "127.0.0.1:1";
  session.deadline_s = 1;
  plant::v1::ListEndpointsResponse endpoints;
  const absl::Status status = session.Call<plant::v1::PlantService>(
      "plant", &plant::v1::PlantService::Stub::ListEndpoints, plant::v1::ListEndpointsRequest(), &endpoints);
  EXPECT_FALSE(status.ok());
  EXPECT_THAT(NextStep(absl::UnavailableError("x"), session.server), HasSubstr("127.0.0.1:1"));
}

}  // namespace
}  // namespace sixpoint::cli
