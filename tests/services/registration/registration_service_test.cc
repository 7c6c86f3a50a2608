#include "services/registration/registration_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "metrology/cloud/draco_codec.h"
#include "services/clients/scan_blocks.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "storage/blobs.h"
#include "storage/record.h"
#include "tests/metrology/surface/shapes.h"
#include "tests/services/correction/judged_plant.h"

namespace sixpoint::registration {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

// The plant of correction's tests, which also knows its blade and answers for the newest revision.
class PlantWithBlade final : public plant::v1::PlantService::Service {
 public:
  explicit PlantWithBlade(testing::StandInPlant* plant) : plant_(plant) {}
  grpc::Status GetBlade(grpc::ServerContext*, const plant::v1::GetBladeRequest* request,
                        plant::v1::Blade* response) override {
    if (request->name() != "blades/sn1") return {grpc::StatusCode::NOT_FOUND, request->name() + " is not known"};
    response->set_name(request->name());
    response->set_part(plant_->part.name());
    return grpc::Status::OK;
  }
  grpc::Status GetPart(grpc::ServerContext*, const plant::v1::GetPartRequest*, plant::v1::Part* response) override {
    *response = plant_->part;
    return grpc::Status::OK;
  }
  grpc::Status GetMachine(grpc::ServerContext*, const plant::v1::GetMachineRequest*,
                          plant::v1::Machine* response) override {
    *response = plant_->machine;
    return grpc::Status::OK;
  }
  grpc::Status DownloadSurface(grpc::ServerContext* context, const plant::v1::DownloadSurfaceRequest* request,
                               grpc::ServerWriter<plant::v1::DownloadSurfaceResponse>* writer) override {
    return plant_->DownloadSurface(context, request, writer);
  }

 private:
  testing::StandInPlant* plant_;
};

class RegistrationServiceTest : public ::testing::Test {
 protected:
  RegistrationServiceTest() : blades_(&plant_.plant), plant_server_({&blades_}) {
    service_ = std::make_unique<RegistrationService>(plant_.database.database(),
                                                     Peers{plant_server_.Connect(), plant_.Connect(), plant_.Connect()},
                                                     RegistrarLimits());
    server_ = std::make_unique<testing::InProcessServer>(std::vector<grpc::Service*>{service_.get()});
    stub_ = v1::RegistrationService::NewStub(server_->Connect());
  }

  // A blade in place of the block: its surface, six datum points and scans from every side.
  void MountBlade() {
    const metrology::TriangleMesh mesh = metrology::shapes::Blade(120, 60, Eigen::Vector3d::Zero());
    plant_.plant.surface_bytes = metrology::MeshBytes(mesh);
    plant_.plant.part.mutable_surface()->set_surface_sha256(storage::Sha256Hex(plant_.plant.surface_bytes));
    const auto surface = metrology::Surface::Prepare(mesh);
    ASSERT_TRUE(surface.ok());
    for (const Eigen::Vector3d& near :
         {Eigen::Vector3d(-4, 9, -14), Eigen::Vector3d(4, 9, -14), Eigen::Vector3d(0, 9, 14),
          Eigen::Vector3d(-12, 1, -12), Eigen::Vector3d(-9, 1, 12), Eigen::Vector3d(0, 0.5, 24)}) {
      const metrology::SurfacePoint on = (*surface)->Closest(near);
      plant::v1::DatumPoint& datum = *plant_.plant.part.add_six_points();
      datum.set_datum("D" + std::to_string(plant_.plant.part.six_points_size()));
      runtime::ToProto(on.point_mm, datum.mutable_point_in_part_mm());
      datum.mutable_normal_in_part()->set_x(on.normal.x());
      datum.mutable_normal_in_part()->set_y(on.normal.y());
      datum.mutable_normal_in_part()->set_z(on.normal.z());
    }
    std::mt19937_64 random(31);
    std::vector<double> areas;
    for (const auto& t : mesh.triangles)
      areas.push_back((mesh.vertices_mm[t[1]] - mesh.vertices_mm[t[0]])
                          .cross(mesh.vertices_mm[t[2]] - mesh.vertices_mm[t[0]])
                          .norm());
    std::discrete_distribution<std::size_t> pick(areas.begin(), areas.end());
    std::uniform_real_distribution<double> unit(0, 1);
    for (std::size_t view = 0; view < plant_.scans.size(); ++view) {
      metrology::Points points;
      while (points.size() < 20000) {
        const auto& t = mesh.triangles[pick(random)];
        const double r = std::sqrt(unit(random)), s = unit(random);
        points.push_back((*surface)
                             ->Closest((1 - r) * mesh.vertices_mm[t[0]] + r * (1 - s) * mesh.vertices_mm[t[1]] +
                                       r * s * mesh.vertices_mm[t[2]])
                             .point_mm);
      }
      const metrology::LineScan scan = metrology::Scanned(plant_.block, plant_.block.b_deg[view], points, &random);
      const auto encoded = metrology::EncodeBlock(scan.points_mm, metrology::kDefaultErrorBoundMm);
      ASSERT_TRUE(encoded.ok());
      ingest::v1::Scan& record = plant_.ingest.scans.at(plant_.scans[view]);
      runtime::ToProto(scan.v0_mm, record.mutable_header()->mutable_v0_mm());
      record.mutable_header()->set_point_count(static_cast<std::int64_t>(points.size()));
      clients::PayloadsDigest digest;
      digest.Add(encoded->bytes);
      record.set_sha256(digest.ToHex());
      plant_.ingest.blocks.at(plant_.scans[view]) = encoded->bytes;
    }
  }

  v1::RegisterRequest Request(v1::Method method) const {
    v1::RegisterRequest request;
    request.set_blade("blades/sn1");
    for (const std::string& scan : plant_.scans) request.add_scans(scan);
    request.set_method(method);
    request.set_requested_by("operator");
    return request;
  }
  absl::StatusOr<v1::Registration> Register(const v1::RegisterRequest& request) {
    v1::Registration registration;
    const grpc::Status status = stub_->Register(runtime::ContextFor(60).get(), request, &registration);
    if (!status.ok()) return runtime::FromGrpc(status);
    return registration;
  }
  std::int64_t Count(const std::string& table) {
    auto transaction = plant_.database.database()->Begin(std::chrono::system_clock::now() + std::chrono::seconds(10));
    return transaction->Execute("SELECT count(*) FROM " + table)->Int(0, 0);
  }
  double ErrorUm(const v1::Registration& registration) const {
    const auto pose = runtime::FromProto("zero_from_part", registration.zero_from_part());
    EXPECT_TRUE(pose.ok()) << pose.status();
    double worst = 0;
    for (const Eigen::Vector3d& p : {Eigen::Vector3d(12, 0, 20), Eigen::Vector3d(-12, 2, 20),
                                     Eigen::Vector3d(12, 0, -20), Eigen::Vector3d(-12, 2, -20)})
      worst = std::max(worst, 1e3 * (*pose * p - plant_.block.pose.zero_from_part * p).norm());
    return worst;
  }

  testing::JudgedPlant plant_;
  PlantWithBlade blades_;
  testing::InProcessServer plant_server_;
  std::unique_ptr<RegistrationService> service_;
  std::unique_ptr<testing::InProcessServer> server_;
  std::unique_ptr<v1::RegistrationService::Stub> stub_;
};

TEST_F(RegistrationServiceTest, FindsTheBladeAndReadsBackTheSame) {
  MountBlade();
  for (const v1::Method method : {v1::METHOD_BEST_FIT, v1::METHOD_LOCAL, v1::METHOD_SIX_POINT}) {
    const auto registration = Register(Request(method));
    ASSERT_TRUE(registration.ok()) << registration.status();
    ASSERT_EQ(registration->evidence().outcome(), v1::OUTCOME_CONVERGED) << registration->evidence().remark();
    // 80000 points with 2 um along the ray: a tenth of a micrometre; local fits of six points: a few times that.
    EXPECT_LT(ErrorUm(*registration), method == v1::METHOD_SIX_POINT ? 2 : 0.5);
    EXPECT_EQ(registration->method(), method);
    EXPECT_EQ(registration->scans_size(), 4);
    EXPECT_EQ(registration->evidence().datums_size(), method == v1::METHOD_SIX_POINT ? 6 : 0);
    EXPECT_EQ(registration->sensor_calibration(), testing::kSensorCalibration);
    EXPECT_EQ(registration->calibration_sensitivity().values_size(), 84);

    v1::GetRegistrationRequest get;
    get.set_name(registration->name());
    v1::Registration back;
    ASSERT_TRUE(stub_->GetRegistration(runtime::ContextFor(10).get(), get, &back).ok());
    EXPECT_EQ(back.SerializeAsString(), registration->SerializeAsString());
    auto transaction = plant_.database.database()->Begin(std::chrono::system_clock::now() + std::chrono::seconds(10));
    const auto derived = storage::DerivedFrom(*transaction, testing::kRotationCalibration);
    ASSERT_TRUE(derived.ok());
    std::vector<std::string> names;
    for (const storage::JournalEntry& journal : *derived) names.push_back(journal.entry.name);
    EXPECT_THAT(names, Contains(registration->name()));
  }
}

// B reaches 0.05 deg beyond its commands, or 0.04 or 0.06 by its way; the scans were taken where they say plus that.
TEST_F(RegistrationServiceTest, TakesScansAtTheAnglesThatAxesReached) {
  MountBlade();
  const double mean_deg = 0.05, half_reversal_deg = 0.01;
  for (const std::string& scan : plant_.scans) {
    ingest::v1::ScanHeader& header = *plant_.ingest.scans.at(scan).mutable_header();
    header.set_b_deg(header.b_deg() - mean_deg);
  }
  v1::RegisterRequest request = Request(v1::METHOD_SIX_POINT);
  const auto without = Register(request);
  ASSERT_TRUE(without.ok()) << without.status();
  EXPECT_EQ(without->angles_size(), 0);
  EXPECT_GT(ErrorUm(*without), 20);  // 0.05 deg at 30 mm: 26 um

  request.set_apply_axis_tables(true);
  const absl::Status none = Register(request).status();
  EXPECT_EQ(runtime::ReasonOf(none), "AXIS_NOT_CHARACTERISED");
  EXPECT_THAT(std::string(none.message()), HasSubstr("machines/m1, whose axes A and B have no characterisation"));
  plant_.Characterise(true, std::vector<double>(8, mean_deg + half_reversal_deg),
                      std::vector<double>(8, mean_deg - half_reversal_deg), 0.002);
  const auto registration = Register(request);
  ASSERT_TRUE(registration.ok()) << registration.status();
  ASSERT_EQ(registration->evidence().outcome(), v1::OUTCOME_CONVERGED) << registration->evidence().remark();
  EXPECT_LT(ErrorUm(*registration), 2);  // as with axes that reach their commands
  EXPECT_THAT(registration->evidence().remark(), HasSubstr("calibrated without the table of B"));
  ASSERT_EQ(registration->angles_size(), 4);
  for (const v1::ScanAngle& angle : registration->angles()) {
    EXPECT_EQ(angle.axis(), "B");
    EXPECT_EQ(angle.characterisation(), testing::kBCharacterisation);
    EXPECT_NEAR(angle.reached_deg() - angle.commanded_deg(), mean_deg, 1e-9);
    EXPECT_NEAR(angle.half_reversal_deg(), half_reversal_deg, 1e-9);
    EXPECT_EQ(angle.pose_per_rad_size(), 6);
  }
  // The reversal turns all scans alike about B, which lies along X: 0.01 deg, and the scatter's half of 0.002 deg.
  const auto plain = runtime::FromProto("covariance", without->covariance());
  const auto covariance = runtime::FromProto("covariance", registration->covariance());
  ASSERT_TRUE(plain.ok() && covariance.ok());
  const double deg = 3.14159265358979323846 / 180;
  EXPECT_NEAR(std::sqrt(covariance->values(0, 0)) / deg, std::hypot(0.01, 0.001), 0.002);
  EXPECT_LT(std::sqrt(plain->values(0, 0)) / deg, 0.002);

  v1::GetRegistrationRequest get;
  get.set_name(registration->name());
  v1::Registration back;
  ASSERT_TRUE(stub_->GetRegistration(runtime::ContextFor(10).get(), get, &back).ok());
  EXPECT_EQ(back.SerializeAsString(), registration->SerializeAsString());
  auto transaction = plant_.database.database()->Begin(testing::Soon());
  const auto derived = storage::DerivedFrom(*transaction, testing::kBCharacterisation);
  ASSERT_TRUE(derived.ok());
  ASSERT_EQ(derived->size(), 1u);
  EXPECT_EQ(derived->front().entry.name, registration->name());

  plant_.calibration.rotation.add_inputs(testing::kBCharacterisation);
  const auto same = Register(request);
  ASSERT_TRUE(same.ok());
  EXPECT_EQ(same->evidence().remark(), "");
  EXPECT_EQ(same->zero_from_part().SerializeAsString(), registration->zero_from_part().SerializeAsString());
}

// The same machine whose record calls its axes B and C.
TEST_F(RegistrationServiceTest, TakesAnyTwoRotaryAxes) {
  MountBlade();
  plant_.plant.machine.mutable_kinematics()->mutable_part_side(0)->set_axis("B");
  plant_.plant.machine.mutable_kinematics()->mutable_part_side(1)->set_axis("C");
  plant_.calibration.rotation.mutable_rotation()->add_axes("B");
  plant_.calibration.rotation.mutable_rotation()->add_axes("C");
  plant_.Characterise(true, std::vector<double>(8, 0), std::vector<double>(8, 0), 0.001);
  v1::RegisterRequest request = Request(v1::METHOD_BEST_FIT);
  request.set_apply_axis_tables(true);
  const auto registration = Register(request);
  ASSERT_TRUE(registration.ok()) << registration.status();
  EXPECT_LT(ErrorUm(*registration), 0.5);
  ASSERT_EQ(registration->angles_size(), 4);
  EXPECT_EQ(registration->angles(0).axis(), "C");
}

// The block's scans show its flat top only.
TEST_F(RegistrationServiceTest, AnUndeterminedPoseIsKeptWithItsEvidenceAndHasNoPose) {
  const auto registration = Register(Request(v1::METHOD_LOCAL));
  ASSERT_TRUE(registration.ok()) << registration.status();
  EXPECT_EQ(registration->evidence().outcome(), v1::OUTCOME_NOT_DETERMINED) << registration->evidence().remark();
  EXPECT_FALSE(registration->has_zero_from_part());
  EXPECT_FALSE(registration->has_covariance());
  EXPECT_THAT(registration->evidence().remark(), HasSubstr("directions free"));
  EXPECT_EQ(Count("registrations WHERE cardinality(zero_from_part) = 0"),
            Count("registrations WHERE outcome <> 'CONVERGED'"));
}

TEST_F(RegistrationServiceTest, AnswersARetryOnceAndPages) {
  MountBlade();
  const std::int64_t before = Count("registrations");
  v1::RegisterRequest request = Request(v1::METHOD_BEST_FIT);
  request.set_request_id("00000000-0000-7000-8000-0000000000aa");
  const auto first = Register(request), second = Register(request);
  ASSERT_TRUE(first.ok() && second.ok()) << first.status() << second.status();
  EXPECT_EQ(first->SerializeAsString(), second->SerializeAsString());
  EXPECT_EQ(Count("registrations"), before + 1);
  request.set_method(v1::METHOD_LOCAL);
  EXPECT_EQ(Register(request).status().code(), absl::StatusCode::kAlreadyExists);

  // The same inputs again: another registration, the same bits.
  request.clear_request_id();
  request.set_method(v1::METHOD_BEST_FIT);
  const auto again = Register(request);
  ASSERT_TRUE(again.ok());
  EXPECT_NE(again->name(), first->name());
  EXPECT_EQ(again->zero_from_part().SerializeAsString(), first->zero_from_part().SerializeAsString());
  v1::ListRegistrationsRequest list;
  list.set_blade("blades/sn1");
  list.set_page_size(1);
  v1::ListRegistrationsResponse page, next;
  ASSERT_TRUE(stub_->ListRegistrations(runtime::ContextFor(10).get(), list, &page).ok());
  ASSERT_EQ(page.registrations_size(), 1);
  EXPECT_EQ(page.registrations(0).name(), again->name());
  list.set_page_token(page.next_page_token());
  ASSERT_TRUE(stub_->ListRegistrations(runtime::ContextFor(10).get(), list, &next).ok());
  EXPECT_EQ(next.registrations(0).name(), first->name());
}

TEST_F(RegistrationServiceTest, RefusesWhatItCannotRestOnAndStoresNothing) {
  const std::int64_t before = Count("registrations");
  EXPECT_EQ(runtime::ReasonOf(Register(Request(v1::METHOD_SIX_POINT)).status()), "SIX_POINTS_MISSING");
  v1::RegisterRequest unknown = Request(v1::METHOD_BEST_FIT);
  unknown.set_blade("blades/sn9");
  EXPECT_THAT(std::string(Register(unknown).status().message()), HasSubstr("blade: blades/sn9"));
  unknown = Request(v1::METHOD_BEST_FIT);
  unknown.add_scans("scans/none");
  EXPECT_THAT(std::string(Register(unknown).status().message()), HasSubstr("scans[4]: scans/none"));
  plant_.ingest.scans.at(plant_.scans[1]).mutable_header()->set_subject("blades/sn2");
  EXPECT_THAT(std::string(Register(Request(v1::METHOD_BEST_FIT)).status().message()),
              HasSubstr("subject: blades/sn2, want blades/sn1"));
  plant_.ingest.scans.at(plant_.scans[1]).mutable_header()->set_subject("blades/sn1");
  plant_.calibration.expired = true;
  EXPECT_EQ(Register(Request(v1::METHOD_BEST_FIT)).status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(Count("registrations"), before);
  v1::GetRegistrationRequest get;
  get.set_name("registrations/00000000-0000-7000-8000-000000000077");
  v1::Registration none;
  EXPECT_EQ(stub_->GetRegistration(runtime::ContextFor(10).get(), get, &none).error_code(),
            grpc::StatusCode::NOT_FOUND);
}

}  // namespace
}  // namespace sixpoint::registration
