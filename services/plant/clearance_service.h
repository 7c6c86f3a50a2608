// Who is cleared to see what of which part: kept here, obeyed by every service (services/runtime/clearance.h).
#pragma once

#include <grpcpp/grpcpp.h>

#include <memory>
#include <utility>

#include "sixpoint/plant/v1/clearance.grpc.pb.h"
#include "storage/clearance_store.h"

namespace sixpoint::plant {

// Thread-safe.
class ClearanceService final : public v1::ClearanceService::Service {
 public:
  explicit ClearanceService(std::shared_ptr<storage::ClearanceStore> clearances) : clearances_(std::move(clearances)) {}

  grpc::Status GrantClearance(grpc::ServerContext* context, const v1::GrantClearanceRequest* request,
                              v1::Clearance* response) override;
  grpc::Status WithdrawClearance(grpc::ServerContext* context, const v1::WithdrawClearanceRequest* request,
                                 v1::Clearance* response) override;
  grpc::Status ListClearances(grpc::ServerContext* context, const v1::ListClearancesRequest* request,
                              v1::ListClearancesResponse* response) override;

 private:
  const std::shared_ptr<storage::ClearanceStore> clearances_;
};

}  // namespace sixpoint::plant
