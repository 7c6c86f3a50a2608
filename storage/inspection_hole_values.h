// What was measured of a hole beside its position and inclination, and the pitches of its row.
#pragma once

#include <absl/status/status.h>

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "storage/children.h"
#include "storage/database.h"

namespace sixpoint::storage {

struct InspectionRow;

// By InspectionRow::budget_sources.
struct StatedValueRow {
  double value = 0, expanded_uncertainty = 0;  // in the unit that the column's name says
  std::vector<double> budget_um = {};          // of an angle empty
};

// Uncertainties of a hole in the positioning that its inspection states, 95 %, without what other positionings would say.
struct StatedPositioningRow {
  double position_expanded_uncertainty_um = 0, inclination_expanded_uncertainty_deg = 0;
  double positioning_difference_deg = 0;  // how far the others turn its axis, at most
  double along_variance_um2 = 0, across_variance_um2 = 0, covariance_um2 = 0;  // of along_um and across_um
  double coverage_factor = 0;                                                  // of a displacement in any direction
};

struct HoleDetailRow {
  std::string measured_by;  // PIN, BORE
  std::string along_is;     // AXIS_IN_SURFACE, PART_Z, PART_X
  std::array<double, 3> along_in_part{}, across_in_part{};
  StatedValueRow along_um, across_um;
  StatedValueRow inclination_along_deg, inclination_across_deg;
  std::optional<double> pin_diameter_expanded_uncertainty_um;  // none: a bore
  std::optional<double> diameter_mm, diameter_expanded_uncertainty_um;
  std::string diameter_reason;                                               // empty exactly where there is a diameter
  std::optional<StatedPositioningRow> in_stated_positioning = std::nullopt;  // none: made before they were kept
};

struct HolePitchRow {
  int hole_index = 0, next_index = 0;  // in InspectionRow::holes
  double nominal_pitch_mm = 0;
  struct Measured {
    StatedValueRow pitch_mm;  // U in micrometres
    double pitch_over_diameter = 0, pitch_over_diameter_expanded_uncertainty = 0;
  };
  std::optional<Measured> measured;
  std::string reason;  // empty exactly where it was measured
};

// After the inspection's holes.
absl::Status InsertHoleValues(Transaction& transaction, const InspectionRow& inspection);
// Into the holes that are read already.
absl::Status ReadHoleValues(Transaction& transaction, const ParentRows<InspectionRow>& inspections);

}  // namespace sixpoint::storage
