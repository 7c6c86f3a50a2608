#include <nlohmann/json.hpp>

#include "storage/calibrations.h"

namespace sixpoint::storage {
namespace {

constexpr char kInsertEvent[] =
    "INSERT INTO calibration_events (calibration_id, event, reason, requested_by, software_version, record_sequence, "
    "recorded_at) VALUES ($1, $2, $3, $4, $5, $6, $7)";

absl::StatusOr<Recorded> InsertEvent(Transaction& transaction, const CalibrationRow& calibration,
                                     const std::string& entry_kind, const std::string& event_name,
                                     const CalibrationEvent& event) {
  RecordEntry entry;
  entry.kind = entry_kind;
  entry.name = entry_kind + "s/" + calibration.calibration_id;
  entry.inputs = {calibration.name()};
  entry.machine = calibration.machine_id;
  entry.software_version = event.software_version;
  entry.requested_by = event.requested_by;
  entry.summary_json = nlohmann::json{{"reason", event.reason}}.dump();
  const absl::StatusOr<Recorded> recorded = AppendRecord(transaction, entry);
  if (!recorded.ok()) return recorded.status();
  const absl::StatusOr<Rows> inserted = transaction.Execute(kInsertEvent, Params()
                                                                              .Text(calibration.calibration_id)
                                                                              .Text(event_name)
                                                                              .Text(event.reason)
                                                                              .Text(event.requested_by)
                                                                              .Text(event.software_version)
                                                                              .Int(recorded->sequence)
                                                                              .Time(recorded->recorded_at));
  if (!inserted.ok()) return inserted.status();
  return recorded;
}

}  // namespace

absl::StatusOr<Recorded> ReleaseCalibration(Transaction& transaction, const CalibrationRow& calibration,
                                            const CalibrationEvent& event) {
  return InsertEvent(transaction, calibration, "release", "RELEASED", event);
}

absl::StatusOr<Recorded> WithdrawCalibration(Transaction& transaction, const CalibrationRow& calibration,
                                             const CalibrationEvent& event) {
  return InsertEvent(transaction, calibration, "withdrawal", "WITHDRAWN", event);
}

}  // namespace sixpoint::storage
