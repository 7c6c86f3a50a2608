#include "services/registration/metrics.h"

namespace sixpoint::registration {

RegistrationMetrics& Metrics() {
  static auto* const metrics = new RegistrationMetrics();
  return *metrics;
}

void CountRecorded(const RecordedFit& fit) {
  Metrics().recorded.Add(fit.outcome);
  Metrics().compute_seconds.Observe(fit.compute_seconds);
  // Of the others both are of a pose that nobody gets.
  if (fit.outcome != "CONVERGED") return;
  if (fit.residual_rms_um) Metrics().rms_metres.Observe(*fit.residual_rms_um * 1e-6);
  if (fit.condition_number) Metrics().condition_number.Observe(*fit.condition_number);
}

}  // namespace sixpoint::registration
