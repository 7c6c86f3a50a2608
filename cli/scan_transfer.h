// Scans to and from the ingest service.
#pragma once

#include <absl/status/statusor.h>

#include <functional>
#include <optional>
#include <string>

#include "cli/session.h"
#include "services/clients/scan_blocks.h"
#include "services/clients/scans.h"

namespace sixpoint::cli {

// Sends one scan and returns when it is durable; goes on where it broke off while the service is away or full (the same
// scan twice is one scan). `acknowledged` is told points that became durable, each once.
absl::StatusOr<ingest::v1::StoredScan> UploadScan(Session* session, const clients::OutgoingScan& scan,
                                                  const std::function<void(std::int64_t)>& acknowledged);

// As UploadScan; where the scan's id is taken by other content (another plant's files use the same ids), once more as
// {machine}.{id}. Running the same files again finds the same ids.
absl::StatusOr<ingest::v1::StoredScan> UploadScanUnderFreeId(Session* session, clients::OutgoingScan scan,
                                                             const std::function<void(std::int64_t)>& acknowledged);

// The whole scan, or some profiles of it.
absl::StatusOr<clients::FetchedScan> DownloadScan(Session* session, const std::string& scan_name,
                                                  const std::optional<clients::ProfileRange>& range = std::nullopt);

}  // namespace sixpoint::cli
