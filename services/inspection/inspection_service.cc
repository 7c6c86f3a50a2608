#include "services/inspection/inspection_service.h"

#include <algorithm>
#include <set>
#include <string>
#include <utility>

#include "services/inspection/inputs.h"
#include "services/inspection/inspect.h"
#include "services/inspection/messages.h"
#include "services/inspection/metrics.h"
#include "services/inspection/rejudge.h"
#include "services/inspection/rows.h"
#include "services/inspection/stored_verdict.h"
#include "services/inspection/validate.h"
#include "services/runtime/call.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/errors.h"
#include "services/runtime/recorded_results.h"
#include "services/runtime/replay.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/work_order.h"

namespace sixpoint::inspection {
namespace {

constexpr std::int64_t kWorthNearCells =
    1'000'000;  // points of an inspection: some such later, making them is paid back

}  // namespace

using runtime::ToGrpc;

InspectionService::InspectionService(std::shared_ptr<storage::InspectionStore> store,
                                     std::shared_ptr<const clients::BladePeers> peers,
                                     const InspectionServiceOptions& options)
    : store_(std::move(store)),
      peers_(std::move(peers)),
      options_(options),
      running_(options.pool, "inspections", errors::v1::INSPECTIONS_FULL) {
  Metrics();
}

grpc::Status InspectionService::Inspect(grpc::ServerContext* context, const v1::InspectRequest* request,
                                        v1::Inspection* response) {
  if (absl::Status status = CheckInspect(*request); !status.ok()) return ToGrpc(status);
  const runtime::Caller caller = runtime::CallerOf(*context);
  const auto slot = running_.Enter(caller.deadline, caller.keep_going);
  if (!slot.ok()) return ToGrpc(slot.status());
  return runtime::Answer(InspectOnce("inspection.Inspect", *request, "", caller), response);
}

absl::StatusOr<v1::Inspection> InspectionService::InspectOnce(const char* call, const v1::InspectRequest& request,
                                                              const std::string& rejudges_id,
                                                              const runtime::Caller& caller) {
  std::string made_id, verdict;
  double deviation_rms_um = 0;
  const auto make = [&] {
    auto made = Make(request, caller);
    if (made.ok()) {
      made->row.rejudges_id = rejudges_id;
      made_id = made->row.inspection_id;
      verdict = made->row.verdict;
      deviation_rms_um = made->row.deviation_rms_um;
    }
    return made;
  };
  auto recorded = runtime::RecordedResult<v1::Inspection>(store_.get(), call, request, caller, make, ToProto);
  // Not where an earlier call recorded it, or another one meanwhile.
  if (recorded.ok() && runtime::LastSegment(recorded->name()) == made_id) {
    Metrics().recorded.Add(verdict);
    Metrics().deviation_rms_metres.Observe(deviation_rms_um * 1e-6);
  }
  return recorded;
}

grpc::Status InspectionService::Rejudge(grpc::ServerContext* context, const v1::RejudgeRequest* request,
                                        grpc::ServerWriter<v1::RejudgeResponse>* writer) {
  if (absl::Status status = CheckRejudge(*request); !status.ok()) return ToGrpc(status);
  const runtime::Caller caller = runtime::CallerOf(*context);
  const absl::StatusOr<std::vector<std::string>> names = InspectionsOf(*peers_, *request, caller);
  if (!names.ok()) return ToGrpc(names.status());
  const std::set<std::string> wanted(names->begin(), names->end());
  auto next = names->begin();
  if (!request->after().empty()) {
    next = std::find(names->begin(), names->end(), request->after());
    if (next++ == names->end())
      return ToGrpc(runtime::Refuse("after", request->after(), "one of those that this call judges"));
  }
  int flip_count = 0;
  for (; next != names->end(); ++next) {
    auto response = RejudgeOne(*request, *next, wanted, caller);
    if (!response.ok()) return ToGrpc(response.status());
    if (!response->has_value()) continue;
    flip_count += (*response)->flips();
    (*response)->set_finished_count(static_cast<int>(next - names->begin()) + 1);
    (*response)->set_total_count(static_cast<int>(names->size()));
    (*response)->set_flip_count(flip_count);
    if (!writer->Write(**response))
      return ToGrpc(absl::CancelledError("rejudge: the client went away; what was judged is kept"));
  }
  return grpc::Status::OK;
}

absl::StatusOr<std::optional<v1::RejudgeResponse>> InspectionService::RejudgeOne(const v1::RejudgeRequest& request,
                                                                                 const std::string& name,
                                                                                 const std::set<std::string>& wanted,
                                                                                 const runtime::Caller& caller) {
  const auto old = runtime::GetResult<v1::Inspection>(*store_, caller.deadline, "inspections", name,
                                                      errors::v1::INSPECTION_NOT_FOUND, ToProto);
  if (EndsTheCall(old.status())) return old.status();
  if (!old.ok()) return NotRead(name, old.status());
  if (wanted.count(old->rejudges()) > 0) return std::nullopt;  // the same scans
  const auto slot = running_.Enter(caller.deadline, caller.keep_going, runtime::ComputePool::Patience::kPatient);
  if (!slot.ok()) return slot.status();
  const auto again = AskedAgain(*peers_, request, *old, caller);
  if (EndsTheCall(again.status())) return again.status();
  if (!again.ok()) return Beside(*old, again.status());
  const auto now = InspectOnce("inspection.Rejudge", *again, runtime::LastSegment(name), caller);
  if (EndsTheCall(now.status())) return now.status();
  return Beside(*old, now);
}

absl::StatusOr<runtime::Made<storage::InspectionRow>> InspectionService::Make(const v1::InspectRequest& request,
                                                                              const runtime::Caller& caller) {
  const absl::StatusOr<Inputs> inputs = FetchInputs(*peers_, request, caller);
  if (!inputs.ok()) return inputs.status();
  const absl::StatusOr<metrology::BladeFindings> findings =
      InspectBlade(peers_->scans, *inputs, options_.threads, caller);
  if (!findings.ok()) return findings.status();
  if (findings->deviation.point_count >= kWorthNearCells) near_cells_ahead_.Begin(inputs->surface);
  return RecordOf(*inputs, *findings);
}

grpc::Status InspectionService::ReplayInspection(grpc::ServerContext* context,
                                                 const v1::ReplayInspectionRequest* request,
                                                 replay::v1::Replay* response) {
  const runtime::Caller caller = runtime::CallerOf(*context);
  const auto recorded = runtime::GetResult<v1::Inspection>(*store_, caller.deadline, "inspections", request->name(),
                                                           errors::v1::INSPECTION_NOT_FOUND, ToProto);
  if (!recorded.ok()) return ToGrpc(recorded.status());
  const auto slot = running_.Enter(caller.deadline, caller.keep_going);
  if (!slot.ok()) return ToGrpc(slot.status());
  const auto registrations = ReplayRegistrations(*peers_, *recorded, caller);
  if (!registrations.ok()) return ToGrpc(registrations.status());
  const auto now = MakeAgain(*recorded, caller);
  auto replay = runtime::ReplayOf(*recorded, now);
  if (!replay.ok()) return ToGrpc(replay.status());
  for (const replay::v1::Replay& registration : *registrations) runtime::AddInput(registration, &*replay);
  *response = *std::move(replay);
  return grpc::Status::OK;
}

absl::StatusOr<v1::Inspection> InspectionService::MakeAgain(const v1::Inspection& recorded,
                                                            const runtime::Caller& caller) const {
  const absl::StatusOr<Inputs> inputs = FetchAsRecorded(*peers_, recorded, caller);
  if (!inputs.ok()) return inputs.status();
  const absl::StatusOr<metrology::BladeFindings> findings =
      InspectBlade(peers_->scans, *inputs, options_.threads, caller);
  if (!findings.ok()) return findings.status();
  return ToProto(RecordOf(*inputs, *findings).row);
}

grpc::Status InspectionService::GetInspection(grpc::ServerContext* context, const v1::GetInspectionRequest* request,
                                              v1::Inspection* response) {
  return runtime::Answer(runtime::GetResult<v1::Inspection>(*store_, runtime::DeadlineOf(*context), "inspections",
                                                            request->name(), errors::v1::INSPECTION_NOT_FOUND, ToProto),
                         response);
}

grpc::Status InspectionService::ListInspections(grpc::ServerContext* context, const v1::ListInspectionsRequest* request,
                                                v1::ListInspectionsResponse* response) {
  storage::InspectionFilter filter;
  if (absl::Status status = runtime::ReadFilter(*request, &filter); !status.ok()) return ToGrpc(status);
  filter.reader = runtime::ReaderOf(*context);
  if (absl::Status status = runtime::CheckWorkOrder(request->work_order(), ""); !status.ok()) return ToGrpc(status);
  filter.work_order = request->work_order();
  absl::StatusOr<std::string> verdict = VerdictFilterOf(request->verdict());
  if (!verdict.ok()) return ToGrpc(verdict.status());
  filter.verdict = *std::move(verdict);
  return ToGrpc(runtime::ListResults(*store_, runtime::DeadlineOf(*context), *request, filter, ToProto, LeaveBasic,
                                     response->mutable_inspections(), response->mutable_next_page_token()));
}

}  // namespace sixpoint::inspection
