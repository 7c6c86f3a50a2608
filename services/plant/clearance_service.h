// Who is cleared to see what of which part: kept here, obeyed by every service (services/runtime/clearance.h).
#pragma once

#include <grpcpp/grpcpp.h>

#include "sixpoint/plant/v1/clearance.grpc.pb.h"
#include "storage/database.h"

namespace sixpoint::plant {

// Thread-safe.
class ClearanceService final : public v1::ClearanceService::Service {
 public:
  // `database` lives longer.
  explicit ClearanceService(storage::Database* database) : database_(database) {}

  grpc::Status GrantClearance(grpc::ServerContext* context, const v1::GrantClearanceRequest* request,
                              v1::Clearance* response) override;
  grpc::Status WithdrawClearance(grpc::ServerContext* context, const v1::WithdrawClearanceRequest* request,
                                 v1::Clearance* response) override;
  grpc::Status ListClearances(grpc::ServerContext* context, const v1::ListClearancesRequest* request,
                              v1::ListClearancesResponse* response) override;

 private:
  storage::Database* const database_;
};

}  // namespace sixpoint::plant
