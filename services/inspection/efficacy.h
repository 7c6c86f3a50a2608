// What the record says of a machine's corrections, period by period: rows to the kernel's input, and its answer (docs/methods/efficacy.md).
#pragma once

#include <absl/status/statusor.h>

#include <map>
#include <string>
#include <vector>

#include "metrology/efficacy/efficacy.h"
#include "storage/outcomes.h"

namespace sixpoint::inspection {

// Blades that were cut under the same two calibrations and the same record of the machine: nothing else is pooled.
struct PeriodOutcomes {
  std::string sensor_calibration_id, rotation_calibration_id;
  int machine_revision = 0;
  bool in_force = false;  // all three are those of now
  metrology::RotaryAxes axes;
  std::vector<metrology::BladeOutcome> blades;  // in time
  // Of each blade, in the same order.
  struct Origin {
    std::string inspection_id;
    storage::Instant corrected_at;
    int reported_count = 0;
  };
  std::vector<Origin> origins;
};

struct LeftOutCounts {
  int not_inspected = 0, withdrawn = 0, positioning_open = 0, no_hole = 0, superseded_inspections = 0;
};

struct SortedOutcomes {
  std::vector<PeriodOutcomes> periods;  // the newest first
  LeftOutCounts left_out;
};

// INTERNAL where a period's axes are not there.
absl::StatusOr<SortedOutcomes> SortOutcomes(const storage::Outcomes& outcomes);

}  // namespace sixpoint::inspection
