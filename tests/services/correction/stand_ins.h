// Stand-ins for the plant, ingest, calibration and registration services, about a block with two holes and their pins. No
// database: handlers on a fake store need nothing else.
#pragma once

#include <absl/status/status.h>

#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "sixpoint/calibration/v1/calibration.grpc.pb.h"
#include "sixpoint/calibration/v1/study.grpc.pb.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"
#include "sixpoint/plant/v1/drawing.grpc.pb.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"
#include "sixpoint/registration/v1/registration.grpc.pb.h"
#include "tests/metrology/inspection/pinned_block.h"
#include "tests/support/in_process_server.h"

namespace sixpoint::testing {

inline constexpr char kSensorCalibration[] = "calibrations/00000000-0000-7000-8000-000000000001";
inline constexpr char kArmStudy[] = "studies/00000000-0000-7000-8000-0000000000a1";
inline constexpr char kRotationCalibration[] = "calibrations/00000000-0000-7000-8000-000000000002";
inline constexpr char kACharacterisation[] = "calibrations/00000000-0000-7000-8000-000000000004";
inline constexpr char kBCharacterisation[] = "calibrations/00000000-0000-7000-8000-000000000005";
inline constexpr char kRegistration[] = "registrations/00000000-0000-7000-8000-000000000003";

class StandInPlant final : public plant::v1::PlantService::Service {
 public:
  plant::v1::Machine machine;
  plant::v1::Part part;
  std::string surface_bytes;
  std::map<std::string, plant::v1::MachiningModel> models;  // by name with @revision; the newest without, too
  grpc::Status GetMachiningModel(grpc::ServerContext*, const plant::v1::GetMachiningModelRequest* request,
                                 plant::v1::MachiningModel* response) override;
  grpc::Status ListMachiningModels(grpc::ServerContext*, const plant::v1::ListMachiningModelsRequest* request,
                                   plant::v1::ListMachiningModelsResponse* response) override;
  // Its first revision: of the part's only group, with a template that goes straight from hole to hole.
  void AddModel();
  grpc::Status GetMachine(grpc::ServerContext*, const plant::v1::GetMachineRequest* request,
                          plant::v1::Machine* response) override;
  grpc::Status GetPart(grpc::ServerContext*, const plant::v1::GetPartRequest* request,
                       plant::v1::Part* response) override;
  grpc::Status DownloadSurface(grpc::ServerContext*, const plant::v1::DownloadSurfaceRequest* request,
                               grpc::ServerWriter<plant::v1::DownloadSurfaceResponse>* writer) override;
};

class StandInDrawings final : public plant::v1::DrawingService::Service {
 public:
  std::map<std::string, plant::v1::Drawing> drawings;  // by name with @revision; the newest without, too
  grpc::Status GetDrawing(grpc::ServerContext*, const plant::v1::GetDrawingRequest* request,
                          plant::v1::Drawing* response) override;
};

class StandInIngest final : public ingest::v1::ScanService::Service {
 public:
  std::map<std::string, ingest::v1::Scan> scans;  // by name
  std::map<std::string, std::string> blocks;      // one Draco block each
  std::set<std::string> deleted;                  // names of scans whose points are no more
  // How often each was downloaded so far, or begun to be.
  std::map<std::string, int> downloads() const;
  grpc::Status GetScan(grpc::ServerContext*, const ingest::v1::GetScanRequest* request,
                       ingest::v1::Scan* response) override;
  grpc::Status DownloadScan(grpc::ServerContext*, const ingest::v1::DownloadScanRequest* request,
                            grpc::ServerWriter<ingest::v1::DownloadScanResponse>* writer) override;
  grpc::Status ListScanBlocks(grpc::ServerContext*, const ingest::v1::ListScanBlocksRequest* request,
                              ingest::v1::ListScanBlocksResponse* response) override;

 private:
  // Whether the scan and its points are there.
  grpc::Status Check(const std::string& name) const;
  mutable std::mutex mutex_;
  std::map<std::string, int> downloads_;
};

class StandInCalibration final : public calibration::v1::CalibrationService::Service {
 public:
  calibration::v1::Calibration sensor, rotation;
  std::map<std::string, calibration::v1::Calibration> axes;  // characterisations by the axis's letter
  bool expired = false;                                      // none in force
  bool axes_over = false;                                    // none of the characterisations is in force any more
  std::int64_t in_force_from_s = 0;                          // of `sensor`
  std::optional<calibration::v1::Calibration> remounted;     // in force from remounted_s on
  std::int64_t remounted_s = 0;
  std::string replacement;  // name of the sensor calibration in force, where it is not `sensor`
  grpc::Status GetCalibration(grpc::ServerContext*, const calibration::v1::GetCalibrationRequest* request,
                              calibration::v1::Calibration* response) override;
  grpc::Status GetCalibrationInForce(grpc::ServerContext*, const calibration::v1::GetCalibrationInForceRequest* request,
                                     calibration::v1::Calibration* response) override;
};

class StandInStudies final : public calibration::v1::StudyService::Service {
 public:
  std::optional<calibration::v1::Study> arm;  // the machine's newest
  std::optional<calibration::v1::Study> interim_check;
  grpc::Status ListStudies(grpc::ServerContext*, const calibration::v1::ListStudiesRequest* request,
                           calibration::v1::ListStudiesResponse* response) override;
};

class StandInRegistration final : public registration::v1::RegistrationService::Service {
 public:
  registration::v1::Registration registration;
  int register_count = 0;
  absl::Status refusal;  // of Register
  std::map<registration::v1::Method, absl::Status> refusal_by_method;
  bool applied_axis_tables = false;  // as the last Register asked
  std::vector<registration::v1::RegisterRequest> asked;
  // What Register answers for these methods, instead of `registration` with the method asked for.
  std::map<registration::v1::Method, registration::v1::Registration> by_method;
  grpc::Status GetRegistration(grpc::ServerContext*, const registration::v1::GetRegistrationRequest* request,
                               registration::v1::Registration* response) override;
  grpc::Status Register(grpc::ServerContext*, const registration::v1::RegisterRequest* request,
                        registration::v1::Registration* response) override;
  std::vector<registration::v1::Registration> later;  // made since, of the machine or of the blade
  grpc::Status ListRegistrations(grpc::ServerContext*, const registration::v1::ListRegistrationsRequest* request,
                                 registration::v1::ListRegistrationsResponse* response) override;
  // The same bits, always.
  grpc::Status ReplayRegistration(grpc::ServerContext*, const registration::v1::ReplayRegistrationRequest* request,
                                  replay::v1::Replay* response) override;
};

class StandIns {
 public:
  // With the pinned block's four scans, of 2000 points of the top each.
  StandIns();
  std::shared_ptr<grpc::Channel> Connect() const { return server_.Connect(); }

  // The axis on the bed (a) or the one that it carries (b) gets a characterisation in force. Errors in degrees, at equal steps
  // over a turn. False where it had one before.
  bool Characterise(bool is_b, const std::vector<double>& forward_error_deg,
                    const std::vector<double>& backward_error_deg, double standard_uncertainty_deg);

  metrology::PinnedBlock block;
  std::vector<std::string> scans;  // names, in order
  StandInPlant plant;
  StandInDrawings drawings;
  StandInIngest ingest;
  StandInCalibration calibration;
  StandInStudies studies;
  StandInRegistration registration;

 private:
  void DescribePlant();
  void DescribeCalibrations();
  void DescribeRegistration();
  void AddScans();
  InProcessServer server_;
};

}  // namespace sixpoint::testing
