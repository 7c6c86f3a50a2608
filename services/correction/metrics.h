// What the correction service counts for whoever watches (docs/observing.md).
#pragma once

#include "services/runtime/metrics.h"

namespace sixpoint::correction {

struct CorrectionMetrics {
  runtime::CounterBy recorded{
      "sixpoint_corrections_total",
      "Corrections that were recorded, by what the gate said: AUTOMATIC: released; AWAITING_PERSON: held.",
      "release",
      {"AUTOMATIC", "AWAITING_PERSON"}};
  runtime::CounterBy decided{"sixpoint_correction_decisions_total",
                             "Decisions of persons about corrections that were answered; a retry is another one.",
                             "decision",
                             {"RELEASED", "REFUSED"}};
};
CorrectionMetrics& Metrics();

}  // namespace sixpoint::correction
