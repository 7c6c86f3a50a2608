// sixpoint.correction.v1.MachiningPassService.
#pragma once

#include <memory>

#include "services/clients/blade_peers.h"
#include "services/correction/adapt.h"
#include "services/runtime/call.h"
#include "services/runtime/compute_pool.h"
#include "services/runtime/recorded_call.h"
#include "sixpoint/correction/v1/machining_pass.grpc.pb.h"
#include "storage/corrections.h"

namespace sixpoint::correction {

class MachiningPassService final : public v1::MachiningPassService::Service {
 public:
  // threads: of each pass that is looked at.
  MachiningPassService(ShapeStores shapes, std::shared_ptr<storage::CorrectionStore> corrections,
                       std::shared_ptr<const clients::BladePeers> peers, runtime::PoolLimits limits, int threads);

  grpc::Status NextPass(grpc::ServerContext* context, const v1::NextPassRequest* request,
                        v1::MachiningPass* response) override;
  grpc::Status GetMachiningPass(grpc::ServerContext* context, const v1::GetMachiningPassRequest* request,
                                v1::MachiningPass* response) override;
  grpc::Status ListMachiningPasses(grpc::ServerContext* context, const v1::ListMachiningPassesRequest* request,
                                   v1::ListMachiningPassesResponse* response) override;
  grpc::Status DownloadPassPatches(grpc::ServerContext* context, const v1::DownloadPassPatchesRequest* request,
                                   grpc::ServerWriter<v1::BlankPatches>* writer) override;
  grpc::Status ReplayMachiningPass(grpc::ServerContext* context, const v1::ReplayMachiningPassRequest* request,
                                   replay::v1::Replay* response) override;

 private:
  // is_new: as clients::FetchWhole.
  absl::StatusOr<runtime::Made<storage::MachiningPassRow>> Make(const v1::NextPassRequest& request, bool is_new,
                                                                const runtime::Caller& caller) const;

  const ShapeStores shapes_;
  const std::shared_ptr<storage::CorrectionStore> corrections_;
  const std::shared_ptr<const clients::BladePeers> peers_;
  const int threads_;
  runtime::ComputePool running_;
};

}  // namespace sixpoint::correction
