// What the inspection service counts for whoever watches (docs/observing.md).
#pragma once

#include "services/runtime/metrics.h"

namespace sixpoint::inspection {

struct InspectionMetrics {
  runtime::CounterBy recorded{"sixpoint_inspections_total",
                              "Inspections that were recorded, by verdict.",
                              "verdict",
                              {"CONFORM", "NOT_CONFORM", "UNDECIDABLE", "NOT_MEASURED"}};
  runtime::Histogram deviation_rms_metres{"sixpoint_inspection_deviation_rms_metres",
                                          "Root mean square of the surface's deviations.",
                                          {1e-6, 2e-6, 5e-6, 10e-6, 20e-6, 50e-6, 100e-6, 200e-6, 500e-6, 1e-3}};
};
InspectionMetrics& Metrics();

}  // namespace sixpoint::inspection
