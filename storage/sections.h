// Section measurements: a blade's airfoil sections, each parameter measured or not, and the outlines.
#pragma once

#include <absl/status/statusor.h>

#include <array>
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

struct SectionValueRow {
  std::string parameter, unit;  // CHORD_NOSE_TAIL; MM, DEG, RATIO
  std::optional<double> nominal, value, expanded_uncertainty, by_noise, by_form, by_pose;
  std::string reason;  // empty exactly where there is a value
};

struct SectionRow {
  // Of an outline that was found.
  struct Found {
    std::string leading_end, trailing_end;  // ROUND, SQUARE, SHARP, NOT_SEEN
    double noise_um = 0, waver_um = 0, waver_length_mm = 0, gap_share = 0;
  };
  std::string section;
  std::array<double, 3> origin_in_part_mm{}, normal_in_part{}, reference_in_part{};
  std::vector<double> leading_in_part_mm, near_in_part_mm;  // three numbers; empty: not stated
  std::int64_t point_count = 0, outlier_count = 0;
  std::optional<Found> found;
  std::string reason;  // empty exactly where one was
  std::vector<SectionValueRow> values;
};

// In the section's frame, x and y in turn.
struct SectionOutlineRow {
  std::vector<double> part_from_section;  // upper three rows
  std::vector<double> nominal_mm, measured_mm, deviations_um;
  std::vector<std::int64_t> gaps_before;
};

struct SectionMeasurementRow {
  std::string section_measurement_id;
  std::string blade_serial;
  std::string registration_id;
  std::string machine_id;
  int machine_revision = 0;
  std::string part_id;
  int part_revision = 0;
  std::string sensor_calibration_id;
  std::string rotation_calibration_id;
  std::string method;  // of the registration
  double half_width_mm = 0;
  std::string reference_section;
  std::vector<double> neighbour_offset_in_part_mm;  // three numbers; empty: no throat was asked for
  std::optional<double> neighbour_standard_uncertainty_um;
  std::string outlines_sha256;  // lower-case hexadecimal
  std::string requested_by;
  std::string software_version;
  std::string computed_on;
  Recorded recorded;  // set when it is recorded
  std::vector<std::string> scan_ids;
  std::vector<SectionRow> sections;
  // Of each section. Written only; read by themselves (SectionStore).
  std::vector<SectionOutlineRow> outlines;
  // Read only: what its blade was worked on for.
  std::string work_order, operation;
};

struct SectionFilter : ResultFilter {
  bool with_values = true;  // reads those too
};

// Beside the measurements what is too large to come with each of them. Thread-safe.
class SectionStore : public ResultStore<SectionMeasurementRow, SectionFilter> {
 public:
  // In the order of the sections; none of a measurement that is not there.
  virtual absl::StatusOr<std::vector<SectionOutlineRow>> Outlines(const std::string& section_measurement_id,
                                                                  Deadline deadline) const = 0;
};
// In PostgreSQL; the database lives longer.
std::shared_ptr<SectionStore> SectionsIn(Database* database);

// The same in a transaction of the caller's: journal entry, measurement and all that is its. Call it last before the commit.
absl::StatusOr<Recorded> InsertSectionMeasurement(Transaction& transaction, const SectionMeasurementRow& measurement,
                                                  const RecordEntry& entry);

}  // namespace sixpoint::storage
