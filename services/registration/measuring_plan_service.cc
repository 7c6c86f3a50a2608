#include "services/registration/measuring_plan_service.h"

#include <chrono>

#include "services/runtime/call.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/errors.h"

namespace sixpoint::registration {

grpc::Status MeasuringPlanService::PlanMeasurement(grpc::ServerContext* context,
                                                   const v1::PlanMeasurementRequest* request,
                                                   v1::MeasuringPlan* response) {
  return runtime::Answer(Plan(*request, runtime::CallerOf(*context)), response);
}

absl::StatusOr<v1::MeasuringPlan> MeasuringPlanService::Plan(const v1::PlanMeasurementRequest& request,
                                                             const runtime::Caller& caller) {
  if (absl::Status status = CheckPlanRequest(request); !status.ok()) return status;
  const auto slot = pool_->Enter(caller.deadline, caller.keep_going);
  if (!slot.ok()) return slot.status();
  const auto inputs = inputs_.FetchForPlan(request, caller);
  if (!inputs.ok()) return inputs.status();
  auto plan = PlanOf(request, *inputs, threads_, caller.keep_going);
  // A kernel that is told to stop does not know why.
  if (absl::IsCancelled(plan.status()) && std::chrono::steady_clock::now() >= caller.deadline)
    return absl::DeadlineExceededError("measuring plan: its time was over before its end");
  return plan;
}

}  // namespace sixpoint::registration
