// Registrations with their scans, datum points and evidence.
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

struct RegistrationScanRow {
  std::string scan_id;
  std::int64_t point_count = 0;
  std::int64_t points_used = 0;
  std::optional<double> residual_median_um;  // none: not determined
};

struct RegistrationDatumRow {
  std::string datum_name;
  double distance_um = 0;
  double standard_uncertainty_um = 0;
  std::int64_t point_count = 0;
};

// Two scans where they see the same surface.
struct RegistrationAgreementRow {
  std::string scan_id;
  std::string other_scan_id;
  std::int64_t patch_count = 0;
  double difference_rms_um = 0;
  double expected_rms_um = 0;
};

// An angle of a rotary axis that scans were taken at.
struct RegistrationAngleRow {
  std::string axis;
  std::string characterisation_id;  // whose table was applied; empty: none was
  double commanded_deg = 0;
  double reached_deg = 0;
  double standard_uncertainty_deg = 0;
  double half_reversal_deg = 0;
  std::vector<double> pose_per_rad;  // 6; empty unless the outcome is CONVERGED
};

// What makes the pose uncertain, beside noise and angles.
struct RegistrationErrorSourceRow {
  std::string source_name;
  std::optional<double> degrees_of_freedom = std::nullopt;  // none: it is taken as known
  int draw_count = 0;
  std::vector<double> parameters_per_sigma;  // a row each calibration parameter, row-major
  std::vector<double> pose_per_sigma;        // 6 rows
};

struct RegistrationRow {
  std::string registration_id;
  std::string blade_serial;
  std::string machine_id;
  int machine_revision = 0;
  std::string part_id;
  int part_revision = 0;
  std::string method;  // BEST_FIT, LOCAL, SIX_POINT, SIX_POINT_NORMALS, ALLOWANCE
  std::string sensor_calibration_id;
  std::string rotation_calibration_id;
  std::string outcome;  // CONVERGED, NOT_CONVERGED, NOT_DETERMINED, TOO_LITTLE_OVERLAP, INFEASIBLE
  // By rows; all five empty unless the outcome is CONVERGED.
  std::vector<double> zero_from_part;    // 3 x 4
  std::vector<double> reference_mm;      // 3
  std::vector<double> covariance;        // 6 x 6
  std::vector<double> noise_covariance;  // 6 x 6
  // 6 rows, a column each calibrated parameter (metrology/kinematics/calibration_parameters.h).
  std::vector<double> calibration_sensitivity;
  std::int64_t point_count = 0;
  std::int64_t points_used = 0;
  int iteration_count = 0;
  // None, and no direction: not determined.
  std::optional<double> residual_rms_um, residual_sigma_um, condition_number;
  std::vector<double> weakest_direction;  // 6
  std::optional<double> weakest_standard_uncertainty_um;
  std::string remark;
  double compute_seconds = 0;
  std::string requested_by;
  std::string software_version;
  std::string computed_on;  // processor and C library; empty: made before it was kept
  std::string weakest_direction_in_words;
  std::optional<double> noise_sigma_um, model_sigma_um;  // not of ALLOWANCE, nor before these were kept
  std::optional<double> information_kept, surface_part;
  std::optional<double> least_stock_mm, lacking_mm;           // of ALLOWANCE
  std::optional<double> disagreement_um, disagreement_ratio;  // where compared with the best fit
  std::optional<bool> disagrees;                              // beyond the limit in force when it was made
  bool for_inspection = false;                                // made by one for its verdict
  std::string clamping;                                       // as stated; empty: it was not
  std::string station;                                        // its scans'; empty: the part has none
  std::optional<double> thermal_stretch;                      // none: no temperature was stated
  bool sensor_calibration_asked = false;                      // and not the one in force when the scans were received
  std::optional<Instant> scans_received_at;                   // the last of them; none: made before it was kept
  std::string options_json = "{}";                            // registration.v1.FitOptions
  std::string detail_json = "{}";                             // registration.v1.Evidence: what has no column
  Recorded recorded;                                          // set by InsertRegistration
  std::vector<RegistrationScanRow> scans;
  std::vector<RegistrationAgreementRow> agreements;
  std::vector<RegistrationDatumRow> datums;
  std::vector<RegistrationAngleRow> angles;  // where they are uncertain
  std::vector<RegistrationErrorSourceRow> error_sources;
};

struct RegistrationFilter : ResultFilter {
  std::string outcome;            // empty: any
  bool only_disagreeing = false;  // with the best fit of the same scans
  bool without_for_inspection = false;
};

using RegistrationStore = ResultStore<RegistrationRow, RegistrationFilter>;
// In PostgreSQL; the database lives longer.
std::shared_ptr<RegistrationStore> RegistrationsIn(Database* database);

// The same in a transaction of the caller's.
// Journal entry, registration, scans, agreements, datums and angles. Call it last before the commit (the journal's lock).
absl::StatusOr<Recorded> InsertRegistration(Transaction& transaction, const RegistrationRow& registration,
                                            const RecordEntry& entry);

absl::StatusOr<std::optional<RegistrationRow>> FindRegistration(Transaction& transaction,
                                                                const std::string& registration_id);

// Newest first, from below `before_sequence` (0: from the newest).
absl::StatusOr<std::vector<RegistrationRow>> ListRegistrations(Transaction& transaction,
                                                               const RegistrationFilter& filter,
                                                               std::int64_t before_sequence, int limit);

}  // namespace sixpoint::storage
