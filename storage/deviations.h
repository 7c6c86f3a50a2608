// Deviation maps: a blade's surface against its CAD, with its patches, its profile tolerances and its cloud.
#pragma once

#include <absl/status/statusor.h>

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "storage/database.h"
#include "storage/decision_rules.h"
#include "storage/record.h"
#include "storage/result_filter.h"
#include "storage/result_store.h"

namespace sixpoint::storage {

// One of DeviationPatchesRow, and its mean; of a profile tolerance the mean in its zone.
struct DeviationPatchRow {
  int patch = 0;
  double mean_um = 0, expanded_uncertainty_um = 0;
  std::array<double, 3> centre_in_part_mm{};
};

// The whole surface, or a region of it.
struct DeviationRegionRow {
  struct Values {
    double mean_um = 0, rms_um = 0, p05_um = 0, p50_um = 0, p95_um = 0;
    DeviationPatchRow lowest, highest;
  };
  std::string region;  // empty: the whole
  std::vector<double> minimum_in_part_mm, maximum_in_part_mm,
      facing_in_part;                       // three numbers; empty: not bounded by it
  std::optional<double> facing_within_deg;  // with facing_in_part
  double area_mm2 = 0, seen_area_mm2 = 0;
  std::int64_t point_count = 0;
  std::optional<Values> values;  // none: nothing was seen
};

struct DeviationProfileAreaRow {
  bool above = false;
  double area_mm2 = 0;
  int patch_count = 0;
  DeviationPatchRow worst;
  std::array<double, 3> minimum_in_part_mm{}, maximum_in_part_mm{};
};

struct DeviationProfileRow {
  std::string characteristic, region;  // region: empty: the whole
  std::string zone;                    // FORM_AND_LOCATION, FORM
  double lower_mm = 0, upper_mm = 0, least_coverage = 0;
  std::string verdict, reason;
  double coverage = 0, out_mm2 = 0, undecided_mm2 = 0;
  int area_count = 0;
  DecisionRuleRow rule;        // empty: ISO 14253-1 until 2013, as DeviationMapRow::decision_rule says
  std::vector<double> motion;  // of FORM: six numbers
  // In the zone; none: nothing was seen.
  std::optional<DeviationPatchRow> lowest, highest;
  std::vector<DeviationProfileAreaRow> areas;
};

// In the surface's order: three numbers of a point or a direction, else one. What was not seen is NaN.
struct DeviationPatchesRow {
  std::vector<double> centres_in_part_mm, normals_in_part, areas_mm2, means_um, expanded_uncertainties_um;
  std::vector<std::int64_t> point_counts;
};

struct DeviationCloudBlockRow {
  int scan_index = 0;  // in DeviationMapRow::scan_ids
  std::int64_t point_count = 0;
  double proven_place_error_um = 0, proven_deviation_error_um = 0;
  std::string blob_sha256;  // lower-case hexadecimal
};

struct DeviationMapRow {
  std::string deviation_id;
  std::string blade_serial;
  std::string registration_id;
  std::string machine_id;
  int machine_revision = 0;
  std::string part_id;
  int part_revision = 0;
  std::string sensor_calibration_id;
  std::string rotation_calibration_id;
  std::string method;  // of the registration
  double patch_mm = 0;
  int patch_count = 0;
  std::int64_t compared_count = 0, at_edges_count = 0, set_aside_count = 0, far_off_count = 0;
  std::vector<std::string> budget_sources;
  std::vector<double> budget_um;
  std::string verdict, decision_rule;        // empty: no profile was judged
  std::string patches_sha256, cloud_sha256;  // lower-case hexadecimal; cloud: empty: none is kept
  std::string requested_by;
  std::string software_version;
  std::string computed_on;
  Recorded recorded;  // set when it is recorded
  std::vector<std::string> scan_ids;
  std::vector<DeviationRegionRow> regions;  // the whole first
  std::vector<DeviationProfileRow> profiles;
  // Written only; they are read by themselves (DeviationStore).
  DeviationPatchesRow patches;
  std::vector<DeviationCloudBlockRow> cloud;
  std::vector<std::string> cloud_bytes;  // of each block
  // Read only: what its blade was worked on for.
  std::string work_order, operation;
};

struct DeviationFilter : ResultFilter {
  std::string verdict;  // empty: any
};

// Beside the maps what is too large to come with each of them. Thread-safe.
class DeviationStore : public ResultStore<DeviationMapRow, DeviationFilter> {
 public:
  // None: no such map.
  virtual absl::StatusOr<std::optional<DeviationPatchesRow>> Patches(const std::string& deviation_id,
                                                                     Deadline deadline) const = 0;
  // In their order; none where no cloud was kept.
  virtual absl::StatusOr<std::vector<DeviationCloudBlockRow>> Cloud(const std::string& deviation_id,
                                                                    Deadline deadline) const = 0;
  // Checked against the digest; as GetBlob.
  virtual absl::StatusOr<std::string> CloudBytes(const std::string& blob_sha256, Deadline deadline) const = 0;
};
// In PostgreSQL; the database lives longer.
std::shared_ptr<DeviationStore> DeviationsIn(Database* database);

// The same in a transaction of the caller's: journal entry, map and all that is its. Call it last before the commit.
absl::StatusOr<Recorded> InsertDeviationMap(Transaction& transaction, const DeviationMapRow& map,
                                            const RecordEntry& entry);

}  // namespace sixpoint::storage
