#include "storage/calibration_store.h"

#include <utility>

#include "storage/blobs.h"
#include "storage/one_read.h"
#include "storage/reasons.h"
#include "storage/requests.h"

namespace sixpoint::storage {
namespace {

// The calibration as it reads in this transaction: its state depends on what else there is.
absl::StatusOr<CalibrationRow> ReadCalibrationAgain(Transaction& transaction, const std::string& calibration_id) {
  absl::StatusOr<std::optional<CalibrationRow>> found = FindCalibration(transaction, calibration_id);
  if (!found.ok()) return found.status();
  if (!found->has_value()) return absl::DataLossError("calibration " + calibration_id + ": not stored");
  return **std::move(found);
}

// Checks and records a decision; the calibration as it is after it.
absl::StatusOr<CalibrationRow> Decide(Transaction& transaction, const RecordedRequest& request,
                                      const CalibrationDecision& decision,
                                      absl::StatusOr<Recorded> (*record)(Transaction&, const CalibrationRow&,
                                                                         const CalibrationEvent&,
                                                                         const std::optional<KeptRequest>&)) {
  const absl::StatusOr<std::optional<CalibrationRow>> found = FindCalibration(transaction, decision.calibration_id);
  if (!found.ok()) return found.status();
  if (absl::Status status = decision.check(*found); !status.ok()) return status;
  const absl::StatusOr<Recorded> recorded = record(transaction, **found, decision.event, KeptRequestOf(request));
  // Two that decide at once: the second is tried again, and then its check finds the first one's event.
  if (absl::IsAlreadyExists(recorded.status()))
    return WithReason(absl::AbortedError("calibration " + decision.calibration_id +
                                         ": decided by another call meanwhile; look at it and try again"),
                      kCalibrationDecidedMeanwhile);
  if (!recorded.ok()) return recorded.status();
  return ReadCalibrationAgain(transaction, decision.calibration_id);
}

// What calibrations/{id} is, and what releases/{id} and withdrawals/{id} are of.
absl::StatusOr<std::optional<CalibrationRow>> FindNamed(Transaction& transaction, const std::string& name) {
  return FindCalibration(transaction, IdOfName(name).id);
}

absl::StatusOr<WithdrawnCalibrationRow> WhatIsLeftOf(Transaction& transaction, CalibrationRow calibration,
                                                     const Reader& reader) {
  WithdrawnCalibrationRow withdrawn;
  withdrawn.calibration = std::move(calibration);
  JournalPage all;
  all.reader = reader;
  auto resting = DerivedFrom(transaction, withdrawn.calibration.name(), {}, all);
  if (!resting.ok()) return resting.status();
  withdrawn.resting = *std::move(resting);
  auto in_force = CalibrationInForce(transaction, withdrawn.calibration.subject(), withdrawn.calibration.as_of);
  if (!in_force.ok()) return in_force.status();
  withdrawn.in_force = *std::move(in_force);
  return withdrawn;
}

absl::StatusOr<std::optional<WithdrawnCalibrationRow>> FindWithdrawn(Transaction& transaction, const std::string& name,
                                                                     const Reader& reader) {
  absl::StatusOr<std::optional<CalibrationRow>> calibration = FindNamed(transaction, name);
  if (!calibration.ok()) return calibration.status();
  if (!calibration->has_value()) return std::nullopt;
  absl::StatusOr<WithdrawnCalibrationRow> withdrawn = WhatIsLeftOf(transaction, **std::move(calibration), reader);
  if (!withdrawn.ok()) return withdrawn.status();
  return *std::move(withdrawn);
}

class PostgresCalibrations final : public CalibrationStore {
 public:
  explicit PostgresCalibrations(Database* database) : database_(database) {}

  absl::StatusOr<Instant> Now(Deadline deadline) const override { return OneRead(*database_, deadline, NowOf); }
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

  absl::StatusOr<std::optional<CalibrationRow>> FindRecorded(const RecordedRequest& request,
                                                             Deadline deadline) const override {
    return storage::FindRecorded<CalibrationRow>(*database_, request, deadline, FindNamed);
  }
  absl::StatusOr<CalibrationRow> Record(const RecordedRequest& request, CalibrationRow calibration,
                                        const RecordEntry& entry, Deadline deadline) override {
    RecordEntry kept = entry;
    kept.request = KeptRequestOf(request);
    const auto store = [&](Transaction& transaction) -> absl::StatusOr<CalibrationRow> {
      absl::StatusOr<std::string> sha256 = PutBlob(transaction, request.bytes);
      if (!sha256.ok()) return sha256.status();
      calibration.request_sha256 = *std::move(sha256);
      const absl::StatusOr<Recorded> recorded = InsertCalibration(transaction, calibration, kept);
      if (!recorded.ok()) return recorded.status();
      return ReadCalibrationAgain(transaction, calibration.calibration_id);
    };
    return RecordOnce<CalibrationRow>(*database_, request, deadline, FindNamed, store);
  }
  absl::StatusOr<CalibrationRow> Release(const RecordedRequest& request, const CalibrationDecision& decision,
                                         Deadline deadline) override {
    return RecordOnce<CalibrationRow>(*database_, request, deadline, FindNamed, [&](Transaction& transaction) {
      return Decide(transaction, request, decision, ReleaseCalibration);
    });
  }
  absl::StatusOr<WithdrawnCalibrationRow> Withdraw(const RecordedRequest& request, const CalibrationDecision& decision,
                                                   Deadline deadline) override {
    const auto withdraw = [&](Transaction& transaction) -> absl::StatusOr<WithdrawnCalibrationRow> {
      absl::StatusOr<CalibrationRow> calibration = Decide(transaction, request, decision, WithdrawCalibration);
      if (!calibration.ok()) return calibration.status();
      // The journal's lock is held: nothing more can come to rest on it.
      return WhatIsLeftOf(transaction, *std::move(calibration), decision.reader);
    };
    const auto find = [&](Transaction& transaction, const std::string& name) {
      return FindWithdrawn(transaction, name, decision.reader);
    };
    return RecordOnce<WithdrawnCalibrationRow>(*database_, request, deadline, find, withdraw);
  }

 private:
  Database* const database_;
};

}  // namespace

std::shared_ptr<CalibrationStore> CalibrationsIn(Database* database) {
  return std::make_shared<PostgresCalibrations>(database);
}

}  // namespace sixpoint::storage
