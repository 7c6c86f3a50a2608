// Whether a calibrated parameter has moved from one calibration to the next (ADR 14).
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <vector>

namespace sixpoint::metrology {

struct DatedEstimate {
  double time_days = 0;
  double value = 0;
  double standard_uncertainty = 0;  // > 0
};

struct DriftOptions {
  double coverage_factor = 3;   // k
  std::optional<double> limit;  // greatest |value - first value|
};

struct DriftStep {
  double change = 0;
  double ratio = 0;  // change over the combined standard uncertainty of the two
  bool step_alarm = false, limit_alarm = false;
};

// value = a + slope (time - first time), weighted by 1 / uncertainty^2.
struct DriftLine {
  double slope_per_day = 0;
  double slope_standard_uncertainty_per_day = 0;  // with the scatter, where that is greater than stated
  double t = 0;
  double t_limit = 0;        // of Student's t with n - 2 degrees of freedom, at the two-sided probability of k sigma
  double scatter_ratio = 1;  // >= 1
};

struct Drift {
  std::vector<DriftStep> steps;   // of each estimate after the first
  std::optional<DriftLine> line;  // from three estimates on that differ in time
  bool step_alarm = false, trend_alarm = false, limit_alarm = false;
};

// Three rules, each an alarm:
//   STEP   two neighbours differ by more than k combined standard uncertainties;
//   TREND  the slope of a weighted straight line differs from 0 beyond Student's t for the probability of k sigma. Where the
//          estimates scatter more than they state, the slope's uncertainty grows with them (Birge), so that mere
//          irreproducibility is no trend;
//   LIMIT  a value lies further from the first one than the limit stated.
// The uncertainties are taken as independent: what the calibrations share (the same touch data) makes the alarm late, not
// false. INVALID_ARGUMENT for values that are not finite, uncertainties not above 0, or times not in order.
absl::StatusOr<Drift> AssessDrift(const std::vector<DatedEstimate>& estimates, const DriftOptions& options);

}  // namespace sixpoint::metrology
