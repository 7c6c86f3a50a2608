// sixpoint.calibration.v1.CalibrationService.
#pragma once

#include <memory>

#include "services/calibration/inputs.h"
#include "services/runtime/compute_pool.h"
#include "sixpoint/calibration/v1/calibration.grpc.pb.h"
#include "storage/calibration_store.h"

namespace sixpoint::calibration {

class CalibrationService final : public v1::CalibrationService::Service {
 public:
  // threads: compute threads of one sensor calibration. One more than kMostRunning at once gets RESOURCE_EXHAUSTED.
  CalibrationService(std::shared_ptr<storage::CalibrationStore> store,
                     std::shared_ptr<const storage::StudyStore> studies, std::shared_ptr<grpc::Channel> plant,
                     std::shared_ptr<grpc::Channel> ingest, int threads);

  grpc::Status CalibrateSensor(grpc::ServerContext* context, const v1::CalibrateSensorRequest* request,
                               v1::Calibration* response) override;
  grpc::Status StateSensorPose(grpc::ServerContext* context, const v1::StateSensorPoseRequest* request,
                               v1::Calibration* response) override;
  grpc::Status CalibrateRotation(grpc::ServerContext* context, const v1::CalibrateRotationRequest* request,
                                 v1::Calibration* response) override;
  grpc::Status GetCalibration(grpc::ServerContext* context, const v1::GetCalibrationRequest* request,
                              v1::Calibration* response) override;
  grpc::Status GetCalibrationInForce(grpc::ServerContext* context, const v1::GetCalibrationInForceRequest* request,
                                     v1::Calibration* response) override;
  grpc::Status ListCalibrations(grpc::ServerContext* context, const v1::ListCalibrationsRequest* request,
                                v1::ListCalibrationsResponse* response) override;
  grpc::Status CalibrateProbe(grpc::ServerContext* context, const v1::CalibrateProbeRequest* request,
                              v1::Calibration* response) override;
  grpc::Status CharacteriseAxis(grpc::ServerContext* context, const v1::CharacteriseAxisRequest* request,
                                v1::Calibration* response) override;
  grpc::Status ReleaseCalibration(grpc::ServerContext* context, const v1::ReleaseCalibrationRequest* request,
                                  v1::Calibration* response) override;
  grpc::Status WithdrawCalibration(grpc::ServerContext* context, const v1::WithdrawCalibrationRequest* request,
                                   v1::WithdrawCalibrationResponse* response) override;
  grpc::Status GetCalibrationTrend(grpc::ServerContext* context, const v1::GetCalibrationTrendRequest* request,
                                   v1::CalibrationTrend* response) override;

 private:
  static constexpr int kMostRunning = 4;

  // Checked, fetched, computed and recorded, once for each request_id.
  template <typename Request>
  grpc::Status Calibrate(grpc::ServerContext* context, const char* call, const Request& request,
                         v1::Calibration* response);

  const std::shared_ptr<storage::CalibrationStore> store_;
  const InputFetcher inputs_;
  runtime::ComputePool running_{{kMostRunning, 0}, "calibrations", errors::v1::CALIBRATIONS_FULL};
};

}  // namespace sixpoint::calibration
