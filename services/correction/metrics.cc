#include "services/correction/metrics.h"

namespace sixpoint::correction {

CorrectionMetrics& Metrics() {
  static auto* const metrics = new CorrectionMetrics();
  return *metrics;
}

}  // namespace sixpoint::correction
