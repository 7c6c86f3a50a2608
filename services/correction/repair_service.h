// sixpoint.correction.v1.RepairService.
#pragma once

#include <memory>

#include "services/clients/blade_peers.h"
#include "services/runtime/call.h"
#include "services/runtime/compute_pool.h"
#include "services/runtime/recorded_call.h"
#include "sixpoint/correction/v1/repair.grpc.pb.h"
#include "storage/repairs.h"

namespace sixpoint::correction {

class RepairService final : public v1::RepairService::Service {
 public:
  // threads: of each repair.
  RepairService(std::shared_ptr<storage::RepairStore> store, std::shared_ptr<const clients::BladePeers> peers,
                runtime::PoolLimits limits, int threads);

  grpc::Status PlanRepair(grpc::ServerContext* context, const v1::PlanRepairRequest* request,
                          v1::Repair* response) override;
  grpc::Status GetRepair(grpc::ServerContext* context, const v1::GetRepairRequest* request,
                         v1::Repair* response) override;
  grpc::Status ListRepairs(grpc::ServerContext* context, const v1::ListRepairsRequest* request,
                           v1::ListRepairsResponse* response) override;
  grpc::Status DownloadTargetContours(grpc::ServerContext* context, const v1::DownloadTargetContoursRequest* request,
                                      grpc::ServerWriter<v1::TargetContour>* writer) override;
  grpc::Status DownloadRepairPath(grpc::ServerContext* context, const v1::DownloadRepairPathRequest* request,
                                  grpc::ServerWriter<v1::RepairLap>* writer) override;
  grpc::Status ReplayRepair(grpc::ServerContext* context, const v1::ReplayRepairRequest* request,
                            replay::v1::Replay* response) override;

 private:
  // is_new: the scanner must not have moved since it was calibrated, as was known when the scans were received.
  absl::StatusOr<runtime::Made<storage::RepairRow>> Make(const v1::PlanRepairRequest& request, bool is_new,
                                                         const runtime::Caller& caller) const;

  const std::shared_ptr<storage::RepairStore> store_;
  const std::shared_ptr<const clients::BladePeers> peers_;
  const int threads_;
  runtime::ComputePool running_;
};

}  // namespace sixpoint::correction
