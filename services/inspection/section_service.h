// sixpoint.inspection.v1.SectionService.
#pragma once

#include <memory>

#include "services/clients/blade_peers.h"
#include "services/inspection/options.h"
#include "services/runtime/call.h"
#include "services/runtime/compute_pool.h"
#include "services/runtime/recorded_call.h"
#include "sixpoint/inspection/v1/section.grpc.pb.h"
#include "storage/sections.h"

namespace sixpoint::inspection {

class SectionService final : public v1::SectionService::Service {
 public:
  SectionService(std::shared_ptr<storage::SectionStore> store, std::shared_ptr<const clients::BladePeers> peers,
                 const InspectionServiceOptions& options);

  grpc::Status MeasureSections(grpc::ServerContext* context, const v1::MeasureSectionsRequest* request,
                               v1::SectionMeasurement* response) override;
  grpc::Status GetSectionMeasurement(grpc::ServerContext* context, const v1::GetSectionMeasurementRequest* request,
                                     v1::SectionMeasurement* response) override;
  grpc::Status ListSectionMeasurements(grpc::ServerContext* context, const v1::ListSectionMeasurementsRequest* request,
                                       v1::ListSectionMeasurementsResponse* response) override;
  grpc::Status DownloadSectionOutlines(grpc::ServerContext* context, const v1::DownloadSectionOutlinesRequest* request,
                                       grpc::ServerWriter<v1::SectionOutline>* writer) override;
  grpc::Status ReplaySectionMeasurement(grpc::ServerContext* context,
                                        const v1::ReplaySectionMeasurementRequest* request,
                                        replay::v1::Replay* response) override;

 private:
  // is_new: the scanner must not have moved since it was calibrated, as was known when the scans were received.
  absl::StatusOr<runtime::Made<storage::SectionMeasurementRow>> Make(const v1::MeasureSectionsRequest& request,
                                                                     bool is_new, const runtime::Caller& caller) const;

  const std::shared_ptr<storage::SectionStore> store_;
  const std::shared_ptr<const clients::BladePeers> peers_;
  const InspectionServiceOptions options_;
  runtime::ComputePool running_;
};

}  // namespace sixpoint::inspection
