// Scans to and from the ingest service.
#pragma once

#include <absl/status/statusor.h>

#include <functional>
#include <string>

#include "cli/scan_blocks.h"
#include "cli/session.h"
#include "metrology/frames/pose.h"
#include "sixpoint/ingest/v1/ingest.pb.h"

namespace sixpoint::cli {

// Sends one scan, its header completed with count, encoding and error; tried again while the service is away or full
// (the same scan twice is one scan). `sent` is told the points of each block as it goes out, less those of an attempt
// that failed.
absl::StatusOr<ingest::v1::UploadScanResponse> UploadScan(Session* session, ingest::v1::ScanHeader header,
                                                          const EncodedScan& scan,
                                                          const std::function<void(std::int64_t)>& sent);

// As UploadScan; where the scan's id is taken by other content (another plant's files use the same ids), once more as
// {machine}.{id}. Running the same files again finds the same ids.
absl::StatusOr<ingest::v1::UploadScanResponse> UploadScanUnderFreeId(Session* session,
                                                                     const ingest::v1::ScanHeader& header,
                                                                     const EncodedScan& scan,
                                                                     const std::function<void(std::int64_t)>& sent);

struct DownloadedScan {
  ingest::v1::Scan record;
  metrology::Points points_mm;
};
absl::StatusOr<DownloadedScan> DownloadScan(Session* session, const std::string& scan_name);

}  // namespace sixpoint::cli
