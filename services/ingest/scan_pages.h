// Pages of ListScans: what a request asks for, and the opaque token that goes on from a page's end.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <string>

#include "services/runtime/pages.h"
#include "sixpoint/ingest/v1/ingest.pb.h"
#include "storage/scans.h"

namespace sixpoint::ingest {

struct ScanPage {
  storage::ScanFilter filter;
  runtime::Page page;
};

// Refuses a bad filter, a negative size, and a token that was not made for these filters. More than 1000 means 1000.
absl::StatusOr<ScanPage> PageOf(const v1::ListScansRequest& request);

std::string TokenAfter(const v1::ListScansRequest& request, std::int64_t last_sequence);

}  // namespace sixpoint::ingest
