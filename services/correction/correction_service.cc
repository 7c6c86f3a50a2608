#include "services/correction/correction_service.h"

#include <algorithm>
#include <cstring>
#include <set>
#include <string>
#include <utility>

#include "services/correction/adapt.h"
#include "services/correction/budget.h"
#include "services/correction/correct.h"
#include "services/correction/decide.h"
#include "services/correction/fetch.h"
#include "services/correction/messages.h"
#include "services/correction/metrics.h"
#include "services/correction/repair_program.h"
#include "services/correction/rows.h"
#include "services/correction/validate.h"
#include "services/runtime/call.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/errors.h"
#include "services/runtime/recorded_results.h"
#include "services/runtime/replay.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::correction {

using runtime::ToGrpc;

namespace {

int CutCount(const storage::CorrectionRow& row) {
  int count = 0;
  for (const storage::CorrectionGroupRow& group : row.groups)
    for (const storage::CorrectionHoleRow& hole : group.holes) count += hole.reported_cut_at.has_value();
  return count;
}

// Of the groups and paths that are corrected now.
void TakeCutBefore(const std::vector<storage::CutHoleRow>& cut, Inputs* inputs) {
  std::set<std::string> names;
  for (const metrology::NominalHoleGroup& group : inputs->groups) names.insert(group.name);
  for (const ModelPath& path : inputs->paths) names.insert(path.nominal.name);
  const auto was_measured = [&](const storage::CutHoleRow& row) {
    return inputs->looked_at_up_to && row.record_sequence <= *inputs->looked_at_up_to;
  };
  for (const storage::CutHoleRow& row : cut)
    if (names.count(row.hole.group_name) > 0 && !was_measured(row))
      inputs->cut_before.push_back(row.hole.group_name + "/" + row.hole.hole_name);
}

absl::Status ScrappedSince(const std::string& correction, const std::string& by) {
  return runtime::Failure(
      errors::v1::PROGRAM_NOT_RELEASED,
      correction + ": its blade is scrap by " + by + ", of which who released it was not told; want a new correction",
      {{"resource", correction}});
}

// Without what became of it since.
absl::StatusOr<v1::Correction> AsMade(absl::StatusOr<v1::Correction> correction) {
  if (!correction.ok()) return correction;
  correction->clear_state();
  correction->clear_usable_until();
  correction->clear_superseded_by();
  correction->clear_released();
  correction->clear_refused();
  for (v1::CorrectedGroup& group : *correction->mutable_groups())
    for (v1::CorrectedHole& hole : *group.mutable_holes()) hole.clear_reported_cut_at();
  return correction;
}

// Its paths are not the model's own, and many: it takes seconds and threads.
template <typename Message>
bool IsOnShape(const Message& correction) {
  return !correction.reconstruction().empty() || !correction.repair().empty();
}

// As it was asked for; every group that it has was wanted.
v1::CorrectRequest RequestOf(const storage::CorrectionRow& row, const v1::Correction& recorded) {
  v1::CorrectRequest request;
  request.set_registration(recorded.registration());
  request.set_repair(recorded.repair());
  // Of a repair they are its laps, which no model has.
  if (recorded.repair().empty())
    for (const storage::CorrectionGroupRow& group : row.groups) request.add_groups(group.group_name);
  request.set_machining_model(recorded.machining_model());
  if (recorded.machining_pass().empty()) request.set_reconstruction(recorded.reconstruction());
  request.set_machining_pass(recorded.machining_pass());
  if (!recorded.machining_model().empty()) return request;  // which states them
  *request.mutable_work_offsets() = recorded.work_offsets();
  *request.mutable_tool_lengths() = recorded.tool_lengths();
  return request;
}

}  // namespace

CorrectionService::CorrectionService(std::shared_ptr<storage::CorrectionStore> store,
                                     std::shared_ptr<storage::CorrectionEventStore> events, ShapeStores shapes,
                                     std::shared_ptr<const clients::BladePeers> peers, runtime::PoolLimits limits,
                                     int threads)
    : store_(std::move(store)),
      events_(std::move(events)),
      shapes_(std::move(shapes)),
      peers_(std::move(peers)),
      threads_(threads),
      running_(limits, "corrections", errors::v1::CORRECTIONS_FULL),
      on_shapes_({1, limits.waiting}, "corrections on shapes", errors::v1::CORRECTIONS_FULL) {
  Metrics();
}

grpc::Status CorrectionService::Correct(grpc::ServerContext* context, const v1::CorrectRequest* request,
                                        v1::Correction* response) {
  if (absl::Status status = CheckCorrect(*request); !status.ok()) return ToGrpc(status);
  return runtime::Answer(CorrectOnce(*request, runtime::CallerOf(*context)), response);
}

grpc::Status CorrectionService::CorrectScans(grpc::ServerContext* context, const v1::CorrectScansRequest* request,
                                             v1::Correction* response) {
  if (absl::Status status = CheckCorrectScans(*request); !status.ok()) return ToGrpc(status);
  const runtime::Caller caller = runtime::CallerOf(*context);
  // A retry finds the registration that it made.
  registration::v1::RegisterRequest to_register = request->registration();
  to_register.set_request_id(request->request_id());
  const auto registered = peers_->registrations.Register(to_register, caller.make_context());
  if (!registered.ok()) return ToGrpc(Under("registration.", registered.status()));
  v1::CorrectRequest to_correct = request->correction();
  to_correct.set_registration(registered->name());
  to_correct.set_request_id(request->request_id());
  return runtime::Answer(CorrectOnce(to_correct, caller), response);
}

absl::StatusOr<v1::Correction> CorrectionService::CorrectOnce(const v1::CorrectRequest& request,
                                                              const runtime::Caller& caller) {
  const auto slot =
      PoolOf(IsOnShape(request) || !request.machining_pass().empty()).Enter(caller.deadline, caller.keep_going);
  if (!slot.ok()) return slot.status();
  if (request.dry_run()) return DryRun(request, caller);
  bool made = false;
  std::string made_id, release;
  const auto make = [&] {
    made = true;
    auto record = Make(request, caller);
    if (record.ok()) made_id = record->row.correction_id, release = record->row.release;
    return record;
  };
  const auto recorded =
      runtime::RecordedResult<v1::Correction>(store_.get(), "correction.Correct", request, caller, make, ToProto);
  if (!recorded.ok()) return recorded.status();
  if (runtime::LastSegment(recorded->name()) == made_id) Metrics().recorded.Add(release);
  // Its blade may have been scrapped while it was computed.
  const auto scrapped = events_->ScrappedAgainst(runtime::LastSegment(recorded->name()), caller.deadline);
  if (!scrapped.ok()) return scrapped.status();
  made = made && !scrapped->has_value();
  // What it is now, of a new one too: what it rests on may have been withdrawn. A program leaves with what made it; a retry may come
  // hours later, and asks FetchProgram.
  runtime::RowMessage<v1::Correction, storage::CorrectionRow>::Maker message = ToProto;
  if (made) message = WithProgram;
  return runtime::GetResult<v1::Correction>(*store_, caller.deadline, "corrections", recorded->name(),
                                            errors::v1::CORRECTION_NOT_FOUND, message);
}

absl::StatusOr<Inputs> CorrectionService::OnItsShape(absl::StatusOr<Inputs> inputs,
                                                     const runtime::Caller& caller) const {
  if (!inputs.ok()) return inputs;
  absl::Status adapted = AdaptToShape(shapes_, *peers_, threads_, caller, &*inputs);
  if (adapted.ok()) adapted = GoAlongRepair(shapes_, caller, &*inputs);
  if (!adapted.ok()) return adapted;
  return inputs;
}

absl::StatusOr<runtime::Made<storage::CorrectionRow>> CorrectionService::Make(const v1::CorrectRequest& request,
                                                                              const runtime::Caller& caller) const {
  absl::StatusOr<Inputs> inputs = OnItsShape(FetchInputs(*peers_, request, caller), caller);
  if (!inputs.ok()) return inputs.status();
  const auto cut = events_->CutHoles(runtime::LastSegment(inputs->registration.blade()), caller.deadline);
  if (!cut.ok()) return cut.status();
  TakeCutBefore(*cut, &*inputs);
  const auto scrapped = events_->ScrappedBy(runtime::LastSegment(inputs->registration.blade()), caller.deadline);
  if (!scrapped.ok()) return scrapped.status();
  if (scrapped->has_value()) inputs->scrapped_by = {**scrapped};
  const absl::StatusOr<Corrected> corrected = CorrectBlade(*inputs, caller.keep_going);
  if (!corrected.ok()) return corrected.status();
  return RecordOf(*inputs, *corrected);
}

grpc::Status CorrectionService::ReplayCorrection(grpc::ServerContext* context,
                                                 const v1::ReplayCorrectionRequest* request,
                                                 replay::v1::Replay* response) {
  const runtime::Caller caller = runtime::CallerOf(*context);
  const auto row =
      runtime::FindRow(*store_, caller.deadline, "corrections", request->name(), errors::v1::CORRECTION_NOT_FOUND);
  if (!row.ok()) return ToGrpc(row.status());
  const auto recorded = AsMade(ToProto(*row));
  if (!recorded.ok()) return ToGrpc(recorded.status());
  const auto nc_template = events_->TemplateOf(*row, caller.deadline);
  if (!nc_template.ok() && !absl::IsDataLoss(nc_template.status())) return ToGrpc(nc_template.status());
  const auto slot = PoolOf(IsOnShape(*recorded)).Enter(caller.deadline, caller.keep_going);
  if (!slot.ok()) return ToGrpc(slot.status());
  auto registration = peers_->registrations.Replay(recorded->registration(), caller.make_context());
  if (!registration.ok()) return ToGrpc(registration.status());
  const absl::StatusOr<v1::Correction> now =
      nc_template.ok() ? AsMade(MakeAgain(*row, *nc_template, *recorded, caller)) : nc_template.status();
  auto replay = runtime::ReplayOf(*recorded, now);
  if (!replay.ok()) return ToGrpc(replay.status());
  for (const v1::ReleaseCheck& check : recorded->checks())
    if (IsOfTheMoment(check.kind()))
      replay->add_taken_as_recorded("checks[" + v1::ReleaseCheckKind_Name(check.kind()) + "]");
  if (!recorded->reconstruction().empty()) replay->add_taken_as_recorded("reconstruction");
  if (!recorded->machining_pass().empty()) replay->add_taken_as_recorded("machining_pass");
  if (!recorded->repair().empty()) replay->add_taken_as_recorded("repair");
  runtime::AddInput(*std::move(registration), &*replay);
  *response = *std::move(replay);
  return grpc::Status::OK;
}

grpc::Status CorrectionService::ComputeBudget(grpc::ServerContext* context, const v1::ComputeBudgetRequest* request,
                                              v1::Budget* response) {
  const runtime::Caller caller = runtime::CallerOf(*context);
  const auto row =
      runtime::FindRow(*store_, caller.deadline, "corrections", request->name(), errors::v1::CORRECTION_NOT_FOUND);
  if (!row.ok()) return ToGrpc(row.status());
  const auto recorded = AsMade(ToProto(*row));
  if (!recorded.ok()) return ToGrpc(recorded.status());
  const auto slot = PoolOf(IsOnShape(*recorded)).Enter(caller.deadline, caller.keep_going);
  if (!slot.ok()) return ToGrpc(slot.status());
  const auto inputs = OnItsShape(FetchAsRecorded(*peers_, *recorded, RequestOf(*row, *recorded), caller), caller);
  if (!inputs.ok()) return ToGrpc(inputs.status());
  return runtime::Answer(BudgetOf(*inputs, request->draws(), caller.keep_going), response);
}

absl::StatusOr<v1::Correction> CorrectionService::MakeAgain(const storage::CorrectionRow& row,
                                                            const std::string& nc_template,
                                                            const v1::Correction& recorded,
                                                            const runtime::Caller& caller) const {
  v1::CorrectRequest request = RequestOf(row, recorded);
  if (recorded.machining_model().empty()) request.set_nc_template(nc_template);  // else its revision has the same
  const absl::StatusOr<Inputs> inputs = OnItsShape(FetchAsRecorded(*peers_, recorded, request, caller), caller);
  if (!inputs.ok()) return inputs.status();
  const absl::StatusOr<Corrected> corrected = CorrectBlade(*inputs, caller.keep_going);
  if (!corrected.ok()) return corrected.status();
  storage::CorrectionRow made = RecordOf(*inputs, *corrected).row;
  std::sort(made.characterisation_ids.begin(), made.characterisation_ids.end());  // as they are read
  return ToProto(made);
}

absl::StatusOr<v1::Correction> CorrectionService::DryRun(const v1::CorrectRequest& request,
                                                         const runtime::Caller& caller) const {
  auto made = Make(request, caller);
  if (!made.ok()) return made.status();
  made->row.requested_by = caller.requested_by;
  absl::StatusOr<v1::Correction> correction = ToProto(made->row);
  if (!correction.ok()) return correction;
  correction->clear_name();
  correction->clear_state();
  correction->clear_recorded_at();
  correction->clear_program_sha256();
  return correction;
}

template <typename Request>
absl::StatusOr<v1::Correction> CorrectionService::Decided(const char* call, const Request& request,
                                                          const runtime::Caller& caller) const {
  const absl::StatusOr<storage::CorrectionDecision> decision = Decide(request, caller.requested_by);
  if (!decision.ok()) return decision.status();
  const auto decided =
      events_->Decide(runtime::RecordedRequestOf(call, request, caller.trace_id), *decision, caller.deadline);
  if (!decided.ok()) return decided.status();
  Metrics().decided.Add(decision->event);
  return ToProto(*decided);
}

grpc::Status CorrectionService::ReleaseCorrection(grpc::ServerContext* context,
                                                  const v1::ReleaseCorrectionRequest* request,
                                                  v1::Correction* response) {
  const runtime::Caller caller = runtime::CallerOf(*context);
  if (absl::Status status = CheckToldOfScrap(request->name(), caller); !status.ok()) return ToGrpc(status);
  return runtime::Answer(Decided("correction.ReleaseCorrection", *request, caller), response);
}

// Who releases sees what the gate saw: a blade that was scrapped since needs a new correction, whose gate says so.
absl::Status CorrectionService::CheckToldOfScrap(const std::string& name, const runtime::Caller& caller) const {
  const auto found = store_->Find(runtime::LastSegment(name), caller.deadline);
  if (!found.ok() || !found->has_value()) return found.status();  // the decision says that there is none
  const auto& checks = (*found)->checks;
  if (std::any_of(checks.begin(), checks.end(), [](const auto& check) { return check.kind == "SCRAPPED"; }))
    return absl::OkStatus();
  const auto scrapped = events_->ScrappedBy((*found)->blade_serial, caller.deadline);
  if (!scrapped.ok()) return scrapped.status();
  return scrapped->has_value() ? ScrappedSince(name, **scrapped) : absl::OkStatus();
}

grpc::Status CorrectionService::RefuseCorrection(grpc::ServerContext* context,
                                                 const v1::RefuseCorrectionRequest* request, v1::Correction* response) {
  return runtime::Answer(Decided("correction.RefuseCorrection", *request, runtime::CallerOf(*context)), response);
}

grpc::Status CorrectionService::FetchProgram(grpc::ServerContext* context, const v1::FetchProgramRequest* request,
                                             v1::FetchProgramResponse* response) {
  if (absl::Status status = CheckFetch(*request); !status.ok()) return ToGrpc(status);
  const runtime::Caller caller = runtime::CallerOf(*context);
  const auto slot = running_.Enter(caller.deadline, caller.keep_going);
  if (!slot.ok()) return ToGrpc(slot.status());
  return runtime::Answer(Fetch(*request, caller), response);
}

absl::StatusOr<v1::FetchProgramResponse> CorrectionService::Fetch(const v1::FetchProgramRequest& request,
                                                                  const runtime::Caller& caller) const {
  const storage::RecordedRequest recorded =
      runtime::RecordedRequestOf("correction.FetchProgram", request, caller.trace_id);
  const auto found = store_->Find(runtime::LastSegment(request.name()), caller.deadline);
  if (!found.ok()) return found.status();
  if (!found->has_value()) return NotRecorded(request.name());
  const storage::CorrectionRow& correction = **found;
  if (absl::Status status = CheckFetchable(correction, request); !status.ok()) return status;
  const auto registration = StandingRegistration(correction, *peers_, caller);
  if (!registration.ok()) return registration.status();
  const auto scrapped = events_->ScrappedAgainst(correction.correction_id, caller.deadline);
  if (!scrapped.ok()) return scrapped.status();
  if (scrapped->has_value()) return ScrappedSince(request.name(), **scrapped);
  const auto before = events_->FindFetch(recorded, caller.deadline);
  if (!before.ok()) return before.status();
  if (before->has_value()) {
    // What it gave then would cut again what was cut since.
    if ((**before).cut_count == CutCount(correction)) return ResponseOf(**before, correction);
    return runtime::Failure(errors::v1::CORRECTION_DECIDED_MEANWHILE,
                            request.name() + ": holes were cut since it was fetched, want a new request_id", {});
  }
  const absl::StatusOr<storage::ProgramFetchRow> fetch = FetchOf(request, correction, *registration, *peers_, caller);
  if (!fetch.ok()) return fetch.status();
  // Asked again where nothing can come between: it may have been stopped or cut while this was made.
  const auto check = [&](const std::optional<storage::CorrectionRow>& now) -> absl::Status {
    if (!now.has_value()) return NotRecorded(request.name());
    if (absl::Status status = CheckFetchable(*now, request); !status.ok()) return status;
    return CutCount(*now) == fetch->cut_count
               ? absl::OkStatus()
               : runtime::Failure(errors::v1::CORRECTION_DECIDED_MEANWHILE,
                                  request.name() + ": holes were reported cut meanwhile; call again", {});
  };
  const auto stored = events_->RecordFetch(recorded, *fetch, check, caller.deadline);
  if (!stored.ok()) return stored.status();
  return ResponseOf(*stored, correction);
}

grpc::Status CorrectionService::ReportCut(grpc::ServerContext* context, const v1::ReportCutRequest* request,
                                          v1::Correction* response) {
  const runtime::Caller caller = runtime::CallerOf(*context);
  const absl::StatusOr<storage::CutReport> report = ReportOf(*request, caller.requested_by);
  if (!report.ok()) return ToGrpc(report.status());
  const auto reported = events_->ReportCut(
      runtime::RecordedRequestOf("correction.ReportCut", *request, caller.trace_id), *report, caller.deadline);
  if (!reported.ok()) return ToGrpc(reported.status());
  return runtime::Answer(ToProto(*reported), response);
}

grpc::Status CorrectionService::GetCorrection(grpc::ServerContext* context, const v1::GetCorrectionRequest* request,
                                              v1::Correction* response) {
  return runtime::Answer(runtime::GetResult<v1::Correction>(*store_, runtime::DeadlineOf(*context), "corrections",
                                                            request->name(), errors::v1::CORRECTION_NOT_FOUND, ToProto),
                         response);
}

grpc::Status CorrectionService::ListCorrections(grpc::ServerContext* context, const v1::ListCorrectionsRequest* request,
                                                v1::ListCorrectionsResponse* response) {
  storage::CorrectionFilter filter;
  if (absl::Status status = runtime::ReadFilter(*request, &filter); !status.ok()) return ToGrpc(status);
  filter.reader = runtime::ReaderOf(*context);
  if (!v1::Release_IsValid(request->release()))
    return ToGrpc(runtime::Refuse("release", std::to_string(request->release()), "a release, or none"));
  if (request->release() != v1::RELEASE_UNSPECIFIED)
    filter.release = v1::Release_Name(request->release()).substr(std::strlen("RELEASE_"));
  if (!v1::CorrectionState_IsValid(request->state()))
    return ToGrpc(runtime::Refuse("state", std::to_string(request->state()), "a state, or none"));
  if (request->state() != v1::CORRECTION_STATE_UNSPECIFIED)
    filter.state = v1::CorrectionState_Name(request->state()).substr(std::strlen("CORRECTION_STATE_"));
  return ToGrpc(runtime::ListResults(*store_, runtime::DeadlineOf(*context), *request, filter, ToProto, LeaveBasic,
                                     response->mutable_corrections(), response->mutable_next_page_token()));
}

}  // namespace sixpoint::correction
