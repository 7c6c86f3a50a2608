// What the calibration service keeps, apart from where (storage/result_store.h says how): calibrations with their states, read
// and written. Thread-safe. No call holds a connection after it returned.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "storage/calibrations.h"
#include "storage/record.h"
#include "storage/result_store.h"

namespace sixpoint::storage {

class CalibrationReader : public ResultReader<CalibrationRow, CalibrationFilter> {
 public:
  // By which validity counts: NowOf.
  virtual absl::StatusOr<Instant> Now(Deadline deadline) const = 0;
  // As the functions of these names in storage/calibrations.h.
  virtual absl::StatusOr<std::optional<CalibrationRow>> InForce(const CalibrationSubject& subject, Instant at,
                                                                Deadline deadline) const = 0;
  virtual absl::StatusOr<std::optional<CalibrationRow>> Withdrawn(const CalibrationSubject& subject, Instant at,
                                                                  Deadline deadline) const = 0;
  virtual absl::StatusOr<std::optional<Instant>> LastValidity(const CalibrationSubject& subject, Instant at,
                                                              Deadline deadline) const = 0;
  virtual absl::StatusOr<std::vector<CalibrationRow>> History(const CalibrationSubject& subject, int limit,
                                                              Deadline deadline) const = 0;
};

// A person's decision about a calibration.
struct CalibrationDecision {
  std::string calibration_id;
  CalibrationEvent event;
  // Whether it may be decided so, asked of the calibration as it is then; nothing where there is none of that id.
  std::function<absl::Status(const std::optional<CalibrationRow>& calibration)> check;
  Reader reader = {};  // of a withdrawal: what he may not see is not told to rest on it
};

// What a withdrawal left behind, complete: nothing can come to rest on the calibration any more.
struct WithdrawnCalibrationRow {
  CalibrationRow calibration;
  std::vector<JournalEntry> resting;       // made from it, directly or not, as far as the reader may see
  std::optional<CalibrationRow> in_force;  // of its subject now
};

// Record keeps the request's bytes as a blob, too.
class CalibrationWriter : public ResultWriter<CalibrationRow> {
 public:
  // The event with its journal entry; the calibration after it. A retry gets it as it then stands.
  virtual absl::StatusOr<CalibrationRow> Release(const RecordedRequest& request, const CalibrationDecision& decision,
                                                 Deadline deadline) = 0;
  virtual absl::StatusOr<WithdrawnCalibrationRow> Withdraw(const RecordedRequest& request,
                                                           const CalibrationDecision& decision, Deadline deadline) = 0;
};

class CalibrationStore : public CalibrationReader, public CalibrationWriter {};

// In PostgreSQL; the database lives longer.
std::shared_ptr<CalibrationStore> CalibrationsIn(Database* database);

}  // namespace sixpoint::storage
