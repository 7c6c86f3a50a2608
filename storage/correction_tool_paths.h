// The poses of a correction's group that is a path of the tool.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "storage/database.h"

namespace sixpoint::storage {

struct CorrectionToolPoseRow {
  std::array<double, 3> tip_mm{}, nominal_tip_mm{};
  std::array<double, 2> commanded_deg{}, nominal_deg{};  // a, b
  std::optional<std::array<double, 2>> reached_deg;      // of all poses, or of none
  double tilt_deg = 0;
  std::array<double, 2> standard_uncertainty_deg{};
  double expanded_uncertainty_um = 0;
};
// Of a path that goes with a reconstruction's shape: correction.v1.PathAdaptation.
struct PathAdaptationRow {
  double greatest_shift_mm = 0, greatest_turn_deg = 0, gouge_um = 0, rest_um = 0;
  std::optional<double> deepest_compensation_um;  // there was a pass before
};
struct CorrectionToolPathRow {
  std::vector<CorrectionToolPoseRow> poses;
  double greatest_chord_um = 0, greatest_axis_deviation_deg = 0;
  std::optional<PathAdaptationRow> adaptation = {};
};

absl::Status InsertCorrectionToolPath(Transaction& transaction, const std::string& correction_id,
                                      const std::string& group, const CorrectionToolPathRow& path);
// By their groups.
absl::StatusOr<std::map<std::string, CorrectionToolPathRow>> CorrectionToolPathsOf(Transaction& transaction,
                                                                                   const std::string& correction_id);

}  // namespace sixpoint::storage
