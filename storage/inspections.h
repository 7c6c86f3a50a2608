// Inspections with their scans and holes.
#pragma once

#include <absl/status/statusor.h>

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "storage/database.h"
#include "storage/dispositions.h"
#include "storage/inspection_hole_values.h"
#include "storage/record.h"
#include "storage/result_filter.h"
#include "storage/result_store.h"

namespace sixpoint::storage {

struct InspectionHoleRow {
  // What a measured hole has, all of it.
  struct Measured {
    double position_error_mm = 0;
    double inclination_error_deg = 0;
    double position_expanded_uncertainty_um = 0;
    double inclination_expanded_uncertainty_deg = 0;
    std::array<double, 3> start_in_part_mm{};
    std::array<double, 3> axis_in_part{};
    double pin_diameter_mm = 0;
  };
  std::string group_name;
  std::string hole_name;
  std::string verdict;  // CONFORM, NOT_CONFORM, UNDECIDABLE, NOT_MEASURED
  std::string position_verdict;
  std::string inclination_verdict;
  std::optional<Measured> measured;
  double position_tolerance_mm = 0;
  double inclination_tolerance_deg = 0;
  int point_count = 0;
  double pin_residual_rms_um = 0;
  std::string reason;
  double positioning_difference_um = 0;
  std::optional<double> pin_half_play_um = std::nullopt;
  std::vector<double> budget_um =
      {};  // by InspectionRow::budget_sources; empty: not measured, or made before it was kept
  std::optional<HoleDetailRow> values = std::nullopt;  // none: not measured, or made before they were kept
};

struct InspectionRow {
  std::string inspection_id;
  std::string blade_serial;
  std::string registration_id;
  std::string machine_id;
  int machine_revision = 0;
  std::string part_id;
  int part_revision = 0;
  std::string sensor_calibration_id;
  std::string rotation_calibration_id;
  std::string method;                                         // BEST_FIT, LOCAL, SIX_POINT, SIX_POINT_NORMALS
  std::optional<double> disagreement_um, disagreement_ratio;  // where compared with the best fit
  bool positioning_disagrees = false, positioning_covered = false;
  std::string verdict;
  std::string decision_rule;
  double deviation_minimum_um = 0, deviation_maximum_um = 0, deviation_rms_um = 0;
  double deviation_p05_um = 0, deviation_p50_um = 0, deviation_p95_um = 0;
  std::int64_t deviation_point_count = 0;
  std::int64_t deviation_excluded_count = 0;
  std::string requested_by;
  std::string software_version;
  std::string rejudges_id;  // the inspection that this one judges anew; empty: none
  std::string computed_on;  // processor and C library; empty: made before it was kept
  Recorded recorded;        // set by InsertInspection
  std::vector<std::string> scan_ids;
  std::vector<std::string> budget_sources;  // empty: none, or made before they were kept
  std::vector<InspectionHoleRow> holes;
  std::vector<HolePitchRow> pitches;  // empty: made before they were kept, or no group has two holes
  // Read only: what was decided about it, the newest first, and what its blade was worked on for.
  std::vector<DispositionRow> dispositions;
  std::string work_order, operation;
};

struct InspectionFilter : ResultFilter {
  std::string verdict;     // empty: any
  std::string work_order;  // empty: any
};

using InspectionStore = ResultStore<InspectionRow, InspectionFilter>;
// In PostgreSQL; the database lives longer.
std::shared_ptr<InspectionStore> InspectionsIn(Database* database);

// The same in a transaction of the caller's.
// Journal entry, inspection, scans and holes. Call it last before the commit.
absl::StatusOr<Recorded> InsertInspection(Transaction& transaction, const InspectionRow& inspection,
                                          const RecordEntry& entry);

absl::StatusOr<std::optional<InspectionRow>> FindInspection(Transaction& transaction, const std::string& inspection_id);

// Newest first, from below `before_sequence` (0: from the newest).
absl::StatusOr<std::vector<InspectionRow>> ListInspections(Transaction& transaction, const InspectionFilter& filter,
                                                           std::int64_t before_sequence, int limit);

}  // namespace sixpoint::storage
