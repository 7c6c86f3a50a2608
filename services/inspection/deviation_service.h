// sixpoint.inspection.v1.DeviationService.
#pragma once

#include <memory>

#include "services/clients/blade_peers.h"
#include "services/inspection/options.h"
#include "services/runtime/call.h"
#include "services/runtime/compute_pool.h"
#include "services/runtime/recorded_call.h"
#include "sixpoint/inspection/v1/deviation.grpc.pb.h"
#include "storage/deviations.h"

namespace sixpoint::inspection {

class DeviationService final : public v1::DeviationService::Service {
 public:
  DeviationService(std::shared_ptr<storage::DeviationStore> store, std::shared_ptr<const clients::BladePeers> peers,
                   const InspectionServiceOptions& options);

  grpc::Status MapDeviation(grpc::ServerContext* context, const v1::MapDeviationRequest* request,
                            v1::DeviationMap* response) override;
  grpc::Status GetDeviationMap(grpc::ServerContext* context, const v1::GetDeviationMapRequest* request,
                               v1::DeviationMap* response) override;
  grpc::Status ListDeviationMaps(grpc::ServerContext* context, const v1::ListDeviationMapsRequest* request,
                                 v1::ListDeviationMapsResponse* response) override;
  grpc::Status DownloadDeviationPatches(grpc::ServerContext* context,
                                        const v1::DownloadDeviationPatchesRequest* request,
                                        grpc::ServerWriter<v1::DeviationPatches>* writer) override;
  grpc::Status DownloadDeviationCloud(grpc::ServerContext* context, const v1::DownloadDeviationCloudRequest* request,
                                      grpc::ServerWriter<v1::DeviationCloudBlock>* writer) override;
  grpc::Status ReplayDeviationMap(grpc::ServerContext* context, const v1::ReplayDeviationMapRequest* request,
                                  replay::v1::Replay* response) override;

 private:
  // is_new: the scanner must not have moved since it was calibrated, as was known when the scans were received.
  absl::StatusOr<runtime::Made<storage::DeviationMapRow>> Make(const v1::MapDeviationRequest& request, bool is_new,
                                                               const runtime::Caller& caller) const;

  const std::shared_ptr<storage::DeviationStore> store_;
  const std::shared_ptr<const clients::BladePeers> peers_;
  const InspectionServiceOptions options_;
  runtime::ComputePool running_;
};

}  // namespace sixpoint::inspection
