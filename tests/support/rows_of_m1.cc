#include "tests/support/rows_of_m1.h"

#include "storage/blobs.h"

namespace sixpoint::testing {

storage::RecordEntry EntryOfM1(const std::string& name, const std::vector<std::string>& inputs,
                               const std::string& blade) {
  storage::RecordEntry entry;
  entry.kind = name.substr(0, name.find('/') - 1);
  entry.name = name;
  entry.inputs = inputs;
  if (!blade.empty()) entry.blade = blade;
  entry.machine = "m1";
  entry.software_version = "test";
  entry.reader = storage::Reader::Everything();
  return entry;
}

std::string PutCalibration(storage::Transaction& transaction, storage::CalibrationRow row) {
  row.calibration_id = storage::NewUuid();
  row.machine_id = "m1";
  row.inputs = {"machines/m1@1"};
  row.request_sha256 = Must(storage::PutBlob(transaction, "request of " + row.calibration_id));
  row.valid_from = storage::Instant(std::chrono::seconds(1'600'000'000));
  row.valid_until = storage::Instant(std::chrono::seconds(4'000'000'000));
  row.requested_by = "users/maker";
  row.software_version = "test";
  storage::RecordEntry entry = EntryOfM1(row.name(), row.inputs, "");
  entry.kind = "calibration";
  Must(storage::InsertCalibration(transaction, row, entry));
  return row.name();
}

}  // namespace sixpoint::testing
