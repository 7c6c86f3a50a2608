#include "services/inspection/assessment_service.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "services/inspection/assessment_inputs.h"
#include "services/inspection/assessment_messages.h"
#include "services/inspection/stored_verdict.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/computed_on.h"
#include "services/runtime/contract_words.h"
#include "services/runtime/errors.h"
#include "services/runtime/recorded_results.h"
#include "services/runtime/replay.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/server.h"

namespace sixpoint::inspection {
namespace {

using runtime::ToGrpc;

absl::Status CheckPlan(const v1::PlanAssessmentRequest& request) {
  runtime::Refusals refusals;
  refusals.Add(runtime::RevisedIdOf("drawing", "drawings", request.drawing()).status());
  if (!v1::AssessmentStage_IsValid(request.stage()) || request.stage() == v1::ASSESSMENT_STAGE_UNSPECIFIED)
    refusals.Add(runtime::Refuse("stage", std::to_string(request.stage()),
                                 "ASSESSMENT_STAGE_BEFORE_MACHINING or ASSESSMENT_STAGE_MACHINED"));
  return refusals.status();
}

std::string SummaryOf(const storage::AssessmentRow& row) {
  nlohmann::json summary = {{"verdict", row.verdict}, {"findings", row.findings.size()}};
  summary["conform"] = std::count_if(row.findings.begin(), row.findings.end(),
                                     [](const auto& finding) { return finding.verdict == "CONFORM"; });
  if (!row.fate.empty()) summary["fate"] = row.fate;
  if (!row.fate_reason.empty()) summary["reason"] = row.fate_reason;
  return summary.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

runtime::Made<storage::AssessmentRow> RecordOf(const v1::AssessBladeRequest& request, const AssessmentInputs& inputs,
                                               Assessed assessed) {
  runtime::Made<storage::AssessmentRow> made;
  storage::AssessmentRow& row = made.row;
  row.assessment_id = storage::NewUuid();
  row.blade_serial = runtime::LastSegment(request.blade());
  const auto on_machine = std::find_if(inputs.results.begin(), inputs.results.end(), [](const AssessedResult& result) {
    return !result.registration.machine().empty();
  });
  if (on_machine != inputs.results.end()) {
    row.machine_id = runtime::LastSegment(on_machine->registration.machine());
    row.machine_revision = on_machine->registration.machine_revision();
  }
  row.part_id = runtime::LastSegment(inputs.part.name());
  row.part_revision = inputs.part.revision();
  row.drawing_id = runtime::LastSegment(inputs.drawing.name());
  row.drawing_revision = inputs.drawing.revision();
  row.stage = runtime::WordOf(inputs.stage);
  row.verdict = std::move(assessed.verdict);
  row.fate = std::move(assessed.fate);
  row.fate_reason = std::move(assessed.fate_reason);
  row.findings = std::move(assessed.findings);
  row.conflicts = std::move(assessed.conflicts);
  row.results.assign(request.results().begin(), request.results().end());
  row.software_version = runtime::SoftwareVersion();
  row.computed_on = runtime::ComputedOn();
  storage::RecordEntry& entry = made.entry;
  entry.kind = "assessment";
  entry.name = runtime::NameOf("assessments", row.assessment_id);
  entry.inputs = row.results;
  entry.inputs.push_back(runtime::RevisedName("drawings", row.drawing_id, row.drawing_revision));
  entry.blade = row.blade_serial;
  if (!row.machine_id.empty()) entry.machine = row.machine_id;
  entry.method = row.stage;
  entry.software_version = row.software_version;
  entry.summary_json = SummaryOf(row);
  return made;
}

}  // namespace

AssessmentService::AssessmentService(std::shared_ptr<storage::AssessmentStore> store, AssessedStores assessed,
                                     std::shared_ptr<const clients::BladePeers> peers,
                                     const InspectionServiceOptions& options)
    : store_(std::move(store)),
      assessed_(std::move(assessed)),
      peers_(std::move(peers)),
      running_(options.pool, "assessments", errors::v1::INSPECTIONS_FULL) {}

grpc::Status AssessmentService::PlanAssessment(grpc::ServerContext* context, const v1::PlanAssessmentRequest* request,
                                               v1::AssessmentPlan* response) {
  if (absl::Status good = CheckPlan(*request); !good.ok()) return ToGrpc(good);
  const runtime::Caller caller = runtime::CallerOf(*context);
  const auto drawing = peers_->plant.GetDrawing(request->drawing(), caller.make_context());
  if (!drawing.ok()) return ToGrpc(drawing.status());
  return runtime::Answer(PlanOf(*drawing, request->stage()), response);
}

grpc::Status AssessmentService::AssessBlade(grpc::ServerContext* context, const v1::AssessBladeRequest* request,
                                            v1::Assessment* response) {
  if (absl::Status good = CheckAssess(*request); !good.ok()) return ToGrpc(good);
  const runtime::Caller caller = runtime::CallerOf(*context);
  const auto slot = running_.Enter(caller.deadline, caller.keep_going);
  if (!slot.ok()) return ToGrpc(slot.status());
  return runtime::Answer(
      runtime::RecordedResult<v1::Assessment>(
          store_.get(), "inspection.AssessBlade", *request, caller, [&] { return Make(*request, caller); }, ToProto),
      response);
}

absl::StatusOr<runtime::Made<storage::AssessmentRow>> AssessmentService::Make(const v1::AssessBladeRequest& request,
                                                                              const runtime::Caller& caller) const {
  const auto inputs = FetchAssessed(request, assessed_, *peers_, caller);
  if (!inputs.ok()) return inputs.status();
  auto assessed = Assess(*inputs, caller.keep_going);
  if (!assessed.ok()) return assessed.status();
  return RecordOf(request, *inputs, *std::move(assessed));
}

grpc::Status AssessmentService::GetAssessment(grpc::ServerContext* context, const v1::GetAssessmentRequest* request,
                                              v1::Assessment* response) {
  return runtime::Answer(runtime::GetResult<v1::Assessment>(*store_, runtime::DeadlineOf(*context), "assessments",
                                                            request->name(), errors::v1::ASSESSMENT_NOT_FOUND, ToProto),
                         response);
}

grpc::Status AssessmentService::ListAssessments(grpc::ServerContext* context, const v1::ListAssessmentsRequest* request,
                                                v1::ListAssessmentsResponse* response) {
  storage::AssessmentFilter filter;
  if (absl::Status status = runtime::ReadFilter(*request, &filter); !status.ok()) return ToGrpc(status);
  const auto verdict = VerdictFilterOf(request->verdict());
  if (!verdict.ok()) return ToGrpc(verdict.status());
  filter.verdict = *verdict;
  filter.reader = runtime::ReaderOf(*context);
  return ToGrpc(runtime::ListResults(*store_, runtime::DeadlineOf(*context), *request, filter, ToProto, LeaveBasic,
                                     response->mutable_assessments(), response->mutable_next_page_token()));
}

grpc::Status AssessmentService::ReplayAssessment(grpc::ServerContext* context,
                                                 const v1::ReplayAssessmentRequest* request,
                                                 replay::v1::Replay* response) {
  const runtime::Caller caller = runtime::CallerOf(*context);
  const auto recorded = runtime::GetResult<v1::Assessment>(*store_, caller.deadline, "assessments", request->name(),
                                                           errors::v1::ASSESSMENT_NOT_FOUND, ToProto);
  if (!recorded.ok()) return ToGrpc(recorded.status());
  const auto slot = running_.Enter(caller.deadline, caller.keep_going);
  if (!slot.ok()) return ToGrpc(slot.status());
  v1::AssessBladeRequest again;
  again.set_blade(recorded->blade());
  again.set_drawing(recorded->drawing());
  again.set_stage(recorded->stage());
  *again.mutable_results() = recorded->results();
  const auto now = [&]() -> absl::StatusOr<v1::Assessment> {
    const auto made = Make(again, caller);
    if (!made.ok()) return made.status();
    return ToProto(made->row);
  }();
  return runtime::Answer(runtime::ReplayOf(*recorded, now), response);
}

}  // namespace sixpoint::inspection
