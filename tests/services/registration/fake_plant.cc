#include "tests/services/registration/fake_plant.h"

#include <random>

#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "metrology/cloud/draco_codec.h"
#include "metrology/mesh/mesh_bytes.h"
#include "services/clients/scan_blocks.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "storage/blobs.h"
#include "tests/metrology/mesh/shapes.h"
#include "tests/support/sanitizer.h"

namespace sixpoint::registration {

using Eigen::Vector3d;
using metrology::SurfacePoint;
using metrology::TriangleMesh;

grpc::Status PlantOfBlades::GetBlade(grpc::ServerContext*, const plant::v1::GetBladeRequest* request,
                                     plant::v1::Blade* response) {
  if (request->name() == "blades/sn9") return {grpc::StatusCode::NOT_FOUND, request->name() + " is not known"};
  response->set_name(request->name());
  response->set_part(plant_->part.name());
  return grpc::Status::OK;
}
grpc::Status PlantOfBlades::GetPart(grpc::ServerContext*, const plant::v1::GetPartRequest*, plant::v1::Part* response) {
  *response = plant_->part;
  return grpc::Status::OK;
}
grpc::Status PlantOfBlades::GetMachine(grpc::ServerContext*, const plant::v1::GetMachineRequest*,
                                       plant::v1::Machine* response) {
  *response = plant_->machine;
  return grpc::Status::OK;
}
grpc::Status PlantOfBlades::DownloadSurface(grpc::ServerContext* context,
                                            const plant::v1::DownloadSurfaceRequest* request,
                                            grpc::ServerWriter<plant::v1::DownloadSurfaceResponse>* writer) {
  ++download_count;
  return plant_->DownloadSurface(context, request, writer);
}

TriangleMesh TrueBlade() { return metrology::shapes::Blade(120, 60, Vector3d::Zero()); }

TriangleMesh Mapped(TriangleMesh mesh, const Eigen::Matrix3d& map) {
  for (Vector3d& vertex : mesh.vertices_mm) vertex = map * vertex;
  mesh.corner_normals.clear();
  if (map.determinant() < 0)
    for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  return mesh;
}

const std::vector<Vector3d>& NestMm() {
  static const auto* nest =
      new std::vector<Vector3d>({{-4, 9, -14}, {4, 9, -14}, {0, 9, 14}, {-12, 1, -12}, {-9, 1, 12}, {0, 0.5, 24}});
  return *nest;
}

FakePlantTest::FakePlantTest() : blades_(&plant_.plant), plant_server_({&blades_}) { Serve(RegistrationLimits()); }

void FakePlantTest::Serve(const RegistrationLimits& limits, std::shared_ptr<grpc::Channel> ingest) {
  Stop();
  service_ = std::make_unique<RegistrationService>(
      storage::RegistrationsIn(plant_.database.database()),
      Peers{plant_server_.Connect(), ingest == nullptr ? plant_.Connect() : std::move(ingest), plant_.Connect()},
      limits);
  server_ = std::make_unique<testing::InProcessServer>(std::vector<grpc::Service*>{service_.get()});
  channel_ = server_->Connect();
}

void FakePlantTest::Stop() {
  channel_.reset();
  server_.reset();
  service_.reset();
}

void FakePlantTest::Design(const TriangleMesh& mesh) {
  plant_.plant.surface_bytes = metrology::MeshBytes(mesh);
  plant_.plant.part.mutable_surface()->set_surface_sha256(storage::Sha256Hex(plant_.plant.surface_bytes));
  const auto surface = metrology::Surface::Prepare(mesh);
  ASSERT_TRUE(surface.ok()) << surface.status();
  plant_.plant.part.clear_six_points();
  for (const Vector3d& near : NestMm()) {
    const SurfacePoint on = (*surface)->Closest(near);
    plant::v1::DatumPoint& datum = *plant_.plant.part.add_six_points();
    datum.set_datum("D" + std::to_string(plant_.plant.part.six_points_size()));
    runtime::ToProto(on.point_mm, datum.mutable_point_in_part_mm());
    runtime::ToProto(on.normal, datum.mutable_normal_in_part());
  }
  plant_.plant.part.clear_hole_groups();
  plant::v1::HoleGroup& group = *plant_.plant.part.add_hole_groups();
  group.set_group("G2");
  group.set_diameter_mm(kHoleDiameterMm);
  for (const Vector3d& near : {Vector3d(8, 0, 20), Vector3d(-9, 0, 20), Vector3d(0, 5, 12)})
    runtime::ToProto((*surface)->Closest(near).point_mm, group.add_holes()->mutable_start_in_part_mm());
}

void FakePlantTest::Scan(const TriangleMesh& mesh, const std::function<bool(const SurfacePoint&)>& wanted,
                         const std::function<Vector3d(const SurfacePoint&)>& changed, std::uint64_t seed) {
  const auto surface = metrology::Surface::Prepare(mesh);
  ASSERT_TRUE(surface.ok()) << surface.status();
  std::mt19937_64 random(seed);
  std::vector<double> areas;
  for (const auto& t : mesh.triangles)
    areas.push_back((mesh.vertices_mm[t[1]] - mesh.vertices_mm[t[0]])
                        .cross(mesh.vertices_mm[t[2]] - mesh.vertices_mm[t[0]])
                        .norm());
  std::discrete_distribution<std::size_t> pick(areas.begin(), areas.end());
  std::uniform_real_distribution<double> unit(0, 1);
  for (std::size_t view = 0; view < plant_.scans.size(); ++view) {
    metrology::Points points;
    while (points.size() < kScanPointCount) {
      const auto& t = mesh.triangles[pick(random)];
      const double r = std::sqrt(unit(random)), s = unit(random);
      const SurfacePoint on = (*surface)->Closest(
          (1 - r) * mesh.vertices_mm[t[0]] + r * (1 - s) * mesh.vertices_mm[t[1]] + r * s * mesh.vertices_mm[t[2]]);
      if (wanted && !wanted(on)) continue;
      points.push_back(changed ? changed(on) : on.point_mm);
    }
    ScanPoints(view, points);
  }
}

void FakePlantTest::ScanPoints(std::size_t view, const metrology::Points& part_mm) {
  std::mt19937_64 random(view + 1);
  const metrology::LineScan scan = metrology::Scanned(plant_.block, plant_.block.b_deg[view], part_mm, &random);
  const auto encoded = metrology::EncodeBlock(scan.points_mm, metrology::kDefaultErrorBoundMm);
  ASSERT_TRUE(encoded.ok()) << encoded.status();
  ingest::v1::Scan& record = plant_.ingest.scans.at(plant_.scans[view]);
  runtime::ToProto(scan.v0_mm, record.mutable_header()->mutable_v0_mm());
  record.mutable_header()->set_point_count(static_cast<std::int64_t>(scan.points_mm.size()));
  clients::PayloadsDigest digest;
  digest.Add(encoded->bytes);
  record.set_sha256(digest.ToHex());
  plant_.ingest.blocks.at(plant_.scans[view]) = encoded->bytes;
}

v1::RegisterRequest FakePlantTest::Request(v1::Method method) const {
  v1::RegisterRequest request;
  request.set_blade("blades/sn1");
  for (const std::string& scan : plant_.scans) request.add_scans(scan);
  request.set_method(method);
  return request;
}

absl::StatusOr<v1::Registration> FakePlantTest::TryRegister(const v1::RegisterRequest& request, double seconds) const {
  v1::Registration registration;
  const grpc::Status status =
      v1::RegistrationService::NewStub(channel_)->Register(runtime::ContextFor(seconds).get(), request, &registration);
  if (!status.ok()) return runtime::FromGrpc(status);
  return registration;
}

v1::Registration FakePlantTest::Register(const v1::RegisterRequest& request) const {
  const auto registration = TryRegister(request);
  EXPECT_TRUE(registration.ok()) << registration.status();
  if (!registration.ok()) return {};
  EXPECT_EQ(Get(registration->name()).SerializeAsString(), registration->SerializeAsString());
  return *registration;
}

std::string FakePlantTest::RefusalOf(const v1::RegisterRequest& request) {
  const std::int64_t rows = Count("registrations"), entries = Count("record_entries");
  v1::Registration registration;
  const grpc::Status status = v1::RegistrationService::NewStub(channel_)->Register(
      runtime::ContextFor(sixpoint::testing::kPatience * 120).get(), request, &registration);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT)
      << status.error_message() << registration.ShortDebugString();
  EXPECT_EQ(Count("registrations"), rows);
  EXPECT_EQ(Count("record_entries"), entries);
  google::rpc::Status details;
  google::rpc::BadRequest bad_request;
  EXPECT_TRUE(details.ParseFromString(status.error_details()));
  for (const auto& detail : details.details()) detail.UnpackTo(&bad_request);
  EXPECT_EQ(bad_request.field_violations_size(), 1) << status.error_message();
  for (const auto& violation : bad_request.field_violations())
    EXPECT_EQ(status.error_message().find(violation.field() + ": "), 0u) << status.error_message();
  EXPECT_NE(status.error_message().find(", want "), std::string::npos) << status.error_message();
  return status.error_message();
}

v1::Registration FakePlantTest::WithoutPose(const v1::RegisterRequest& request, v1::Outcome outcome) {
  const v1::Registration registration = Register(request);
  EXPECT_NE(registration.evidence().outcome(), v1::OUTCOME_CONVERGED) << registration.evidence().ShortDebugString();
  if (outcome != v1::OUTCOME_UNSPECIFIED) {
    EXPECT_EQ(registration.evidence().outcome(), outcome) << registration.evidence().ShortDebugString();
  }
  EXPECT_FALSE(registration.has_zero_from_part());
  EXPECT_FALSE(registration.has_covariance());
  EXPECT_FALSE(registration.has_noise_covariance());
  EXPECT_FALSE(registration.has_calibration_sensitivity());
  EXPECT_NE(registration.evidence().remark(), "");
  EXPECT_EQ(Count("registrations WHERE 'registrations/' || registration_id = '" + registration.name() +
                  "' AND cardinality(zero_from_part) = 0"),
            1);
  return registration;
}

v1::Registration FakePlantTest::Get(const std::string& name) const {
  v1::GetRegistrationRequest get;
  get.set_name(name);
  v1::Registration registration;
  const grpc::Status status =
      v1::RegistrationService::NewStub(channel_)->GetRegistration(runtime::ContextFor(10).get(), get, &registration);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return registration;
}

std::int64_t FakePlantTest::Count(const std::string& table) {
  auto transaction = plant_.database.database()->Begin(testing::Soon());
  return transaction->Execute("SELECT count(*) FROM " + table)->Int(0, 0);
}

Eigen::Isometry3d FakePlantTest::PoseOf(const v1::Registration& registration) const {
  const auto pose = runtime::FromProto("zero_from_part", registration.zero_from_part());
  EXPECT_TRUE(pose.ok()) << pose.status() << registration.evidence().ShortDebugString();
  return pose.ok() ? *pose : Eigen::Isometry3d::Identity();
}

double FakePlantTest::ErrorUm(const v1::Registration& registration, const std::vector<Vector3d>& places_mm) const {
  const Eigen::Isometry3d pose = PoseOf(registration);
  double worst = 0;
  for (const Vector3d& p : places_mm)
    worst = std::max(worst, 1e3 * (pose * p - plant_.block.pose.zero_from_part * p).norm());
  return worst;
}

}  // namespace sixpoint::registration
