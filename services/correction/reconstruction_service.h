// sixpoint.correction.v1.ReconstructionService.
#pragma once

#include <memory>

#include "services/clients/blade_peers.h"
#include "services/runtime/call.h"
#include "services/runtime/compute_pool.h"
#include "services/runtime/recorded_call.h"
#include "sixpoint/correction/v1/reconstruction.grpc.pb.h"
#include "storage/reconstructions.h"

namespace sixpoint::correction {

class ReconstructionService final : public v1::ReconstructionService::Service {
 public:
  // threads: of each reconstruction.
  ReconstructionService(std::shared_ptr<storage::ReconstructionStore> store,
                        std::shared_ptr<const clients::BladePeers> peers, runtime::PoolLimits limits, int threads);

  grpc::Status Reconstruct(grpc::ServerContext* context, const v1::ReconstructRequest* request,
                           v1::Reconstruction* response) override;
  grpc::Status GetReconstruction(grpc::ServerContext* context, const v1::GetReconstructionRequest* request,
                                 v1::Reconstruction* response) override;
  grpc::Status ListReconstructions(grpc::ServerContext* context, const v1::ListReconstructionsRequest* request,
                                   v1::ListReconstructionsResponse* response) override;
  grpc::Status DownloadBlankPatches(grpc::ServerContext* context, const v1::DownloadBlankPatchesRequest* request,
                                    grpc::ServerWriter<v1::BlankPatches>* writer) override;
  grpc::Status DownloadLattice(grpc::ServerContext* context, const v1::DownloadLatticeRequest* request,
                               grpc::ServerWriter<v1::LatticePiece>* writer) override;
  grpc::Status ReplayReconstruction(grpc::ServerContext* context, const v1::ReplayReconstructionRequest* request,
                                    replay::v1::Replay* response) override;

 private:
  // is_new: the scanner must not have moved since it was calibrated, as was known when the scans were received.
  absl::StatusOr<runtime::Made<storage::ReconstructionRow>> Make(const v1::ReconstructRequest& request, bool is_new,
                                                                 const runtime::Caller& caller) const;

  const std::shared_ptr<storage::ReconstructionStore> store_;
  const std::shared_ptr<const clients::BladePeers> peers_;
  const int threads_;
  runtime::ComputePool running_;
};

}  // namespace sixpoint::correction
