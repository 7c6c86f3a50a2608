// Scans as kernels want them, fetched from ingest, and sent to it.
#pragma once

#include <absl/status/statusor.h>

#include <functional>
#include <memory>
#include <string>

#include "metrology/scanner/line_scanner.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"

namespace sixpoint::clients {

// A decoded scan with the record that it came with.
struct FetchedScan {
  ingest::v1::Scan record;
  metrology::LineScan scan;
};

// Downloads and decodes scans/{id}. The blocks were checked and bounded when they were stored, so they are decoded in
// process. Thread-safe.
class ScanClient {
 public:
  explicit ScanClient(std::shared_ptr<grpc::Channel> ingest);
  absl::StatusOr<FetchedScan> Fetch(const std::string& name, std::unique_ptr<grpc::ClientContext> context) const;
  // Cuts the points into blocks and uploads them with this header; point_count is set here, and for ENCODING_DRACO (the
  // default) the blocks are encoded here within error_bound_um (0: 0.25 um) and sender_error_um grows by what that
  // cost. Returns when the scan is durable. The same call again, with the same input, is the same scan.
  absl::StatusOr<ingest::v1::StoredScan> Upload(ingest::v1::ScanHeader header,
                                                        const metrology::Points& points_mm,
                                                        std::unique_ptr<grpc::ClientContext> context) const;

 private:
  std::unique_ptr<ingest::v1::ScanService::Stub> stub_;
};

}  // namespace sixpoint::clients
