// sixpoint.inspection.v1.ExportService.
#pragma once

#include <memory>

#include "services/clients/blade_peers.h"
#include "services/runtime/compute_pool.h"
#include "sixpoint/inspection/v1/export.grpc.pb.h"
#include "storage/assessments.h"
#include "storage/deviations.h"
#include "storage/inspections.h"

namespace sixpoint::inspection {

// Rows read at a time.
inline constexpr int kExportPage = 100;

class ExportService final : public v1::ExportService::Service {
 public:
  ExportService(std::shared_ptr<storage::InspectionStore> inspections,
                std::shared_ptr<storage::DeviationStore> deviations,
                std::shared_ptr<storage::AssessmentStore> assessments,
                std::shared_ptr<const clients::BladePeers> peers);

  grpc::Status ExportResults(grpc::ServerContext* context, const v1::ExportResultsRequest* request,
                             grpc::ServerWriter<v1::ExportResultsResponse>* writer) override;

 private:
  const std::shared_ptr<storage::InspectionStore> inspections_;
  const std::shared_ptr<storage::DeviationStore> deviations_;
  const std::shared_ptr<storage::AssessmentStore> assessments_;
  const std::shared_ptr<const clients::BladePeers> peers_;
  runtime::ComputePool running_;
};

}  // namespace sixpoint::inspection
