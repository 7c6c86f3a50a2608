// How the rotary axes of machines position.
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>
#include <vector>

#include "storage/database.h"
#include "storage/record.h"

namespace sixpoint::storage {

// A figure in degrees and its standard uncertainty.
struct AngleEstimateRow {
  double value_deg = 0, standard_uncertainty_deg = 0;
};

struct AxisCharacterisationRow {
  std::string characterisation_id;  // UUID
  std::string machine_id;
  std::string axis;
  std::vector<std::string> inputs;  // resource names
  std::string request_sha256;       // of a stored blob
  int reading_count = 0;
  AngleEstimateRow reversal, mean, long_wave_amplitude;
  int long_wave_order = 0;  // periods in a turn
  std::optional<int> periodic_order;
  AngleEstimateRow periodic_amplitude;  // where there is one
  double least_detectable_deg = 0;
  AngleEstimateRow greatest_error;
  double greatest_error_at_deg = 0;
  bool greatest_error_forward = true;
  AngleEstimateRow standard_uncertainty, compensated_standard_uncertainty, noise;
  std::vector<double> forward_error_deg, backward_error_deg;
  double table_standard_uncertainty_deg = 0;
  std::string requested_by;
  std::string software_version;
  Recorded recorded;  // set by InsertAxisCharacterisation
};

// Journal entry and row. Call it last before the commit (the journal's lock).
absl::StatusOr<Recorded> InsertAxisCharacterisation(Transaction& transaction, const AxisCharacterisationRow& row,
                                                    const std::string& summary_json);
absl::StatusOr<std::optional<AxisCharacterisationRow>> FindAxisCharacterisation(Transaction& transaction,
                                                                                const std::string& id);
// Empty filters match all. Newest first, from below `before_sequence` (0: from the newest).
absl::StatusOr<std::vector<AxisCharacterisationRow>> ListAxisCharacterisations(Transaction& transaction,
                                                                               const std::string& machine_id,
                                                                               const std::string& axis,
                                                                               std::int64_t before_sequence, int limit);

}  // namespace sixpoint::storage
