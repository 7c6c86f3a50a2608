// sixpoint.inspection.v1.InspectionService.
#pragma once

#include <memory>
#include <optional>
#include <set>
#include <string>

#include "services/clients/blade_peers.h"
#include "services/inspection/near_cells_ahead.h"
#include "services/inspection/options.h"
#include "services/runtime/call.h"
#include "services/runtime/compute_pool.h"
#include "services/runtime/recorded_call.h"
#include "sixpoint/inspection/v1/inspection.grpc.pb.h"
#include "storage/inspections.h"

namespace sixpoint::inspection {

class InspectionService final : public v1::InspectionService::Service {
 public:
  InspectionService(std::shared_ptr<storage::InspectionStore> store, std::shared_ptr<const clients::BladePeers> peers,
                    const InspectionServiceOptions& options);

  grpc::Status Inspect(grpc::ServerContext* context, const v1::InspectRequest* request,
                       v1::Inspection* response) override;
  grpc::Status GetInspection(grpc::ServerContext* context, const v1::GetInspectionRequest* request,
                             v1::Inspection* response) override;
  grpc::Status ListInspections(grpc::ServerContext* context, const v1::ListInspectionsRequest* request,
                               v1::ListInspectionsResponse* response) override;
  // One after the other, each in a slot of its own.
  grpc::Status Rejudge(grpc::ServerContext* context, const v1::RejudgeRequest* request,
                       grpc::ServerWriter<v1::RejudgeResponse>* writer) override;
  // Its registrations too, each in its service.
  grpc::Status ReplayInspection(grpc::ServerContext* context, const v1::ReplayInspectionRequest* request,
                                replay::v1::Replay* response) override;

 private:
  // call: whose request_id it is. rejudges_id: the inspection that it judges anew; empty: none.
  absl::StatusOr<v1::Inspection> InspectOnce(const char* call, const v1::InspectRequest& request,
                                             const std::string& rejudges_id, const runtime::Caller& caller);
  // Nothing where it judges one of the others anew.
  absl::StatusOr<std::optional<v1::RejudgeResponse>> RejudgeOne(const v1::RejudgeRequest& request,
                                                                const std::string& name,
                                                                const std::set<std::string>& wanted,
                                                                const runtime::Caller& caller);
  absl::StatusOr<runtime::Made<storage::InspectionRow>> Make(const v1::InspectRequest& request,
                                                             const runtime::Caller& caller);
  absl::StatusOr<v1::Inspection> MakeAgain(const v1::Inspection& recorded, const runtime::Caller& caller) const;

  const std::shared_ptr<storage::InspectionStore> store_;
  const std::shared_ptr<const clients::BladePeers> peers_;
  const InspectionServiceOptions options_;
  runtime::ComputePool running_;
  NearCellsAhead near_cells_ahead_;
};

}  // namespace sixpoint::inspection
