// The registration service, as others ask it.
#pragma once

#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include <memory>
#include <string>

#include "sixpoint/registration/v1/registration.pb.h"

namespace sixpoint::clients {

// Thread-safe. Statuses are the service's.
class RegistrationClient {
 public:
  explicit RegistrationClient(const std::shared_ptr<grpc::Channel>& registration);
  ~RegistrationClient();
  absl::StatusOr<registration::v1::Registration> Get(const std::string& name,
                                                     std::unique_ptr<grpc::ClientContext> context) const;
  absl::StatusOr<registration::v1::ListRegistrationsResponse> List(
      const registration::v1::ListRegistrationsRequest& request, std::unique_ptr<grpc::ClientContext> context) const;
  absl::StatusOr<registration::v1::Registration> Register(const registration::v1::RegisterRequest& request,
                                                          std::unique_ptr<grpc::ClientContext> context) const;
  absl::StatusOr<replay::v1::Replay> Replay(const std::string& name,
                                            std::unique_ptr<grpc::ClientContext> context) const;

 private:
  struct Stubs;  // as CalibrationClient's
  std::unique_ptr<const Stubs> stubs_;
};

}  // namespace sixpoint::clients
