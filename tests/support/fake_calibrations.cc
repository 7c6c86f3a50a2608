#include "tests/support/fake_calibrations.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "storage/blobs.h"

namespace sixpoint::testing {

using storage::CalibrationRow;
using storage::CalibrationState;
using storage::CalibrationSubject;
using storage::Instant;

namespace {

// What is empty matches all.
bool Matches(const CalibrationSubject& wanted, const CalibrationSubject& subject) {
  return (wanted.machine_id.empty() || wanted.machine_id == subject.machine_id) &&
         (wanted.kind.empty() || wanted.kind == subject.kind) && (wanted.axis.empty() || wanted.axis == subject.axis);
}

bool IsOf(const CalibrationRow& row, const CalibrationSubject& subject) {
  const CalibrationSubject own = row.subject();
  return own.machine_id == subject.machine_id && own.kind == subject.kind && own.axis == subject.axis;
}

bool Covers(const CalibrationRow& row, Instant at) { return row.valid_from <= at && at < row.valid_until; }

// Released, or never a draft; and not withdrawn.
bool HasForce(const CalibrationRow& row) { return (!row.is_draft || row.release) && !row.withdrawal; }

std::int64_t ForceSequence(const CalibrationRow& row) {
  return row.is_draft ? row.release->recorded.sequence : row.recorded.sequence;
}

CalibrationRow WithoutResiduals(CalibrationRow row) {
  if (row.sensor) row.sensor->centres.clear();
  if (row.rotation) row.rotation->poses.clear();
  if (row.probe) row.probe->readings.clear();
  if (row.probe) row.probe->checks.clear();
  if (row.axis) row.axis->forward_error_deg.clear();
  if (row.axis) row.axis->backward_error_deg.clear();
  return row;
}

}  // namespace

void FakeCalibrations::Fail(absl::Status failure) {
  const auto lock = record_.Lock();
  record_.Fail(std::move(failure));
}

void FakeCalibrations::SetClockAhead(std::chrono::hours ahead) {
  const auto lock = record_.Lock();
  ahead_ = ahead;
}

Instant FakeCalibrations::ClockNow() const { return std::chrono::system_clock::now() + ahead_; }

std::vector<storage::JournalEntry> FakeCalibrations::entries() const {
  const auto lock = record_.Lock();
  return record_.entries();
}

const CalibrationRow* FakeCalibrations::Newest(const CalibrationSubject& subject, Instant at) const {
  const CalibrationRow* newest = nullptr;
  for (const CalibrationRow& row : rows_)
    if (IsOf(row, subject) && HasForce(row) && Covers(row, at) &&
        (newest == nullptr || ForceSequence(row) > ForceSequence(*newest)))
      newest = &row;
  return newest;
}

CalibrationRow FakeCalibrations::AsOf(CalibrationRow row, Instant at) const {
  row.as_of = at;
  const CalibrationRow* newest = Newest(row.subject(), at);
  const bool superseded = newest != nullptr && newest->calibration_id != row.calibration_id;
  row.state = row.withdrawal                 ? CalibrationState::kWithdrawn
              : row.is_draft && !row.release ? CalibrationState::kDraft
              : at < row.valid_from          ? CalibrationState::kNotYetValid
              : at >= row.valid_until        ? CalibrationState::kExpired
              : superseded                   ? CalibrationState::kSuperseded
                                             : CalibrationState::kInForce;
  if (row.state == CalibrationState::kSuperseded) row.superseded_by = newest->calibration_id;
  return row;
}

std::optional<CalibrationRow> FakeCalibrations::Known(const std::string& calibration_id) const {
  for (const CalibrationRow& row : rows_)
    if (row.calibration_id == calibration_id) return AsOf(row, ClockNow());
  return std::nullopt;
}

absl::StatusOr<Instant> FakeCalibrations::Now(storage::Deadline) const {
  const auto lock = record_.Lock();
  if (!record_.failure().ok()) return record_.failure();
  return ClockNow();
}

FakeCalibrations::Found FakeCalibrations::FindRecorded(const storage::RecordedRequest& request,
                                                       storage::Deadline) const {
  const auto lock = record_.Lock();
  return record_.Kept<CalibrationRow>(request, [this](const std::string& id) { return Known(id); });
}

FakeCalibrations::Found FakeCalibrations::Find(const std::string& calibration_id, storage::Deadline) const {
  const auto lock = record_.Lock();
  if (!record_.failure().ok()) return record_.failure();
  return Known(calibration_id);
}

FakeCalibrations::Found FakeCalibrations::InForce(const CalibrationSubject& subject, Instant at,
                                                  storage::Deadline) const {
  const auto lock = record_.Lock();
  if (!record_.failure().ok()) return record_.failure();
  const CalibrationRow* newest = Newest(subject, at);
  if (newest == nullptr) return std::nullopt;
  return AsOf(*newest, at);
}

FakeCalibrations::Found FakeCalibrations::Withdrawn(const CalibrationSubject& subject, Instant at,
                                                    storage::Deadline) const {
  const auto lock = record_.Lock();
  if (!record_.failure().ok()) return record_.failure();
  const CalibrationRow* newest = nullptr;
  for (const CalibrationRow& row : rows_)
    if (IsOf(row, subject) && row.withdrawal && Covers(row, at) &&
        (newest == nullptr || row.withdrawal->recorded.sequence > newest->withdrawal->recorded.sequence))
      newest = &row;
  if (newest == nullptr) return std::nullopt;
  return AsOf(*newest, at);
}

absl::StatusOr<std::optional<Instant>> FakeCalibrations::LastValidity(const CalibrationSubject& subject, Instant at,
                                                                      storage::Deadline) const {
  const auto lock = record_.Lock();
  if (!record_.failure().ok()) return record_.failure();
  std::optional<Instant> last;
  for (const CalibrationRow& row : rows_)
    if (IsOf(row, subject) && HasForce(row) && row.valid_from <= at)
      last = std::max(last, std::optional(row.valid_until));
  return last;
}

absl::StatusOr<std::vector<CalibrationRow>> FakeCalibrations::List(const storage::CalibrationFilter& filter,
                                                                   std::int64_t before_sequence, int limit,
                                                                   storage::Deadline) const {
  const auto lock = record_.Lock();
  if (!record_.failure().ok()) return record_.failure();
  std::vector<CalibrationRow> listed;
  for (auto row = rows_.rbegin(); row != rows_.rend() && static_cast<int>(listed.size()) < limit; ++row) {
    CalibrationRow found = AsOf(*row, ClockNow());
    if ((before_sequence == 0 || row->recorded.sequence < before_sequence) && Matches(filter.subject, row->subject()) &&
        (!filter.state || *filter.state == found.state) && Contains(filter.recorded, row->recorded.recorded_at))
      listed.push_back(filter.with_residuals ? std::move(found) : WithoutResiduals(std::move(found)));
  }
  return listed;
}

absl::StatusOr<std::vector<CalibrationRow>> FakeCalibrations::History(const CalibrationSubject& subject, int limit,
                                                                      storage::Deadline) const {
  const auto lock = record_.Lock();
  if (!record_.failure().ok()) return record_.failure();
  std::vector<CalibrationRow> history;
  for (const CalibrationRow& row : rows_)
    if (IsOf(row, subject) && HasForce(row)) history.push_back(WithoutResiduals(AsOf(row, ClockNow())));
  std::sort(history.begin(), history.end(), [](const CalibrationRow& a, const CalibrationRow& b) {
    return std::pair(a.valid_from, ForceSequence(a)) < std::pair(b.valid_from, ForceSequence(b));
  });
  if (static_cast<int>(history.size()) > limit) history.erase(history.begin(), history.end() - limit);
  std::sort(history.begin(), history.end(), [](const CalibrationRow& a, const CalibrationRow& b) {
    return std::pair(a.valid_from, a.recorded.sequence) < std::pair(b.valid_from, b.recorded.sequence);
  });
  return history;
}

absl::StatusOr<CalibrationRow> FakeCalibrations::Record(const storage::RecordedRequest& request,
                                                        CalibrationRow calibration, const storage::RecordEntry& entry,
                                                        storage::Deadline) {
  const auto lock = record_.Lock();
  const auto work = [&]() -> absl::StatusOr<CalibrationRow> {
    calibration.request_sha256 = storage::Sha256Hex(request.bytes);
    calibration.recorded = record_.Next();
    rows_.push_back(std::move(calibration));
    record_.Append(entry, rows_.back().recorded);
    return AsOf(rows_.back(), ClockNow());
  };
  return record_.Once<CalibrationRow>(
      request, [this](const std::string& id) { return Known(id); }, work,
      [](const CalibrationRow& row) { return row.calibration_id; });
}

absl::StatusOr<CalibrationRow> FakeCalibrations::Release(const storage::RecordedRequest& request,
                                                         const storage::CalibrationDecision& decision,
                                                         storage::Deadline) {
  const auto lock = record_.Lock();
  return record_.Once<CalibrationRow>(
      request, [this](const std::string& id) { return Known(id); },
      [&] { return Decide(decision, "release", &CalibrationRow::release); },
      [](const CalibrationRow& row) { return row.calibration_id; });
}

storage::WithdrawnCalibrationRow FakeCalibrations::WhatIsLeftOf(const CalibrationRow& calibration) const {
  storage::WithdrawnCalibrationRow withdrawn;
  withdrawn.calibration = calibration;
  withdrawn.resting = record_.DerivedFrom(calibration.name());
  if (const CalibrationRow* newest = Newest(calibration.subject(), ClockNow()))
    withdrawn.in_force = AsOf(*newest, ClockNow());
  return withdrawn;
}

absl::StatusOr<storage::WithdrawnCalibrationRow> FakeCalibrations::Withdraw(
    const storage::RecordedRequest& request, const storage::CalibrationDecision& decision, storage::Deadline) {
  const auto lock = record_.Lock();
  const auto find = [this](const std::string& id) -> std::optional<storage::WithdrawnCalibrationRow> {
    const std::optional<CalibrationRow> known = Known(id);
    return known ? std::optional(WhatIsLeftOf(*known)) : std::nullopt;
  };
  const auto work = [&]() -> absl::StatusOr<storage::WithdrawnCalibrationRow> {
    const absl::StatusOr<CalibrationRow> calibration = Decide(decision, "withdrawal", &CalibrationRow::withdrawal);
    if (!calibration.ok()) return calibration.status();
    return WhatIsLeftOf(*calibration);
  };
  return record_.Once<storage::WithdrawnCalibrationRow>(
      request, find, work, [](const storage::WithdrawnCalibrationRow& row) { return row.calibration.calibration_id; });
}

absl::StatusOr<CalibrationRow> FakeCalibrations::Decide(const storage::CalibrationDecision& decision,
                                                        const std::string& kind, Event CalibrationRow::*event) {
  const auto row = std::find_if(rows_.begin(), rows_.end(), [&](const CalibrationRow& one) {
    return one.calibration_id == decision.calibration_id;
  });
  const absl::Status may = decision.check(row == rows_.end() ? std::nullopt : std::optional(AsOf(*row, ClockNow())));
  if (!may.ok()) return may;
  if ((*row).*event) return absl::AbortedError("calibration " + decision.calibration_id + ": decided already");
  storage::CalibrationEvent decided = decision.event;
  decided.recorded = record_.Next();
  (*row).*event = decided;
  storage::RecordEntry entry;
  entry.kind = kind;
  entry.name = kind + "s/" + decision.calibration_id;
  entry.inputs = {row->name()};
  entry.machine = row->machine_id;
  entry.requested_by = decided.requested_by;
  entry.software_version = decided.software_version;
  record_.Append(std::move(entry), decided.recorded);
  return AsOf(*row, ClockNow());
}

}  // namespace sixpoint::testing
