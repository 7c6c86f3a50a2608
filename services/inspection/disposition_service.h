// sixpoint.inspection.v1.DispositionService.
#pragma once

#include <memory>
#include <utility>

#include "sixpoint/inspection/v1/disposition.grpc.pb.h"
#include "storage/dispositions.h"
#include "storage/inspections.h"

namespace sixpoint::inspection {

class DispositionService final : public v1::DispositionService::Service {
 public:
  DispositionService(std::shared_ptr<storage::ResultWriter<storage::DispositionRow>> dispositions,
                     std::shared_ptr<const storage::InspectionStore> inspections)
      : dispositions_(std::move(dispositions)), inspections_(std::move(inspections)) {}

  grpc::Status Dispose(grpc::ServerContext* context, const v1::DisposeRequest* request,
                       v1::Disposition* response) override;

 private:
  const std::shared_ptr<storage::ResultWriter<storage::DispositionRow>> dispositions_;
  const std::shared_ptr<const storage::InspectionStore> inspections_;
};

}  // namespace sixpoint::inspection
