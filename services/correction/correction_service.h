// sixpoint.correction.v1.CorrectionService.
#pragma once

#include <memory>

#include "services/correction/correct_blade.h"
#include "services/runtime/compute_pool.h"
#include "sixpoint/correction/v1/correction.grpc.pb.h"
#include "storage/database.h"

namespace sixpoint::correction {

class CorrectionService final : public v1::CorrectionService::Service {
 public:
  // More than greatest_count corrections at once are RESOURCE_EXHAUSTED: each holds a connection of the pool.
  CorrectionService(storage::Database* database, std::unique_ptr<Peers> peers, int greatest_count);

  grpc::Status Correct(grpc::ServerContext* context, const v1::CorrectRequest* request,
                       v1::Correction* response) override;
  grpc::Status GetCorrection(grpc::ServerContext* context, const v1::GetCorrectionRequest* request,
                             v1::Correction* response) override;
  grpc::Status ListCorrections(grpc::ServerContext* context, const v1::ListCorrectionsRequest* request,
                               v1::ListCorrectionsResponse* response) override;

 private:
  storage::Database* const database_;
  const std::unique_ptr<Peers> peers_;
  runtime::ComputePool running_;
};

}  // namespace sixpoint::correction
