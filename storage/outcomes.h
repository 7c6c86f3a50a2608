// What became of corrections: each hole as an inspection found it, beside where the correction was to put it. Only read.
#pragma once

#include <absl/status/statusor.h>

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "storage/database.h"
#include "storage/reader.h"
#include "storage/time_span.h"

namespace sixpoint::storage {

// What is empty matches all; the machine is the one that cut.
struct OutcomeFilter {
  std::string machine_id, part_id;
  std::string calibration_id;  // that the correction rests on, its scanner's or its axes'
  TimeSpan corrected;          // when the correction was recorded
  Reader reader;               // what he may not see is left out
};

// A blade that corrections were made of, and its newest inspection.
struct OutcomeBladeRow {
  std::string blade_serial;
  std::string inspection_id;  // empty: it was not inspected
  int inspection_count = 0;   // all of it, the newest too
  bool is_withdrawn = false;  // the newest rests on a calibration that was withdrawn
  bool is_open = false;       // how the part stands is not agreed, and not in the uncertainties either
};

// One measured hole of such an inspection, and the correction that it was cut by: the newest whose cut of it was reported, else the newest
// that was let go before the first scan of the inspection.
struct OutcomeHoleRow {
  std::string blade_serial, inspection_id, correction_id, group_name, hole_name;
  std::string sensor_calibration_id, rotation_calibration_id;  // the correction's
  int machine_revision = 0;
  Instant corrected_at;
  bool is_cut_reported = false, is_withdrawn = false;  // of the correction
  double a_deg = 0, b_deg = 0;                         // reached, where axis tables told it
  std::vector<double> zero_from_part;                  // three rows of four
  std::array<double, 3> predicted_start_mm{}, predicted_axis{}, found_start_mm{}, found_axis{};  // part frame
  double position_expanded_uncertainty_um = 0, inclination_expanded_uncertainty_deg = 0;
  std::vector<std::string> budget_sources;
  std::vector<double> budget_um;
};

struct OutcomeCalibrationRow {
  std::string calibration_id, state;                                     // "IN_FORCE", now
  std::vector<double> a_direction, a_point_mm, b_direction, b_point_mm;  // empty: not one of axes
};

struct Outcomes {
  std::vector<OutcomeBladeRow> blades;  // whose corrections are newest first
  std::vector<OutcomeHoleRow> holes;
  std::vector<OutcomeCalibrationRow> calibrations;  // that the holes' corrections name
  int newest_machine_revision = 0;                  // of the holes' own and the one after them; 0: no hole
  bool is_cut_off = false;                          // there are more blades or holes
};

// Holes of one answer: some 20 MB.
inline constexpr int kMostOutcomeHoles = 50'000;

// Thread-safe. No call holds a connection after it returned.
class OutcomeReader {
 public:
  virtual ~OutcomeReader() = default;
  virtual absl::StatusOr<Outcomes> Read(const OutcomeFilter& filter, int most_blades, Deadline deadline) const = 0;
};
// In PostgreSQL; the database lives longer.
std::shared_ptr<OutcomeReader> OutcomesIn(Database* database);

}  // namespace sixpoint::storage
