// sixpoint.calibration.v1.StudyService.
#pragma once

#include <memory>

#include "services/calibration/study_inputs.h"
#include "services/runtime/compute_pool.h"
#include "sixpoint/calibration/v1/study.grpc.pb.h"
#include "storage/studies.h"

namespace sixpoint::calibration {

class StudyService final : public v1::StudyService::Service {
 public:
  // One more than kMostRunning at once gets RESOURCE_EXHAUSTED.
  StudyService(std::shared_ptr<storage::StudyStore> store,
               std::shared_ptr<const storage::CalibrationReader> calibrations, std::shared_ptr<grpc::Channel> plant,
               std::shared_ptr<grpc::Channel> ingest);

  grpc::Status RunGaugeStudy(grpc::ServerContext* context, const v1::RunGaugeStudyRequest* request,
                             v1::Study* response) override;
  grpc::Status RunArmStudy(grpc::ServerContext* context, const v1::RunArmStudyRequest* request,
                           v1::Study* response) override;
  grpc::Status RunRepeatStudy(grpc::ServerContext* context, const v1::RunRepeatStudyRequest* request,
                              v1::Study* response) override;
  grpc::Status RunGaugeRr(grpc::ServerContext* context, const v1::RunGaugeRrRequest* request,
                          v1::Study* response) override;
  grpc::Status RunSphereCheck(grpc::ServerContext* context, const v1::RunSphereCheckRequest* request,
                              v1::Study* response) override;
  grpc::Status RunInterimCheck(grpc::ServerContext* context, const v1::RunInterimCheckRequest* request,
                               v1::Study* response) override;
  grpc::Status GetStudy(grpc::ServerContext* context, const v1::GetStudyRequest* request, v1::Study* response) override;
  grpc::Status ListStudies(grpc::ServerContext* context, const v1::ListStudiesRequest* request,
                           v1::ListStudiesResponse* response) override;

 private:
  static constexpr int kMostRunning = 2;

  // Checked, fetched, studied and recorded, once for each request_id.
  template <typename Request>
  grpc::Status Run(grpc::ServerContext* context, const char* call, const Request& request, v1::Study* response);

  const std::shared_ptr<storage::StudyStore> store_;
  const StudyInputFetcher inputs_;
  runtime::ComputePool running_{{kMostRunning, 0}, "studies", errors::v1::STUDIES_FULL};
};

}  // namespace sixpoint::calibration
