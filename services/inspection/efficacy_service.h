// sixpoint.inspection.v1.EfficacyService.
#pragma once

#include <memory>

#include "services/runtime/compute_pool.h"
#include "sixpoint/inspection/v1/efficacy.grpc.pb.h"
#include "storage/outcomes.h"

namespace sixpoint::inspection {

class EfficacyService final : public v1::EfficacyService::Service {
 public:
  explicit EfficacyService(std::shared_ptr<storage::OutcomeReader> outcomes) : outcomes_(std::move(outcomes)) {}

  grpc::Status ComputeEfficacy(grpc::ServerContext* context, const v1::ComputeEfficacyRequest* request,
                               v1::Efficacy* response) override;

 private:
  const std::shared_ptr<storage::OutcomeReader> outcomes_;
  // One reads up to kMostOutcomeHoles rows with their budgets, some tens of megabytes: not as many at once as the gate lets in.
  runtime::ComputePool running_{{2, runtime::kAllLetIn}, "efficacies", errors::v1::INSPECTIONS_FULL};
};

}  // namespace sixpoint::inspection
