// The plant of correction's tests with a blade on the table, and registration's service on it: what a blade is designed as,
// what is scanned of which body, and what the service answers.
#pragma once

#include <absl/status/statusor.h>
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "metrology/surface/surface.h"
#include "services/registration/registration_service.h"
#include "tests/services/correction/judged_plant.h"
#include "tests/support/sanitizer.h"

namespace sixpoint::registration {

// Answers for the newest revision, knows all blades but blades/sn9, counts what is fetched.
class PlantOfBlades final : public plant::v1::PlantService::Service {
 public:
  explicit PlantOfBlades(testing::StandInPlant* plant) : plant_(plant) {}
  std::atomic<int> download_count{0};
  grpc::Status GetBlade(grpc::ServerContext*, const plant::v1::GetBladeRequest* request,
                        plant::v1::Blade* response) override;
  grpc::Status GetPart(grpc::ServerContext*, const plant::v1::GetPartRequest*, plant::v1::Part* response) override;
  grpc::Status GetMachine(grpc::ServerContext*, const plant::v1::GetMachineRequest*,
                          plant::v1::Machine* response) override;
  grpc::Status DownloadSurface(grpc::ServerContext* context, const plant::v1::DownloadSurfaceRequest* request,
                               grpc::ServerWriter<plant::v1::DownloadSurfaceResponse>* writer) override;

 private:
  testing::StandInPlant* plant_;
};

metrology::TriangleMesh TrueBlade();
// Its vertices through a linear map; without corner normals, its outside still outside.
metrology::TriangleMesh Mapped(metrology::TriangleMesh mesh, const Eigen::Matrix3d& map);

inline constexpr double kHoleDiameterMm = 3;  // of the holes of G2
inline constexpr std::size_t kScanPointCount = 20'000;
// Where the datums of the true blade lie; part frame.
const std::vector<Eigen::Vector3d>& NestMm();

class FakePlantTest : public ::testing::Test {
 protected:
  FakePlantTest();
  ~FakePlantTest() override { Stop(); }

  // Anew, where it serves. Scans from where the fakes are, or from `ingest`.
  void Serve(const RegistrationLimits& limits, std::shared_ptr<grpc::Channel> ingest = nullptr);
  void Stop();

  // What the plant takes for the part's CAD; its datums and the holes of G2 lie on it.
  void Design(const metrology::TriangleMesh& mesh);
  // Scans of a body, from every side, of its points that are wanted and as they are changed.
  void Scan(const metrology::TriangleMesh& mesh,
            const std::function<bool(const metrology::SurfacePoint&)>& wanted = nullptr,
            const std::function<Eigen::Vector3d(const metrology::SurfacePoint&)>& changed = nullptr,
            std::uint64_t seed = 31);
  // Points of the part frame, as the scanner sees them, for the scan of one view.
  void ScanPoints(std::size_t view, const metrology::Points& part_mm);

  // Of blades/sn1, from all its scans.
  v1::RegisterRequest Request(v1::Method method) const;
  absl::StatusOr<v1::Registration> TryRegister(const v1::RegisterRequest& request,
                                               double seconds = sixpoint::testing::kPatience * 120) const;
  // Stored, and read back as it was answered.
  v1::Registration Register(const v1::RegisterRequest& request) const;
  // Refused for a field that the answer names by itself, too; nothing stored. "field: value, want wanted".
  std::string RefusalOf(const v1::RegisterRequest& request);
  // A result like any other that has no pose, and nothing that could be taken for one: there, read back, and in its row.
  // Of this outcome; of any but converged where that is unspecified.
  v1::Registration WithoutPose(const v1::RegisterRequest& request, v1::Outcome outcome = v1::OUTCOME_UNSPECIFIED);
  v1::Registration Get(const std::string& name) const;

  std::int64_t Count(const std::string& table);
  Eigen::Isometry3d PoseOf(const v1::Registration& registration) const;
  double ErrorUm(const v1::Registration& registration, const std::vector<Eigen::Vector3d>& places_mm) const;

  testing::JudgedPlant plant_;
  PlantOfBlades blades_;
  testing::InProcessServer plant_server_;
  std::unique_ptr<RegistrationService> service_;
  std::unique_ptr<testing::InProcessServer> server_;
  std::shared_ptr<grpc::Channel> channel_;
};

}  // namespace sixpoint::registration
