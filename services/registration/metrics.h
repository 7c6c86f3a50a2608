// What the registration service counts for whoever watches (docs/observing.md).
#pragma once

#include <optional>
#include <string>

#include "services/runtime/metrics.h"

namespace sixpoint::registration {

// The series are there from the first call on; a service makes it at its start.
struct RegistrationMetrics {
  runtime::CounterBy recorded{"sixpoint_registrations_total",
                              "Registrations that were recorded, by outcome.",
                              "outcome",
                              {"CONVERGED", "NOT_CONVERGED", "NOT_DETERMINED", "TOO_LITTLE_OVERLAP", "INFEASIBLE"}};
  runtime::Histogram rms_metres{"sixpoint_registration_rms_metres",
                                "Root mean square of the residuals, of those that converged.",
                                {1e-6, 2e-6, 5e-6, 10e-6, 20e-6, 50e-6, 100e-6, 200e-6, 500e-6, 1e-3}};
  runtime::Histogram condition_number{"sixpoint_registration_condition_number",
                                      "Condition number of the fit, of those that converged.",
                                      {2, 5, 10, 20, 50, 100, 200, 500, 1000, 10'000}};
  runtime::Histogram compute_seconds{"sixpoint_registration_compute_seconds", "Time that the kernel took.",
                                     runtime::UsualSeconds()};
};
RegistrationMetrics& Metrics();

// One that was recorded now, and not before.
struct RecordedFit {
  std::string registration_id, outcome;
  double compute_seconds = 0;
  std::optional<double> residual_rms_um, condition_number;
};
void CountRecorded(const RecordedFit& fit);

}  // namespace sixpoint::registration
