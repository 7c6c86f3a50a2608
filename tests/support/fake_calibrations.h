// A CalibrationStore in memory: what handlers are tested on without PostgreSQL. Held to the real one by
// tests/storage/calibration_store_test.cc.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "storage/calibration_store.h"
#include "tests/support/fake_record.h"

namespace sixpoint::testing {

class FakeCalibrations final : public storage::CalibrationStore {
 public:
  using Row = storage::CalibrationRow;
  using Found = absl::StatusOr<std::optional<Row>>;

  // Every call fails with it from now on, as where the database is away; OK ends that.
  void Fail(absl::Status failure);
  // The store's clock is so much ahead of ours from now on.
  void SetClockAhead(std::chrono::hours ahead);
  std::vector<storage::JournalEntry> entries() const;

  absl::StatusOr<storage::Instant> Now(storage::Deadline) const override;
  Found FindRecorded(const storage::RecordedRequest& request, storage::Deadline) const override;
  Found Find(const std::string& calibration_id, storage::Deadline) const override;
  Found InForce(const storage::CalibrationSubject& subject, storage::Instant at, storage::Deadline) const override;
  Found Withdrawn(const storage::CalibrationSubject& subject, storage::Instant at, storage::Deadline) const override;
  absl::StatusOr<std::optional<storage::Instant>> LastValidity(const storage::CalibrationSubject& subject,
                                                               storage::Instant at, storage::Deadline) const override;
  absl::StatusOr<std::vector<Row>> List(const storage::CalibrationFilter& filter, std::int64_t before_sequence,
                                        int limit, storage::Deadline) const override;
  absl::StatusOr<std::vector<Row>> History(const storage::CalibrationSubject& subject, int limit,
                                           storage::Deadline) const override;

  absl::StatusOr<Row> Record(const storage::RecordedRequest& request, Row calibration,
                             const storage::RecordEntry& entry, storage::Deadline) override;
  absl::StatusOr<Row> Release(const storage::RecordedRequest& request, const storage::CalibrationDecision& decision,
                              storage::Deadline) override;
  absl::StatusOr<storage::WithdrawnCalibrationRow> Withdraw(const storage::RecordedRequest& request,
                                                            const storage::CalibrationDecision& decision,
                                                            storage::Deadline) override;

 private:
  storage::Instant ClockNow() const;
  using Event = std::optional<storage::CalibrationEvent>;
  // Of those that were released and not withdrawn and that are wanted, the one released (or made) last.
  const Row* Newest(const storage::CalibrationSubject& subject, storage::Instant at) const;
  Row AsOf(Row row, storage::Instant at) const;  // with its state
  std::optional<Row> Known(const std::string& calibration_id) const;
  storage::WithdrawnCalibrationRow WhatIsLeftOf(const Row& calibration) const;
  // Checks and records a decision as `event` of the calibration.
  absl::StatusOr<Row> Decide(const storage::CalibrationDecision& decision, const std::string& kind, Event Row::*event);

  FakeRecord record_;
  std::chrono::hours ahead_{0};
  std::vector<Row> rows_;  // as recorded, with what was decided since
};

}  // namespace sixpoint::testing
