// Passes over blanks that were machined to a reconstruction's shape: what each left, and what is to be done now.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "storage/database.h"
#include "storage/reconstructions.h"
#include "storage/record.h"
#include "storage/result_filter.h"
#include "storage/result_store.h"

namespace sixpoint::storage {

struct MachinedRegionRow {
  std::string region;
  int patch_count = 0;
  double seen_part = 0;
  std::optional<double> mean_rest_um, least_rest_um, greatest_rest_um;  // of a machined one that was seen: all or none
  std::optional<double> least_lower_spare_um, least_upper_spare_um;     // of no datum: both or none
  std::optional<double> offset_um, deflection_share;                    // of a machined one that was cut: both or none
};

struct MachiningPassRow {
  std::string pass_id;
  std::string blade_serial;
  std::string registration_id;
  std::string machine_id;
  int machine_revision = 0;
  std::string part_id;
  int part_revision = 0;
  std::string sensor_calibration_id;
  std::string rotation_calibration_id;
  std::string method;  // of the registration
  std::string correction_id, reconstruction_id;
  int number = 0;                          // from 1 on
  std::optional<double> greatest_rest_mm;  // as it was asked for
  std::string outcome, remark;             // remark: empty of DONE alone
  std::int64_t taken_count = 0, far_off_count = 0, shapeless_count = 0;
  int patch_count = 0;
  std::string patches_sha256;  // lower-case hexadecimal
  std::string requested_by;
  std::string software_version;
  std::string computed_on;
  Recorded recorded;  // set when it is recorded
  std::vector<std::string> scan_ids;
  std::vector<MachinedRegionRow> regions;
  BlankPatchesRow patches;  // written only; stock_um: above the shape
  // Read only: what its blade was worked on for.
  std::string work_order, operation;
};

struct MachiningPassFilter : ResultFilter {
  std::string outcome;  // empty: any
};

// Thread-safe.
class MachiningPassStore : public ResultStore<MachiningPassRow, MachiningPassFilter> {
 public:
  // None: no such pass.
  virtual absl::StatusOr<std::optional<BlankPatchesRow>> Patches(const std::string& pass_id,
                                                                 Deadline deadline) const = 0;
};
// In PostgreSQL; the database lives longer.
std::shared_ptr<MachiningPassStore> MachiningPassesIn(Database* database);

// The same in a transaction of the caller's: journal entry, pass and all that is its. Call it last before the commit.
absl::StatusOr<Recorded> InsertMachiningPass(Transaction& transaction, const MachiningPassRow& pass,
                                             const RecordEntry& entry);

}  // namespace sixpoint::storage
