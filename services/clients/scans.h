// Scans as kernels want them, fetched from ingest, and sent to it.
#pragma once

#include <absl/status/statusor.h>

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "metrology/scanner/line_scanner.h"
#include "sixpoint/ingest/v1/ingest.pb.h"

namespace sixpoint::clients {

// A decoded scan, or some profiles of it, with the record that it came with.
struct FetchedScan {
  ingest::v1::Scan record;
  metrology::LineScan scan;
};

// A scan as it was stored: whole and checked, not decoded yet. A fiftieth of the memory of its points.
struct StoredBlocks {
  ingest::v1::Scan record;
  metrology::LineScan scan;  // without its points
  std::vector<ingest::v1::ScanBlock> blocks;

  // One of them. DATA_LOSS, SCAN_DAMAGED where it cannot be read. Thread-safe.
  absl::StatusOr<metrology::Points> DecodeOne(std::size_t index) const;
  // Block by block, in order.
  absl::Status Decode(const std::function<void(const metrology::Points& points_mm)>& take) const;
};

// Of a stored scan, counted from its first.
struct ProfileRange {
  int first = 0;
  int count = 0;  // 0: all from `first` on
};

// Thread-safe.
class ScanClient {
 public:
  explicit ScanClient(std::shared_ptr<grpc::Channel> ingest);
  ~ScanClient();
  // The record alone.
  absl::StatusOr<ingest::v1::Scan> Get(const std::string& name, std::unique_ptr<grpc::ClientContext> context) const;
  // Downloads and decodes scans/{id}. The blocks were checked and bounded when they were stored, so they are decoded in
  // process, once the whole has its counts and its digest (else DATA_LOSS, SCAN_DAMAGED).
  absl::StatusOr<FetchedScan> Fetch(const std::string& name, std::unique_ptr<grpc::ClientContext> context) const;
  // The same up to decoding.
  absl::StatusOr<StoredBlocks> FetchBlocks(const std::string& name, std::unique_ptr<grpc::ClientContext> context) const;
  // OK as long as ingest has the scan's points; else as FetchBlocks.
  absl::Status RequirePoints(const std::string& name, std::unique_ptr<grpc::ClientContext> context) const;
  // Only these profiles, decoded by the service; their number is checked.
  absl::StatusOr<FetchedScan> Fetch(const std::string& name, const ProfileRange& range,
                                    std::unique_ptr<grpc::ClientContext> context) const;
  // PrepareScan and UploadScan. The whole ends at the context's deadline; nothing else is taken from it, for each
  // stream needs one of its own. Returns when the scan is durable. The same call again is the same scan.
  absl::StatusOr<ingest::v1::StoredScan> Upload(ingest::v1::ScanHeader header, const metrology::Points& points_mm,
                                                std::unique_ptr<grpc::ClientContext> context) const;

 private:
  const std::shared_ptr<grpc::Channel> channel_;
  struct Stubs;  // as CalibrationClient's
  const std::unique_ptr<const Stubs> stubs_;
};

}  // namespace sixpoint::clients
