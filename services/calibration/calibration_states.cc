#include "services/calibration/calibration_states.h"

#include <chrono>
#include <functional>
#include <set>
#include <utility>

#include "services/calibration/calibration_messages.h"
#include "services/calibration/validate.h"
#include "services/runtime/errors.h"
#include "services/runtime/recorded_call.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/server.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::calibration {
namespace {

constexpr int kMostResting = 1000;  // in one answer

using storage::CalibrationState;

absl::Status CheckNotWithdrawn(const storage::CalibrationRow& row, const std::string& name, const std::string& wanted) {
  if (!row.withdrawal) return absl::OkStatus();
  return runtime::Failure(errors::v1::CALIBRATION_WITHDRAWN,
                          "name: " + name + ", withdrawn by " + row.withdrawal->requested_by + " (" +
                              row.withdrawal->reason + "), want " + wanted,
                          {{"resource", name}});
}

absl::Status CheckReleasable(const storage::CalibrationRow& row, const std::string& name, storage::Instant now) {
  if (absl::Status s = CheckNotWithdrawn(row, name, "a draft"); !s.ok()) return s;
  if (row.state != CalibrationState::kDraft)
    return runtime::Failure(
        errors::v1::CALIBRATION_NOT_A_DRAFT,
        "name: " + name + (row.is_draft ? ", released already" : ", never a draft") + ", want a draft",
        {{"resource", name}});
  if (now >= row.valid_until)
    return runtime::Failure(errors::v1::CALIBRATION_EXPIRED,
                            "name: " + name + ", its validity is over, want one that is still valid",
                            {{"resource", name}});
  return absl::OkStatus();
}

// `may` is asked of the calibration as it is when it is decided about.
template <typename Request>
absl::StatusOr<storage::CalibrationDecision> DecisionOf(
    const Request& request, std::function<absl::Status(const storage::CalibrationRow&)> may) {
  const absl::StatusOr<std::string> id = runtime::IdOf("name", "calibrations", request.name());
  if (!id.ok()) return id.status();
  storage::CalibrationDecision decision;
  decision.calibration_id = *id;
  decision.event = {request.reason(), request.requested_by(), runtime::SoftwareVersion(), {}};
  decision.check = [name = request.name(),
                    may = std::move(may)](const std::optional<storage::CalibrationRow>& calibration) -> absl::Status {
    if (!calibration)
      return runtime::Failure(errors::v1::CALIBRATION_NOT_FOUND,
                              "name: " + name + ", want a calibration that is recorded", {{"resource", name}});
    return may(*calibration);
  };
  return decision;
}

void AddResting(const std::vector<storage::JournalEntry>& derived, v1::WithdrawCalibrationResponse* response) {
  std::set<std::string> blades;
  for (const storage::JournalEntry& journal : derived) {
    const storage::RecordEntry& entry = journal.entry;
    if (entry.kind == "release" || entry.kind == "withdrawal") continue;  // decisions, not results
    response->set_resting_count(response->resting_count() + 1);
    const std::string blade = entry.blade ? runtime::NameOf("blades", *entry.blade) : "";
    if (!blade.empty() && blades.insert(blade).second) response->add_blades(blade);
    if (response->resting_size() == kMostResting) continue;
    v1::RestingResult* out = response->add_resting();
    out->set_name(entry.name);
    out->set_kind(entry.kind);
    out->set_blade(blade);
    out->set_requested_by(entry.requested_by);
    runtime::ToProto(journal.recorded.recorded_at, out->mutable_recorded_at());
  }
}

}  // namespace

absl::StatusOr<v1::Calibration> Release(storage::CalibrationWriter& store, storage::Deadline deadline,
                                        const v1::ReleaseCalibrationRequest& request) {
  if (absl::Status s = CheckEvent(request.reason(), request.requested_by(), request.request_id()); !s.ok()) return s;
  const auto decide = [&] {
    return DecisionOf(request, [&](const storage::CalibrationRow& row) {
      return CheckReleasable(row, request.name(), std::chrono::system_clock::now());
    });
  };
  const auto answer_of = [](const storage::CalibrationRow& row) -> absl::StatusOr<std::string> {
    return ToProto(row).SerializeAsString();
  };
  return runtime::RecordedCall<v1::Calibration>(
      store, "calibration.ReleaseCalibration", request, deadline, decide,
      [&](const storage::RecordedRequest& recorded, const storage::CalibrationDecision& decision) {
        return store.Release(recorded, decision, answer_of, deadline);
      });
}

absl::StatusOr<v1::WithdrawCalibrationResponse> Withdraw(storage::CalibrationWriter& store, storage::Deadline deadline,
                                                         const v1::WithdrawCalibrationRequest& request) {
  if (absl::Status s = CheckEvent(request.reason(), request.requested_by(), request.request_id()); !s.ok()) return s;
  if (request.reason().empty()) return runtime::Refuse("reason", "", "why it must not be used");
  const auto decide = [&] {
    return DecisionOf(request, [&](const storage::CalibrationRow& row) {
      return CheckNotWithdrawn(row, request.name(), "one that is not");
    });
  };
  const auto answer_of = [](const storage::WithdrawnCalibrationRow& row) -> absl::StatusOr<std::string> {
    v1::WithdrawCalibrationResponse response;
    *response.mutable_calibration() = ToProto(row.calibration);
    AddResting(row.resting, &response);
    if (row.in_force) response.set_in_force(row.in_force->name());
    return response.SerializeAsString();
  };
  return runtime::RecordedCall<v1::WithdrawCalibrationResponse>(
      store, "calibration.WithdrawCalibration", request, deadline, decide,
      [&](const storage::RecordedRequest& recorded, const storage::CalibrationDecision& decision) {
        return store.Withdraw(recorded, decision, answer_of, deadline);
      });
}

}  // namespace sixpoint::calibration
