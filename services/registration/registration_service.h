// sixpoint.registration.v1.RegistrationService.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>

#include "services/registration/inputs.h"
#include "services/runtime/compute_pool.h"
#include "services/runtime/recorded_call.h"
#include "sixpoint/registration/v1/registration.grpc.pb.h"
#include "storage/registrations.h"

namespace sixpoint::registration {

struct RegistrationLimits {
  int threads = 2;           // of one registration
  runtime::PoolLimits pool;  // registrations at once, with all that they hold in memory
  FetcherMemory memory;
};

class RegistrationService final : public v1::RegistrationService::Service {
 public:
  RegistrationService(std::shared_ptr<storage::RegistrationStore> store, const Peers& peers,
                      const RegistrationLimits& limits);

  // The same request_id again gives the same answer, without waiting for a turn. RESOURCE_EXHAUSTED (REGISTRATIONS_FULL)
  // where too many wait.
  grpc::Status Register(grpc::ServerContext* context, const v1::RegisterRequest* request,
                        v1::Registration* response) override;
  grpc::Status GetRegistration(grpc::ServerContext* context, const v1::GetRegistrationRequest* request,
                               v1::Registration* response) override;
  grpc::Status ListRegistrations(grpc::ServerContext* context, const v1::ListRegistrationsRequest* request,
                                 v1::ListRegistrationsResponse* response) override;
  // In a turn as Register has.
  grpc::Status ReplayRegistration(grpc::ServerContext* context, const v1::ReplayRegistrationRequest* request,
                                  replay::v1::Replay* response) override;
  // One batch more than kMostBatches at once gets RESOURCE_EXHAUSTED; a batch of one request is counted with Register's calls.
  grpc::Status RegisterBatch(grpc::ServerContext* context, const v1::RegisterBatchRequest* request,
                             grpc::ServerWriter<v1::RegisterBatchResponse>* writer) override;

  // Shared with the service that plans measurements.
  const InputFetcher& inputs() const { return inputs_; }
  runtime::ComputePool* pool() { return &pool_; }

 private:
  static constexpr int kMostBatches = 4;

  absl::StatusOr<v1::Registration> RegisterOnce(const v1::RegisterRequest& request, const Caller& caller);
  absl::StatusOr<runtime::Made<storage::RegistrationRow>> Make(const v1::RegisterRequest& request,
                                                               const Caller& caller);
  absl::StatusOr<v1::Registration> MakeAgain(const v1::Registration& recorded, const Caller& caller);
  // In its turn, from what is fetched then.
  absl::StatusOr<runtime::Made<storage::RegistrationRow>> MakeFrom(
      const v1::RegisterRequest& request, const Caller& caller, const std::function<absl::StatusOr<Inputs>()>& fetch);

  const std::shared_ptr<storage::RegistrationStore> store_;
  const InputFetcher inputs_;
  runtime::ComputePool pool_;
  runtime::ComputePool batches_{{kMostBatches, 0}, "batches", errors::v1::BATCHES_FULL};
};

}  // namespace sixpoint::registration
