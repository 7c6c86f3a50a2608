// Just the values of inspections: hole by hole, without what else there is of them.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "storage/database.h"
#include "storage/reader.h"
#include "storage/time_span.h"

namespace sixpoint::storage {

// What is empty matches all.
struct ValueFilter {
  std::string blade_serial, serial_prefix, part_id, machine_id;
  std::string group_name, hole_name;  // both or none
  std::string calibration_id;         // as ResultFilter's
  TimeSpan recorded;
  std::string verdict;       // of the inspection
  bool only_newest = false;  // of each blade the newest inspection alone
  Reader reader;             // what he may not see is not listed
};

// One hole of one inspection.
struct HoleValuesRow {
  std::int64_t sequence = 0;
  Instant recorded_at;
  std::string inspection_id, blade_serial, machine_id, part_id, method;
  int machine_revision = 0, part_revision = 0;
  std::string group_name, hole_name, position_verdict, inclination_verdict;
  std::optional<double> position_error_mm, inclination_error_deg;  // none: not measured
  std::optional<double> position_expanded_uncertainty_um, inclination_expanded_uncertainty_deg;
  double position_tolerance_mm = 0, inclination_tolerance_deg = 0;
};

// Thread-safe. No call holds a connection after it returned.
class ValueReader {
 public:
  virtual ~ValueReader() = default;
  // Of at most that many inspections, the newest first, from below `before_sequence` (0: from the newest); of each in the part's order.
  virtual absl::StatusOr<std::vector<HoleValuesRow>> Values(const ValueFilter& filter, std::int64_t before_sequence,
                                                            int inspection_limit, Deadline deadline) const = 0;
};
// In PostgreSQL; the database lives longer.
std::shared_ptr<ValueReader> ValuesIn(Database* database);

}  // namespace sixpoint::storage
