// What seeded blades refer to: machines, an artefact, parts with their holes, and the calibrations of all months.
#pragma once

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "seed/plan.h"
#include "storage/calibrations.h"

namespace sixpoint::seed {

struct Calibrations {
  std::string sensor_id, rotation_id, axis_a_id, axis_b_id;
};
struct Registry {
  std::vector<std::vector<Calibrations>> by_machine;  // each of them by month
  std::string scan_blob_sha256;                       // what every seeded scan's block is
  std::int64_t scan_blob_bytes = 0;
};

// An entry of the journal that says of itself that it is seeded.
storage::RecordEntry EntryOf(const std::string& kind, const std::string& name, const std::string& requested_by);
inline constexpr char kSeeder[] = "users/seed";

absl::StatusOr<Registry> WriteRegistry(storage::Database* database, const Plan& plan);

}  // namespace sixpoint::seed
