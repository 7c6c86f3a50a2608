// Calibrations of machines: sensor to machine, and the rotary axes.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "storage/database.h"
#include "storage/record.h"

namespace sixpoint::storage {

struct CentreResidualRow {
  std::string scan_id;
  std::string feature;
  bool is_check = false;
  double dx_um = 0, dy_um = 0, dz_um = 0;
};

struct SensorCalibrationRow {
  std::vector<double> machine_from_sensor_rotation;  // 9, row-major
  std::vector<double> t_sm_mm;                       // 3
  std::vector<double> covariance;                    // 36, row-major
  double alpha_deg = 0, beta_deg = 0, gamma_deg = 0;
  double alpha_standard_uncertainty_deg = 0, beta_standard_uncertainty_deg = 0, gamma_standard_uncertainty_deg = 0;
  double noise_um = 0;
  double touch_rms_um = 0;
  double residual_rms_um = 0;
  double condition_number = 0;
  std::int64_t points_used = 0;
  std::vector<CentreResidualRow> centres;
};

struct PoseResidualRow {
  double a_deg = 0, b_deg = 0, distance_um = 0;
  bool held_out = false;
  std::optional<double> before_um = std::nullopt;  // not kept before V0010
};

struct RotationCalibrationRow {
  std::vector<double> a_direction, a_point_mm, b_direction, b_point_mm;  // 3 each
  std::vector<double> covariance;                                        // 64, row-major
  std::vector<double> point_c_mm, point_c_standard_uncertainty_mm;       // 3 each
  double noise_um = 0;
  double residual_rms_um = 0;
  double check_rms_um = 0;
  int check_count = 0;
  double condition_number = 0;
  std::vector<PoseResidualRow> poses;
  std::vector<std::string> axes{"A", "B"};  // the machine's letters of a and b
};

struct CalibrationRow {
  std::string calibration_id;  // UUID
  std::string machine_id;
  std::string method;
  std::vector<std::string> inputs;  // resource names
  std::string request_sha256;       // of a stored blob
  Instant valid_from, valid_until;
  std::string requested_by;
  std::string software_version;
  Recorded recorded;                               // set by InsertCalibration
  std::optional<SensorCalibrationRow> sensor;      // either this
  std::optional<RotationCalibrationRow> rotation;  // or this

  std::string kind() const { return sensor ? "sensor" : "rotation"; }
};

// Journal entry, calibration and residuals. Call it last before the commit (the journal's lock).
absl::StatusOr<Recorded> InsertCalibration(Transaction& transaction, const CalibrationRow& calibration,
                                           const std::string& summary_json);

// With its residuals.
absl::StatusOr<std::optional<CalibrationRow>> FindCalibration(Transaction& transaction,
                                                              const std::string& calibration_id);

// Of a machine and kind, the newest whose validity covers `at`; with its residuals.
absl::StatusOr<std::optional<CalibrationRow>> CalibrationInForce(Transaction& transaction,
                                                                 const std::string& machine_id, const std::string& kind,
                                                                 Instant at);
// When the last calibration of a machine and kind that had begun by `at` ended; nothing where none had begun.
absl::StatusOr<std::optional<Instant>> LastValidity(Transaction& transaction, const std::string& machine_id,
                                                    const std::string& kind, Instant at);

// Empty filters match all. Newest first, from below `before_sequence` (0: from the newest); without residuals.
absl::StatusOr<std::vector<CalibrationRow>> ListCalibrations(Transaction& transaction, const std::string& machine_id,
                                                             const std::string& kind, std::int64_t before_sequence,
                                                             int limit);

}  // namespace sixpoint::storage
