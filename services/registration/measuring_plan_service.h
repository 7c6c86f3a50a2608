// sixpoint.registration.v1.MeasuringPlanService.
#pragma once

#include "services/registration/inputs.h"
#include "services/registration/measuring_plan.h"
#include "services/runtime/compute_pool.h"
#include "sixpoint/registration/v1/measuring_plan.grpc.pb.h"

namespace sixpoint::registration {

class MeasuringPlanService final : public v1::MeasuringPlanService::Service {
 public:
  // Both are RegistrationService's, and outlive this: a plan takes the memory and the time of a registration, and its turn among them.
  MeasuringPlanService(const InputFetcher& inputs, runtime::ComputePool* pool, int threads)
      : inputs_(inputs), pool_(pool), threads_(threads) {}

  // RESOURCE_EXHAUSTED (REGISTRATIONS_FULL) where too many wait.
  grpc::Status PlanMeasurement(grpc::ServerContext* context, const v1::PlanMeasurementRequest* request,
                               v1::MeasuringPlan* response) override;

 private:
  absl::StatusOr<v1::MeasuringPlan> Plan(const v1::PlanMeasurementRequest& request, const runtime::Caller& caller);

  const InputFetcher& inputs_;
  runtime::ComputePool* const pool_;
  const int threads_;
};

}  // namespace sixpoint::registration
