#include "services/calibration/calibration_states.h"

#include <chrono>
#include <set>

#include "services/calibration/calibration_messages.h"
#include "services/calibration/kept_answers.h"
#include "services/calibration/validate.h"
#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/server.h"
#include "services/runtime/time_proto.h"
#include "storage/calibrations.h"
#include "storage/record.h"

namespace sixpoint::calibration {
namespace {

constexpr char kReleaseCall[] = "calibration.ReleaseCalibration";
constexpr char kWithdrawCall[] = "calibration.WithdrawCalibration";

using storage::CalibrationState;

absl::StatusOr<storage::CalibrationRow> Find(storage::Transaction& transaction, const std::string& name,
                                             storage::Instant now) {
  const absl::StatusOr<std::string> id = CalibrationIdOf("name", name);
  if (!id.ok()) return id.status();
  auto found = storage::FindCalibration(transaction, *id, now);
  if (!found.ok()) return found.status();
  if (!found->has_value())
    return runtime::Failure(errors::v1::CALIBRATION_NOT_FOUND,
                            "name: " + name + ", want a calibration that is recorded", {{"resource", name}});
  return **std::move(found);
}

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

template <typename Request>
storage::CalibrationEvent EventOf(const Request& request) {
  storage::CalibrationEvent event;
  event.reason = request.reason();
  event.requested_by = request.requested_by();
  event.software_version = runtime::SoftwareVersion();
  return event;
}

// Two that decide at once: the second finds the first one's event.
absl::Status DecidedMeanwhile(const absl::Status& status, const std::string& name) {
  if (!absl::IsAlreadyExists(status)) return status;
  return runtime::Failure(errors::v1::CALIBRATION_DECIDED_MEANWHILE,
                          "name: " + name + ", decided by another call meanwhile; look at it and try again",
                          {{"resource", name}});
}

void AddResting(const std::vector<storage::JournalEntry>& derived, v1::WithdrawCalibrationResponse* response) {
  std::set<std::string> blades;
  for (const storage::JournalEntry& journal : derived) {
    const storage::RecordEntry& entry = journal.entry;
    if (entry.kind == "release" || entry.kind == "withdrawal") continue;  // decisions, not results
    v1::RestingResult* out = response->add_resting();
    out->set_name(entry.name);
    out->set_kind(entry.kind);
    out->set_requested_by(entry.requested_by);
    runtime::ToProto(journal.recorded.recorded_at, out->mutable_recorded_at());
    if (!entry.blade) continue;
    out->set_blade(runtime::NameOf("blades", *entry.blade));
    if (blades.insert(out->blade()).second) response->add_blades(out->blade());
  }
}

}  // namespace

absl::StatusOr<v1::Calibration> Release(storage::Database* database, storage::Deadline deadline,
                                        const v1::ReleaseCalibrationRequest& request) {
  if (absl::Status s = CheckEvent(request.reason(), request.requested_by(), request.request_id()); !s.ok()) return s;
  absl::StatusOr<storage::Transaction> transaction = database->Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  auto kept = FindKept<v1::Calibration>(*transaction, kReleaseCall, request);
  if (!kept.ok()) return kept.status();
  if (kept->has_value()) return **std::move(kept);
  const storage::Instant now = std::chrono::system_clock::now();
  absl::StatusOr<storage::CalibrationRow> row = Find(*transaction, request.name(), now);
  if (!row.ok()) return row.status();
  if (absl::Status s = CheckReleasable(*row, request.name(), now); !s.ok()) return s;
  const auto recorded = storage::ReleaseCalibration(*transaction, *row, EventOf(request));
  if (!recorded.ok()) return DecidedMeanwhile(recorded.status(), request.name());
  row = Find(*transaction, request.name(), now);
  if (!row.ok()) return row.status();
  const v1::Calibration answer = ToProto(*row);
  if (absl::Status s = Keep(*transaction, kReleaseCall, request, answer); !s.ok()) return s;
  if (absl::Status s = transaction->Commit(); !s.ok()) return s;
  return answer;
}

absl::StatusOr<v1::WithdrawCalibrationResponse> Withdraw(storage::Database* database, storage::Deadline deadline,
                                                         const v1::WithdrawCalibrationRequest& request) {
  if (absl::Status s = CheckEvent(request.reason(), request.requested_by(), request.request_id()); !s.ok()) return s;
  if (request.reason().empty()) return runtime::Refuse("reason", "", "why it must not be used");
  absl::StatusOr<storage::Transaction> transaction = database->Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  auto kept = FindKept<v1::WithdrawCalibrationResponse>(*transaction, kWithdrawCall, request);
  if (!kept.ok()) return kept.status();
  if (kept->has_value()) return **std::move(kept);
  const storage::Instant now = std::chrono::system_clock::now();
  absl::StatusOr<storage::CalibrationRow> row = Find(*transaction, request.name(), now);
  if (!row.ok()) return row.status();
  if (absl::Status s = CheckNotWithdrawn(*row, request.name(), "one that is not"); !s.ok()) return s;
  const auto recorded = storage::WithdrawCalibration(*transaction, *row, EventOf(request));
  if (!recorded.ok()) return DecidedMeanwhile(recorded.status(), request.name());

  v1::WithdrawCalibrationResponse response;
  row = Find(*transaction, request.name(), now);
  if (!row.ok()) return row.status();
  *response.mutable_calibration() = ToProto(*row);
  // The journal's lock is held: nothing more can come to rest on it.
  const auto derived = storage::DerivedFrom(*transaction, row->name());
  if (!derived.ok()) return derived.status();
  AddResting(*derived, &response);
  const auto in_force = storage::CalibrationInForce(*transaction, row->subject(), now);
  if (!in_force.ok()) return in_force.status();
  if (in_force->has_value()) response.set_in_force((**in_force).name());
  if (absl::Status s = Keep(*transaction, kWithdrawCall, request, response); !s.ok()) return s;
  if (absl::Status s = transaction->Commit(); !s.ok()) return s;
  return response;
}

}  // namespace sixpoint::calibration
