// Pure checks of what clients send.
#pragma once

#include <absl/status/status.h>

#include "sixpoint/ingest/v1/ingest.pb.h"
#include "sixpoint/inspection/v1/inspection.pb.h"

namespace sixpoint::inspection {

// Refuses bad names and ids, no scans, more than 200, a scan named twice, and positioning as a blank. What else there is to
// say of method and options, registration says.
absl::Status CheckInspect(const v1::InspectRequest& request);

// Refuses a scan that is not of this blade or not of a machined part with pins. index: its place in the request.
absl::Status CheckScan(int index, const ingest::v1::ScanHeader& header, const std::string& blade);

}  // namespace sixpoint::inspection
