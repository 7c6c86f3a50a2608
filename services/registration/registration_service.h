// sixpoint.registration.v1.RegistrationService.
#pragma once

#include <atomic>

#include "services/registration/registrar.h"
#include "sixpoint/registration/v1/registration.grpc.pb.h"

namespace sixpoint::registration {

class RegistrationService final : public v1::RegistrationService::Service {
 public:
  // One registration more than kMostRunning at once gets RESOURCE_EXHAUSTED.
  RegistrationService(storage::Database* database, const Peers& peers, int threads);

  grpc::Status Register(grpc::ServerContext* context, const v1::RegisterRequest* request,
                        v1::Registration* response) override;
  grpc::Status GetRegistration(grpc::ServerContext* context, const v1::GetRegistrationRequest* request,
                               v1::Registration* response) override;
  grpc::Status ListRegistrations(grpc::ServerContext* context, const v1::ListRegistrationsRequest* request,
                                 v1::ListRegistrationsResponse* response) override;

 private:
  static constexpr int kMostRunning = 4;

  storage::Database* database_;
  Registrar registrar_;
  std::atomic<int> running_{0};
};

}  // namespace sixpoint::registration
