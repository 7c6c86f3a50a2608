// First certificates by a one-time code, and certificates that follow others: kept for their holders, signed elsewhere.
#pragma once

#include <grpcpp/grpcpp.h>

#include <memory>
#include <utility>

#include "identity/trust.h"
#include "sixpoint/plant/v1/credentials.grpc.pb.h"
#include "storage/credentials.h"

namespace sixpoint::plant {

// Thread-safe.
class CredentialsService final : public v1::CredentialsService::Service {
 public:
  // trust: what a renewal has to stand before it is kept.
  CredentialsService(std::shared_ptr<storage::CredentialStore> credentials, std::unique_ptr<identity::Trust> trust)
      : credentials_(std::move(credentials)), trust_(std::move(trust)) {}

  grpc::Status OfferCredentials(grpc::ServerContext* context, const v1::OfferCredentialsRequest* request,
                                v1::OfferCredentialsResponse* response) override;
  grpc::Status TakeCredentials(grpc::ServerContext* context, const v1::TakeCredentialsRequest* request,
                               v1::TakeCredentialsResponse* response) override;
  grpc::Status OfferRenewal(grpc::ServerContext* context, const v1::OfferRenewalRequest* request,
                            v1::OfferRenewalResponse* response) override;
  grpc::Status GetRenewal(grpc::ServerContext* context, const v1::GetRenewalRequest* request,
                          v1::Renewal* response) override;

 private:
  const std::shared_ptr<storage::CredentialStore> credentials_;
  const std::unique_ptr<identity::Trust> trust_;
};

}  // namespace sixpoint::plant
