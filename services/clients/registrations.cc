#include "services/clients/registrations.h"

#include "services/runtime/errors.h"
#include "sixpoint/registration/v1/registration.grpc.pb.h"

namespace sixpoint::clients {

struct RegistrationClient::Stubs {
  std::unique_ptr<registration::v1::RegistrationService::Stub> registrations;
};

RegistrationClient::RegistrationClient(const std::shared_ptr<grpc::Channel>& registration)
    : stubs_(new Stubs{registration::v1::RegistrationService::NewStub(registration)}) {}
RegistrationClient::~RegistrationClient() = default;

absl::StatusOr<registration::v1::Registration> RegistrationClient::Get(
    const std::string& name, std::unique_ptr<grpc::ClientContext> context) const {
  registration::v1::GetRegistrationRequest request;
  request.set_name(name);
  registration::v1::Registration registration;
  const grpc::Status got = stubs_->registrations->GetRegistration(context.get(), request, &registration);
  if (!got.ok()) return runtime::FromGrpc(got);
  return registration;
}

absl::StatusOr<registration::v1::ListRegistrationsResponse> RegistrationClient::List(
    const registration::v1::ListRegistrationsRequest& request, std::unique_ptr<grpc::ClientContext> context) const {
  registration::v1::ListRegistrationsResponse page;
  const grpc::Status got = stubs_->registrations->ListRegistrations(context.get(), request, &page);
  if (!got.ok()) return runtime::FromGrpc(got);
  return page;
}

absl::StatusOr<registration::v1::Registration> RegistrationClient::Register(
    const registration::v1::RegisterRequest& request, std::unique_ptr<grpc::ClientContext> context) const {
  registration::v1::Registration registration;
  const grpc::Status got = stubs_->registrations->Register(context.get(), request, &registration);
  if (!got.ok()) return runtime::FromGrpc(got);
  return registration;
}

absl::StatusOr<replay::v1::Replay> RegistrationClient::Replay(const std::string& name,
                                                              std::unique_ptr<grpc::ClientContext> context) const {
  registration::v1::ReplayRegistrationRequest request;
  request.set_name(name);
  replay::v1::Replay replay;
  const grpc::Status got = stubs_->registrations->ReplayRegistration(context.get(), request, &replay);
  if (!got.ok()) return runtime::FromGrpc(got);
  return replay;
}

}  // namespace sixpoint::clients
