#include "services/registration/registration_service.h"

#include <chrono>
#include <cstring>
#include <optional>
#include <string>
#include <utility>

#include "metrology/registration/register.h"
#include "services/registration/batch.h"
#include "services/registration/drawn_holes.h"
#include "services/registration/messages.h"
#include "services/registration/metrics.h"
#include "services/registration/rows.h"
#include "services/registration/validate.h"
#include "services/runtime/call.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/errors.h"
#include "services/runtime/recorded_call.h"
#include "services/runtime/recorded_results.h"
#include "services/runtime/replay.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::registration {

using runtime::ToGrpc;

namespace {

// How long it took to compute is no figure of the blade.
absl::StatusOr<v1::Registration> WithoutTime(absl::StatusOr<v1::Registration> registration) {
  if (registration.ok()) registration->mutable_evidence()->clear_seconds();
  return registration;
}

}  // namespace

RegistrationService::RegistrationService(std::shared_ptr<storage::RegistrationStore> store, const Peers& peers,
                                         const RegistrationLimits& limits)
    : store_(std::move(store)),
      inputs_(peers, limits.memory, limits.threads),
      pool_(limits.pool, "registrations", errors::v1::REGISTRATIONS_FULL) {
  Metrics();
}

grpc::Status RegistrationService::Register(grpc::ServerContext* context, const v1::RegisterRequest* request,
                                           v1::Registration* response) {
  return runtime::Answer(RegisterOnce(*request, Caller{runtime::CallerOf(*context)}), response);
}

absl::StatusOr<v1::Registration> RegistrationService::RegisterOnce(const v1::RegisterRequest& request,
                                                                   const Caller& caller) {
  if (absl::Status status = CheckRequest(request); !status.ok()) return status;
  RecordedFit fit;
  const auto make = [&] {
    auto made = Make(request, caller);
    if (made.ok())
      fit = {made->row.registration_id, made->row.outcome, made->row.compute_seconds, made->row.residual_rms_um,
             made->row.condition_number};
    return made;
  };
  absl::StatusOr<v1::Registration> recorded =
      runtime::RecordedResult<v1::Registration>(store_.get(), "registration.Register", request, caller, make, ToProto);
  // Not where an earlier call recorded it, or another one meanwhile.
  if (recorded.ok() && runtime::LastSegment(recorded->name()) == fit.registration_id) CountRecorded(fit);
  return recorded;
}

absl::StatusOr<runtime::Made<storage::RegistrationRow>> RegistrationService::Make(const v1::RegisterRequest& request,
                                                                                  const Caller& caller) {
  return MakeFrom(request, caller, [&] { return inputs_.Fetch(request, caller); });
}

absl::StatusOr<runtime::Made<storage::RegistrationRow>> RegistrationService::MakeFrom(
    const v1::RegisterRequest& request, const Caller& caller, const std::function<absl::StatusOr<Inputs>()>& fetch) {
  Say(caller, v1::REGISTRATION_STEP_WAITING, 0, 0);
  const auto slot = pool_.Enter(caller.deadline, caller.keep_going, caller.patience);
  if (!slot.ok()) return slot.status();
  Say(caller, v1::REGISTRATION_STEP_FETCHING, 0, 0);
  const auto make = [&]() -> absl::StatusOr<runtime::Made<storage::RegistrationRow>> {
    const absl::StatusOr<Inputs> inputs = fetch();
    if (!inputs.ok()) return inputs.status();
    const auto started = std::chrono::steady_clock::now();
    auto registered = metrology::Register({*inputs->surface, inputs->portions, inputs->calibration}, inputs->task);
    if (!registered.ok()) return registered.status();
    metrology::AddRemark(inputs->remark, &registered->fit.evidence);
    registered->fit.evidence.drawn_hole_count = CountDrawnHoles(inputs->part, *inputs->surface);
    registered->fit.evidence.left_out_count = inputs->left_out_count;
    const std::chrono::duration<double> computed = std::chrono::steady_clock::now() - started;
    return RecordOf(request, *inputs, *registered, computed.count());
  };
  auto made = make();
  // A kernel that is told to stop does not know why.
  if (absl::IsCancelled(made.status()) && std::chrono::steady_clock::now() >= caller.deadline)
    return absl::DeadlineExceededError("register: its time was over before its end");
  return made;
}

grpc::Status RegistrationService::GetRegistration(grpc::ServerContext* context,
                                                  const v1::GetRegistrationRequest* request,
                                                  v1::Registration* response) {
  return runtime::Answer(
      runtime::GetResult<v1::Registration>(*store_, runtime::DeadlineOf(*context), "registrations", request->name(),
                                           errors::v1::REGISTRATION_NOT_FOUND, ToProto),
      response);
}

grpc::Status RegistrationService::ReplayRegistration(grpc::ServerContext* context,
                                                     const v1::ReplayRegistrationRequest* request,
                                                     replay::v1::Replay* response) {
  const Caller caller{runtime::CallerOf(*context)};
  const auto recorded = WithoutTime(runtime::GetResult<v1::Registration>(
      *store_, caller.deadline, "registrations", request->name(), errors::v1::REGISTRATION_NOT_FOUND, ToProto));
  if (!recorded.ok()) return ToGrpc(recorded.status());
  const auto now = WithoutTime(MakeAgain(*recorded, caller));
  return runtime::Answer(runtime::ReplayOf(*recorded, now), response);
}

absl::StatusOr<v1::Registration> RegistrationService::MakeAgain(const v1::Registration& recorded,
                                                                const Caller& caller) {
  const auto again = MakeFrom(RequestOf(recorded), caller, [&] { return inputs_.FetchAsRecorded(recorded, caller); });
  if (!again.ok()) return again.status();
  return ToProto(again->row);
}

grpc::Status RegistrationService::ListRegistrations(grpc::ServerContext* context,
                                                    const v1::ListRegistrationsRequest* request,
                                                    v1::ListRegistrationsResponse* response) {
  storage::RegistrationFilter filter;
  if (absl::Status status = runtime::ReadFilter(*request, &filter); !status.ok()) return ToGrpc(status);
  filter.reader = runtime::ReaderOf(*context);
  if (!v1::Outcome_IsValid(request->outcome()))
    return ToGrpc(runtime::Refuse("outcome", std::to_string(request->outcome()), "an outcome, or none"));
  if (request->outcome() != v1::OUTCOME_UNSPECIFIED)
    filter.outcome = v1::Outcome_Name(request->outcome()).substr(std::strlen("OUTCOME_"));
  filter.only_disagreeing = request->only_disagreeing();
  filter.without_for_inspection = request->without_for_inspection();
  return ToGrpc(runtime::ListResults(*store_, runtime::DeadlineOf(*context), *request, filter, ToProto, LeaveBasic,
                                     response->mutable_registrations(), response->mutable_next_page_token()));
}

grpc::Status RegistrationService::RegisterBatch(grpc::ServerContext* context, const v1::RegisterBatchRequest* request,
                                                grpc::ServerWriter<v1::RegisterBatchResponse>* writer) {
  // One registration that is watched takes no batch's place.
  std::optional<runtime::ComputePool::Slot> slot;
  if (request->requests_size() > 1) {
    auto free = batches_.Enter(runtime::DeadlineOf(*context), runtime::KeepGoing(*context));
    if (!free.ok()) return ToGrpc(free.status());
    slot.emplace(*std::move(free));
  }
  return ToGrpc(RunBatch(
      *request, Caller{runtime::CallerOf(*context)},
      [this](const v1::RegisterRequest& one, const Caller& caller) { return RegisterOnce(one, caller); },
      [writer](const v1::RegisterBatchResponse& response) { return writer->Write(response); }));
}

}  // namespace sixpoint::registration
