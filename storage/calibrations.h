// Calibrations of machines: sensor to machine, the rotary axes, a point laser probe, how one axis positions.
#pragma once

#include <absl/status/statusor.h>

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "storage/database.h"
#include "storage/interim_checks.h"
#include "storage/record.h"
#include "storage/time_span.h"

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
  // Of a fit; none: it was stated by a certificate.
  std::optional<double> noise_um, touch_rms_um, residual_rms_um, condition_number;
  std::optional<std::int64_t> points_used;
  std::string certificate;                   // empty: measured
  std::vector<double> field_response;        // 6 x 9, row-major; empty: not known
  std::vector<double> field_terms_um;        // 9; empty: the scanner's field was not looked for
  std::vector<double> field_covariance_um2;  // 81, row-major, of them
  std::optional<double> field_stated_um;     // root mean square that was stated before
  std::string arm_series;                    // empty: not known, or several
  std::string arm_shares_json;               // series, response (36, row-major) of each; empty: of one, or not known
  std::optional<double> degrees_of_freedom;  // of the covariance; none: it rests on what was stated
  std::string sensor_serial_number;          // of its scans; empty: not known, or several
  std::string travel;                        // FORWARD, BACKWARD; empty: not known, or both
  std::vector<CentreResidualRow> centres;
};

struct PoseResidualRow {
  double a_deg = 0, b_deg = 0, distance_um = 0;
  bool held_out = false;
  std::optional<double> before_um = std::nullopt;
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
  std::optional<double> degrees_of_freedom;  // of the covariance; none: it rests on what was stated
  std::vector<double> linear_response;       // 8 x 6, row-major; empty: not known
  std::vector<PoseResidualRow> poses;
  std::vector<std::string> axes{"A", "B"};  // the machine's letters of a and b
};

struct ProbeResidualRow {
  std::string face;
  double displacement_mm = 0, residual_um = 0;
};

struct ProbeFaceCheckRow {
  std::string face;
  int reading_count = 0;
  double angle_urad = 0, origin_distance_um = 0, distance_um = 0, residual_range_um = 0;
};

struct ProbeCalibrationRow {
  std::string block;
  std::vector<double> approach, offset_mm;            // 3 each
  std::vector<double> covariance;                     // 36, row-major
  std::vector<double> point_standard_uncertainty_mm;  // 3
  double scale = 0, scale_standard_uncertainty = 0, direction_standard_uncertainty_urad = 0;
  double noise_um = 0, noise_factor = 1;
  double residual_rms_um = 0, touch_rms_um = 0;
  double condition_number = 0, displacement_matrix_condition_number = 0;
  double worst_approach_angle_deg = 0;
  std::vector<ProbeResidualRow> readings;
  std::vector<ProbeFaceCheckRow> checks;
};

// A figure in degrees and its standard uncertainty.
struct AngleEstimateRow {
  double value_deg = 0, standard_uncertainty_deg = 0;
};

struct AxisCharacterisationRow {
  std::string axis;  // the letter of the machine's joint
  int reading_count = 0;
  std::optional<int> beyond_limits_count;
  AngleEstimateRow reversal, mean, long_wave_amplitude;
  int long_wave_order = 0;  // periods in a turn
  std::optional<int> periodic_order;
  AngleEstimateRow periodic_amplitude;  // where there is one
  double least_detectable_deg = 0;
  AngleEstimateRow greatest_error;
  double greatest_error_at_deg = 0;
  bool greatest_error_forward = true;
  AngleEstimateRow standard_uncertainty, compensated_standard_uncertainty, noise;
  std::vector<double> forward_error_deg, backward_error_deg;  // the table, at equal steps; read with the residuals
  double table_standard_uncertainty_deg = 0;
};

// Where and when it was measured; nothing: not stated.
struct EnvironmentRow {
  std::optional<double> temperature_c, temperature_standard_uncertainty_c, humidity_percent;
  std::string note;
};

// What a person decided about a calibration after it was made.
struct CalibrationEvent {
  std::string reason;
  std::string requested_by;
  std::string software_version;
  Recorded recorded;
};

// Follows from clock and events (ADR 14).
enum class CalibrationState { kDraft, kNotYetValid, kInForce, kSuperseded, kExpired, kWithdrawn };

// What has one calibration in force at a time.
struct CalibrationSubject {
  std::string machine_id;
  std::string kind;
  std::string axis = "";  // of kind axis
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
  std::optional<ProbeCalibrationRow> probe;        // or this
  std::optional<AxisCharacterisationRow> axis;     // or this

  bool is_draft = false;        // made as a draft
  std::string judgements_json;  // [{of, ratio, count, probability, agrees}]; empty: none
  EnvironmentRow environment;

  // Set by reading: what has become of it by that moment.
  Instant as_of;
  CalibrationState state = CalibrationState::kInForce;
  std::string superseded_by;  // id; where state is kSuperseded
  std::optional<CalibrationEvent> release, withdrawal;
  std::optional<InterimStateRow> interim;  // of the sensor, read with the residuals; none: no check has judged it

  std::string kind() const { return sensor ? "sensor" : probe ? "probe" : axis ? "axis" : "rotation"; }
  CalibrationSubject subject() const { return {machine_id, kind(), axis ? axis->axis : ""}; }
  std::string name() const { return "calibrations/" + calibration_id; }
};

// Journal entry, calibration and residuals. Call it last before the commit (the journal's lock).
absl::StatusOr<Recorded> InsertCalibration(Transaction& transaction, const CalibrationRow& calibration,
                                           const RecordEntry& entry);

// With its residuals, and its state as of now.
absl::StatusOr<std::optional<CalibrationRow>> FindCalibration(Transaction& transaction,
                                                              const std::string& calibration_id);

// Of a subject's that are released, not withdrawn and valid at `at`, the one released (or, if it never was a
// draft, made) last; with its residuals. `at` asks about validity with the knowledge of now: a calibration that was
// withdrawn since is not given for a moment before its withdrawal either.
absl::StatusOr<std::optional<CalibrationRow>> CalibrationInForce(Transaction& transaction,
                                                                 const CalibrationSubject& subject, Instant at);
// The newest withdrawn one whose validity covers `at`: why there may be none in force.
absl::StatusOr<std::optional<CalibrationRow>> WithdrawnCalibration(Transaction& transaction,
                                                                   const CalibrationSubject& subject, Instant at);
// When the last calibration of a subject that was released, not withdrawn and had begun by `at` ended; nothing where none
// had begun.
absl::StatusOr<std::optional<Instant>> LastValidity(Transaction& transaction, const CalibrationSubject& subject,
                                                    Instant at);

struct CalibrationFilter {
  CalibrationSubject subject;             // what is empty matches all
  std::optional<CalibrationState> state;  // nothing: any
  TimeSpan recorded;
  bool with_residuals = false;  // reads those too
};
// Newest first, from below `before_sequence` (0: from the newest); states as of now.
absl::StatusOr<std::vector<CalibrationRow>> ListCalibrations(Transaction& transaction, const CalibrationFilter& filter,
                                                             std::int64_t before_sequence, int limit);

// The event and the journal's entry (releases/{id}, withdrawals/{id}). ALREADY_EXISTS where the calibration has one
// already. Holds the journal's lock when it returns: what DerivedFrom gives then is complete.
absl::StatusOr<Recorded> ReleaseCalibration(Transaction& transaction, const CalibrationRow& calibration,
                                            const CalibrationEvent& event,
                                            const std::optional<KeptRequest>& request = std::nullopt);
absl::StatusOr<Recorded> WithdrawCalibration(Transaction& transaction, const CalibrationRow& calibration,
                                             const CalibrationEvent& event,
                                             const std::optional<KeptRequest>& request = std::nullopt);

// Of a subject, all that were released and not withdrawn, by the time from which they are valid, the newest `limit` of
// them; without residuals.
absl::StatusOr<std::vector<CalibrationRow>> CalibrationHistory(Transaction& transaction,
                                                               const CalibrationSubject& subject, int limit);

}  // namespace sixpoint::storage
