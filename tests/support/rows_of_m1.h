// What rows of tests about machine m1 have in common. Whatever fails ends the program.
#pragma once

#include <absl/status/statusor.h>

#include <string>
#include <utility>
#include <vector>

#include "storage/calibrations.h"
#include "tests/support/customers_parts.h"
#include "tests/support/must.h"

namespace sixpoint::testing {

inline std::string IdOf(const std::string& name) { return name.substr(name.find('/') + 1); }

// blade: its serial; empty: it is of none.
storage::RecordEntry EntryOfM1(const std::string& name, const std::vector<std::string>& inputs,
                               const std::string& blade);

// The name of a new one; the row says what was found.
std::string PutCalibration(storage::Transaction& transaction, storage::CalibrationRow row);

// What registrations, corrections and inspections have in common; the rest is the row's.
template <typename Row>
Row ResultOf(const std::string& part_id, const std::string& blade_serial, const MachinesCalibrations& calibrations,
             Row row = {}) {
  row.blade_serial = blade_serial;
  row.machine_id = "m1";
  row.machine_revision = 1;
  row.part_id = part_id;
  row.part_revision = 1;
  row.sensor_calibration_id = IdOf(calibrations.sensor);
  row.rotation_calibration_id = IdOf(calibrations.rotation);
  row.requested_by = "users/maker";
  row.software_version = "test";
  return row;
}

}  // namespace sixpoint::testing
