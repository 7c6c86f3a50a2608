// sixpoint.registration.v1.RegistrationService.
#pragma once

#include "services/registration/registrar.h"
#include "services/runtime/compute_pool.h"
#include "sixpoint/registration/v1/registration.grpc.pb.h"

namespace sixpoint::registration {

class RegistrationService final : public v1::RegistrationService::Service {
 public:
  RegistrationService(storage::Database* database, const Peers& peers, const RegistrarLimits& limits);

  grpc::Status Register(grpc::ServerContext* context, const v1::RegisterRequest* request,
                        v1::Registration* response) override;
  grpc::Status GetRegistration(grpc::ServerContext* context, const v1::GetRegistrationRequest* request,
                               v1::Registration* response) override;
  grpc::Status ListRegistrations(grpc::ServerContext* context, const v1::ListRegistrationsRequest* request,
                                 v1::ListRegistrationsResponse* response) override;
  // One batch more than kMostBatches at once gets RESOURCE_EXHAUSTED; a batch of one request is counted with Register's calls.
  grpc::Status RegisterBatch(grpc::ServerContext* context, const v1::RegisterBatchRequest* request,
                             grpc::ServerWriter<v1::RegisterBatchResponse>* writer) override;

 private:
  static constexpr int kMostBatches = 4;

  storage::Database* database_;
  Registrar registrar_;
  runtime::ComputePool batches_{{kMostBatches, 0}, "batches", errors::v1::BATCHES_FULL};
};

}  // namespace sixpoint::registration
