#include "services/inspection/rejudge.h"

#include <algorithm>
#include <map>
#include <utility>

#include "services/clients/registered_pose.h"
#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/time_proto.h"
#include "storage/requests.h"

namespace sixpoint::inspection {
namespace {

constexpr std::size_t kMostInspections = 100'000;

void SetRefusal(const absl::Status& status, v1::RejudgeResponse* response) {
  v1::RejudgementRefusal& refusal = *response->mutable_refusal();
  refusal.set_code(absl::StatusCodeToString(status.code()));
  refusal.set_reason(runtime::ReasonOf(status));
  refusal.set_message(runtime::ToGrpc(status).error_message());
}

}  // namespace

absl::Status CheckRejudge(const v1::RejudgeRequest& request) {
  runtime::Refusals refusals;
  if (request.inspections().empty() == request.recall().empty())
    refusals.Add(runtime::Refuse("recall", request.recall(), "a name, or inspections; one of both"));
  if (!request.inspections().empty())
    refusals.Add(runtime::CheckNames("inspections", "inspections", request.inspections(), 1));
  if (!request.recall().empty() && !request.has_recorded_before())
    refusals.Add(runtime::Refuse("recorded_before", "unset", "a moment: a call that goes on judges the same"));
  // What this call records must not be of it when it goes on.
  if (request.has_recorded_before()) refusals.Add(runtime::CheckPast("recorded_before", request.recorded_before()));
  if (!request.sensor_calibration().empty())
    refusals.Add(runtime::IdOf("sensor_calibration", "calibrations", request.sensor_calibration()).status());
  if (!request.after().empty()) refusals.Add(runtime::IdOf("after", "inspections", request.after()).status());
  return refusals.status();
}

absl::StatusOr<std::vector<std::string>> InspectionsOf(const clients::BladePeers& peers,
                                                       const v1::RejudgeRequest& request,
                                                       const runtime::Caller& caller) {
  std::vector<std::string> names(request.inspections().begin(), request.inspections().end());
  if (request.recall().empty()) return names;
  plant::v1::RecallRequest recall;
  recall.set_name(request.recall());
  recall.add_kinds("inspection");
  recall.set_page_size(1000);
  do {
    const auto page = peers.plant.Recall(recall, caller.make_context());
    if (!page.ok()) return page.status();
    for (const plant::v1::RecordEntry& entry : page->entries())
      if (runtime::MomentOf(entry.recorded_at()) < runtime::MomentOf(request.recorded_before()))
        names.push_back(entry.name());
    if (names.size() > kMostInspections)
      return runtime::Refuse("recall", request.recall() + ", on which more than 100000 inspections rest",
                             "at most 100000; by what rests on less, or earlier");
    recall.set_page_token(page->next_page_token());
  } while (!recall.page_token().empty());
  return names;
}

absl::StatusOr<v1::InspectRequest> AskedAgain(const clients::BladePeers& peers, const v1::RejudgeRequest& request,
                                              const v1::Inspection& old, const runtime::Caller& caller) {
  const auto registration = peers.registrations.Get(old.registration(), caller.make_context());
  if (!registration.ok()) return registration.status();
  v1::InspectRequest again;
  again.set_blade(old.blade());
  *again.mutable_scans() = old.scans();
  again.set_method(old.positioning().method());
  if (registration->has_options()) *again.mutable_options() = registration->options();
  for (const registration::v1::ScanAngle& angle : registration->angles())
    if (!angle.characterisation().empty()) again.set_apply_axis_tables(true);
  again.set_sensor_calibration(request.sensor_calibration());
  again.set_request_id(storage::UuidFrom(request.request_id() + " " + old.name()));
  return again;
}

bool EndsTheCall(const absl::Status& status) {
  return absl::IsUnavailable(status) || absl::IsCancelled(status) || absl::IsDeadlineExceeded(status) ||
         absl::IsResourceExhausted(status);
}

v1::RejudgeResponse NotRead(const std::string& name, const absl::Status& status) {
  v1::RejudgeResponse response;
  response.set_rejudged(name);
  SetRefusal(status, &response);
  return response;
}

v1::RejudgeResponse Beside(const v1::Inspection& old, const absl::StatusOr<v1::Inspection>& now) {
  v1::RejudgeResponse response;
  response.set_rejudged(old.name());
  response.set_blade(old.blade());
  response.set_before(old.verdict());
  if (!now.ok()) {
    SetRefusal(now.status(), &response);
    return response;
  }
  *response.mutable_inspection() = *now;
  response.set_flips(now->verdict() != old.verdict());
  std::map<std::pair<std::string, std::string>, std::pair<v1::Verdict, v1::Verdict>> verdicts;  // before, now
  for (const v1::HoleResult& hole : old.holes()) verdicts[{hole.group(), hole.hole()}].first = hole.verdict();
  for (const v1::HoleResult& hole : now->holes()) verdicts[{hole.group(), hole.hole()}].second = hole.verdict();
  for (const auto& [hole, verdict] : verdicts) {
    if (verdict.first == verdict.second) continue;
    v1::FlippedHole& flipped = *response.add_flipped_holes();
    flipped.set_group(hole.first);
    flipped.set_hole(hole.second);
    flipped.set_before(verdict.first);
    flipped.set_now(verdict.second);
  }
  return response;
}

}  // namespace sixpoint::inspection
