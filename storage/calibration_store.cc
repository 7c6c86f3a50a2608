#include "storage/calibration_store.h"

#include <chrono>
#include <utility>

#include "storage/blobs.h"
#include "storage/one_read.h"
#include "storage/reasons.h"
#include "storage/requests.h"

namespace sixpoint::storage {
namespace {

Instant Now() { return std::chrono::system_clock::now(); }

// The calibration as it reads in this transaction: its state depends on what else there is.
absl::StatusOr<CalibrationRow> ReadAgain(Transaction& transaction, const std::string& calibration_id) {
  absl::StatusOr<std::optional<CalibrationRow>> found = FindCalibration(transaction, calibration_id);
  if (!found.ok()) return found.status();
  if (!found->has_value()) return absl::DataLossError("calibration " + calibration_id + ": not stored");
  return **std::move(found);
}

// Checks and records a decision; the calibration as it is after it.
absl::StatusOr<CalibrationRow> Decide(Transaction& transaction, const CalibrationDecision& decision,
                                      absl::StatusOr<Recorded> (*record)(Transaction&, const CalibrationRow&,
                                                                         const CalibrationEvent&)) {
  const absl::StatusOr<std::optional<CalibrationRow>> found = FindCalibration(transaction, decision.calibration_id);
  if (!found.ok()) return found.status();
  if (absl::Status status = decision.check(*found); !status.ok()) return status;
  const absl::StatusOr<Recorded> recorded = record(transaction, **found, decision.event);
  // Two that decide at once: the second is tried again, and then its check finds the first one's event.
  if (absl::IsAlreadyExists(recorded.status()))
    return WithReason(absl::AbortedError("calibration " + decision.calibration_id +
                                         ": decided by another call meanwhile; look at it and try again"),
                      kCalibrationDecidedMeanwhile);
  if (!recorded.ok()) return recorded.status();
  return ReadAgain(transaction, decision.calibration_id);
}

class PostgresCalibrations final : public CalibrationStore {
 public:
  explicit PostgresCalibrations(Database* database) : database_(database) {}

  absl::StatusOr<std::optional<CalibrationRow>> Find(const std::string& calibration_id,
                                                     Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) { return FindCalibration(t, calibration_id); });
  }
  absl::StatusOr<std::optional<CalibrationRow>> InForce(const CalibrationSubject& subject, Instant at,
                                                        Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) { return CalibrationInForce(t, subject, at); });
  }
  absl::StatusOr<std::optional<CalibrationRow>> Withdrawn(const CalibrationSubject& subject, Instant at,
                                                          Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) { return WithdrawnCalibration(t, subject, at); });
  }
  absl::StatusOr<std::optional<Instant>> LastValidity(const CalibrationSubject& subject, Instant at,
                                                      Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) { return storage::LastValidity(t, subject, at); });
  }
  absl::StatusOr<std::vector<CalibrationRow>> List(const CalibrationFilter& filter, std::int64_t before_sequence,
                                                   int limit, Deadline deadline) const override {
    return OneRead(*database_, deadline,
                   [&](Transaction& t) { return ListCalibrations(t, filter, before_sequence, limit); });
  }
  absl::StatusOr<std::vector<CalibrationRow>> History(const CalibrationSubject& subject, int limit,
                                                      Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) { return CalibrationHistory(t, subject, limit); });
  }

  absl::StatusOr<std::optional<std::string>> FindAnswer(const RecordedRequest& request,
                                                        Deadline deadline) const override {
    return storage::FindAnswer(*database_, request, deadline);
  }
  absl::StatusOr<std::string> Record(const RecordedRequest& request, CalibrationRow calibration,
                                     const RecordEntry& entry, const AnswerOf<CalibrationRow>& answer_of,
                                     Deadline deadline) override {
    return RecordOnce(*database_, request, deadline, [&](Transaction& transaction) -> absl::StatusOr<std::string> {
      absl::StatusOr<std::string> sha256 = PutBlob(transaction, request.bytes);
      if (!sha256.ok()) return sha256.status();
      calibration.request_sha256 = *std::move(sha256);
      const absl::StatusOr<Recorded> recorded = InsertCalibration(transaction, calibration, entry);
      if (!recorded.ok()) return recorded.status();
      const absl::StatusOr<CalibrationRow> stored = ReadAgain(transaction, calibration.calibration_id);
      if (!stored.ok()) return stored.status();
      return answer_of(*stored);
    });
  }
  absl::StatusOr<std::string> Release(const RecordedRequest& request, const CalibrationDecision& decision,
                                      const AnswerOf<CalibrationRow>& answer_of, Deadline deadline) override {
    return RecordOnce(*database_, request, deadline, [&](Transaction& transaction) -> absl::StatusOr<std::string> {
      const absl::StatusOr<CalibrationRow> released = Decide(transaction, decision, ReleaseCalibration);
      if (!released.ok()) return released.status();
      return answer_of(*released);
    });
  }
  absl::StatusOr<std::string> Withdraw(const RecordedRequest& request, const CalibrationDecision& decision,
                                       const AnswerOf<WithdrawnCalibrationRow>& answer_of, Deadline deadline) override {
    return RecordOnce(*database_, request, deadline, [&](Transaction& transaction) -> absl::StatusOr<std::string> {
      absl::StatusOr<CalibrationRow> calibration = Decide(transaction, decision, WithdrawCalibration);
      if (!calibration.ok()) return calibration.status();
      WithdrawnCalibrationRow withdrawn;
      withdrawn.calibration = *std::move(calibration);
      // The journal's lock is held: nothing more can come to rest on it.
      auto resting = DerivedFrom(transaction, withdrawn.calibration.name());
      if (!resting.ok()) return resting.status();
      withdrawn.resting = *std::move(resting);
      auto in_force = CalibrationInForce(transaction, withdrawn.calibration.subject(), Now());
      if (!in_force.ok()) return in_force.status();
      withdrawn.in_force = *std::move(in_force);
      return answer_of(withdrawn);
    });
  }

 private:
  Database* const database_;
};

}  // namespace

std::shared_ptr<CalibrationStore> CalibrationsIn(Database* database) {
  return std::make_shared<PostgresCalibrations>(database);
}

}  // namespace sixpoint::storage
