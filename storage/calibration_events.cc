#include <nlohmann/json.hpp>

#include "storage/calibrations.h"

namespace sixpoint::storage {
namespace {

constexpr char kInsertCalibrationEvent[] =
    "INSERT INTO calibration_events (calibration_id, event, reason, requested_by, software_version, record_id) "
    "VALUES ($1, $2, $3, $4, $5, $6)";

absl::StatusOr<Recorded> InsertEvent(Transaction& transaction, const CalibrationRow& calibration,
                                     const std::string& entry_kind, const std::string& event_name,
                                     const CalibrationEvent& event, const std::optional<KeptRequest>& request) {
  RecordEntry entry;
  entry.kind = entry_kind;
  entry.name = entry_kind + "s/" + calibration.calibration_id;
  entry.inputs = {calibration.name()};
  entry.machine = calibration.machine_id;
  entry.software_version = event.software_version;
  entry.requested_by = event.requested_by;
  entry.summary_json = nlohmann::json{{"reason", event.reason}}.dump();
  entry.request = request;
  const std::string record_id = NewUuid();
  const absl::StatusOr<Rows> inserted =
      transaction.Execute(kInsertCalibrationEvent, Params()
                                                       .Uuid(calibration.calibration_id)
                                                       .Text(event_name)
                                                       .Text(event.reason)
                                                       .Text(event.requested_by)
                                                       .Text(event.software_version)
                                                       .Uuid(record_id));
  if (!inserted.ok()) return inserted.status();
  return AppendRecord(transaction, record_id, entry);
}

}  // namespace

absl::StatusOr<Recorded> ReleaseCalibration(Transaction& transaction, const CalibrationRow& calibration,
                                            const CalibrationEvent& event, const std::optional<KeptRequest>& request) {
  return InsertEvent(transaction, calibration, "release", "RELEASED", event, request);
}

absl::StatusOr<Recorded> WithdrawCalibration(Transaction& transaction, const CalibrationRow& calibration,
                                             const CalibrationEvent& event, const std::optional<KeptRequest>& request) {
  return InsertEvent(transaction, calibration, "withdrawal", "WITHDRAWN", event, request);
}

}  // namespace sixpoint::storage
