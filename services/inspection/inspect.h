// The work of Inspect: every scan of the machined part against its CAD and each hole's pin, and the verdict.
#pragma once

#include <absl/status/statusor.h>

#include "metrology/inspection/blade_inspection.h"
#include "services/clients/scans.h"
#include "services/inspection/inputs.h"
#include "services/runtime/call.h"

namespace sixpoint::inspection {

// Scans are fetched one by one and not kept. FAILED_PRECONDITION: no point was near the CAD. CANCELLED: told to stop.
absl::StatusOr<metrology::BladeFindings> InspectBlade(const clients::ScanClient& scans, const Inputs& inputs,
                                                      int thread_count, const runtime::Caller& caller);

}  // namespace sixpoint::inspection
