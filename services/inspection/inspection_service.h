// sixpoint.inspection.v1.InspectionService.
#pragma once

#include <memory>

#include "services/inspection/inspect_blade.h"
#include "services/runtime/compute_pool.h"
#include "sixpoint/inspection/v1/inspection.grpc.pb.h"
#include "storage/database.h"

namespace sixpoint::inspection {

struct InspectionServiceOptions {
  int greatest_count = 2;  // inspections at once; more are RESOURCE_EXHAUSTED
  int threads = 2;         // compute threads of each
};

class InspectionService final : public v1::InspectionService::Service {
 public:
  InspectionService(storage::Database* database, std::unique_ptr<Peers> peers, const InspectionServiceOptions& options);

  grpc::Status Inspect(grpc::ServerContext* context, const v1::InspectRequest* request,
                       v1::Inspection* response) override;
  grpc::Status GetInspection(grpc::ServerContext* context, const v1::GetInspectionRequest* request,
                             v1::Inspection* response) override;
  grpc::Status ListInspections(grpc::ServerContext* context, const v1::ListInspectionsRequest* request,
                               v1::ListInspectionsResponse* response) override;

 private:
  storage::Database* const database_;
  const std::unique_ptr<Peers> peers_;
  const InspectionServiceOptions options_;
  runtime::ComputePool running_;
};

}  // namespace sixpoint::inspection
