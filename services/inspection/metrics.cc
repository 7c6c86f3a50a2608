#include "services/inspection/metrics.h"

namespace sixpoint::inspection {

InspectionMetrics& Metrics() {
  static auto* const metrics = new InspectionMetrics();
  return *metrics;
}

}  // namespace sixpoint::inspection
