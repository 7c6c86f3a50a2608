// A registered blade's scanned points, as services that look at its whole surface read them.
#pragma once

#include <absl/status/status.h>

#include <functional>

#include "metrology/scanner/line_scanner.h"
#include "services/clients/registered_blade.h"
#include "services/runtime/call.h"

namespace sixpoint::correction {

// begin: a scan without its points; add: its points in the sensor frame as they come. INVALID_ARGUMENT: pins stand in it.
absl::Status ReadBladePoints(const clients::ScanClient& scans, const clients::RegisteredBlade& blade,
                             const runtime::Caller& caller,
                             const std::function<absl::Status(const metrology::LineScan&)>& begin,
                             const std::function<absl::Status(const metrology::Points&)>& add);

}  // namespace sixpoint::correction
