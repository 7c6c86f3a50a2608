// Repairs: the target that continues a damaged blade, the path around it, and what that would remove.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "storage/database.h"
#include "storage/record.h"
#include "storage/result_filter.h"
#include "storage/result_store.h"

namespace sixpoint::storage {

// As it was applied.
struct RepairMethodRow {
  double first_mm = 0, repair_line_mm = 0, target_mm = 0, line_width_mm = 0;
  double mill_diameter_mm = 0, mill_length_mm = 0;
  std::string extrapolation;
  bool cornered_edges = false;
  std::vector<double> leading_in_part_mm;  // empty: not stated
  double farthest_mm = 0, scallop_um = 0, lead_deg = 0, tilt_deg = 0;
  double depth_of_cut_mm = 0, finish_allowance_mm = 0, roughing_step_mm = 0;
  double guard_um = 0, chord_um = 0, greatest_turn_deg = 0, greatest_uncertainty_um = 0;
};

struct RepairSectionRow {
  double z_mm = 0;
  std::string kind, remark;  // remark: of LEFT_OUT alone
  // Of TARGET: all or none.
  std::optional<double> mean_expanded_uncertainty_um, greatest_expanded_uncertainty_um, greatest_rest_um,
      deepest_cut_um;
};

struct RepairDeterminationRow {
  double camber = 0, thickness = 0, leading = 0, trailing = 0;
};

struct RepairRemovalRow {
  int place_count_below_line = 0;
  double deepest_below_line_um = 0, deepest_in_target_um = 0, deepest_beyond_uncertainty_um = 0;
  double greatest_rest_um = 0, mean_rest_um = 0;
};

// Numbers place by place.
struct RepairContourRow {
  std::vector<double> points_in_part_mm, expanded_uncertainties_um, rest_um;
};
struct RepairLapRow {
  double z_mm = 0, allowance_mm = 0;
  std::vector<double> centres_in_part_mm, axes_in_part;
};

struct RepairRow {
  std::string repair_id;
  std::string blade_serial;
  std::string registration_id;
  std::string machine_id;
  int machine_revision = 0;
  std::string part_id;
  int part_revision = 0;
  std::string sensor_calibration_id;
  std::string rotation_calibration_id;
  std::string method;  // of the registration
  RepairMethodRow applied;
  std::optional<RepairDeterminationRow> determination;  // of polynomials alone
  std::int64_t below_line_count = 0, above_line_count = 0, left_out_count = 0;
  double greatest_stock_mm = 0, step_over_mm = 0;
  int roughing_layer_count = 0, lap_count = 0, place_count = 0;
  double path_length_mm = 0, greatest_lift_um = 0;
  RepairRemovalRow removal;
  std::string contours_sha256, path_sha256;  // lower-case hexadecimal
  std::string requested_by;
  std::string software_version;
  std::string computed_on;
  Recorded recorded;  // set when it is recorded
  std::vector<std::string> scan_ids;
  std::vector<RepairSectionRow> sections;  // upwards
  std::vector<RepairContourRow> contours;  // written only, as laps; upwards
  std::vector<RepairLapRow> laps;          // in the order of the cut
  // Read only: what its blade was worked on for.
  std::string work_order, operation;
};

using RepairFilter = ResultFilter;

// Thread-safe.
class RepairStore : public ResultStore<RepairRow, RepairFilter> {
 public:
  // Empty: no such repair.
  virtual absl::StatusOr<std::vector<RepairContourRow>> Contours(const std::string& repair_id,
                                                                 Deadline deadline) const = 0;
  virtual absl::StatusOr<std::vector<RepairLapRow>> Laps(const std::string& repair_id, Deadline deadline) const = 0;
};
// In PostgreSQL; the database lives longer.
std::shared_ptr<RepairStore> RepairsIn(Database* database);

// The same in a transaction of the caller's: journal entry, repair and all that is its. Call it last before the commit.
absl::StatusOr<Recorded> InsertRepair(Transaction& transaction, const RepairRow& repair, const RecordEntry& entry);

}  // namespace sixpoint::storage
