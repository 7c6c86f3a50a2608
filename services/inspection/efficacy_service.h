// sixpoint.inspection.v1.EfficacyService.
#pragma once

#include <memory>

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
};

}  // namespace sixpoint::inspection
