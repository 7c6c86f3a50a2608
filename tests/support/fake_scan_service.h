// An ingest service in memory that keeps the contract of UploadScan, and breaks off where a test says so.
#pragma once

#include <deque>
#include <limits>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "sixpoint/ingest/v1/ingest.grpc.pb.h"

namespace sixpoint::testing {

// How one UploadScan stream goes: counts are of the blocks that come on it.
struct StreamScript {
  static constexpr int kAll = std::numeric_limits<int>::max();
  grpc::Status status;          // how it ends; OK after all: as the contract says
  int end_after_blocks = kAll;  // with `status`; kAll: at the end message
  bool is_accepted = true;      // false: `status` answers the header
  int durable_blocks = kAll;
  int acknowledged_blocks = kAll;
  bool forgets = false;  // what was there of the scan is gone
};

class FakeScanService final : public ingest::v1::ScanService::Service {
 public:
  struct Stored {
    ingest::v1::ScanHeader header;
    std::vector<ingest::v1::ScanBlock> blocks;  // as sent
    ingest::v1::Scan record;
    bool complete = false;
  };

  // The next streams, in turn; those after behave.
  void Script(StreamScript script);
  std::string refused_scan;  // its end is answered INVALID_ARGUMENT

  // After the calls.
  std::size_t complete_scan_count() const;
  const Stored& stored(const std::string& scan_id) const { return scans_.at(scan_id); }
  // Indices of the blocks that came, stream by stream.
  std::vector<std::vector<int>> received() const;

  grpc::Status UploadScan(
      grpc::ServerContext* context,
      grpc::ServerReaderWriter<ingest::v1::UploadScanResponse, ingest::v1::UploadScanRequest>* stream) override;
  // Of scans that came as XYZ_F64 or DRACO.
  grpc::Status DownloadScan(grpc::ServerContext* context, const ingest::v1::DownloadScanRequest* request,
                            grpc::ServerWriter<ingest::v1::DownloadScanResponse>* writer) override;

 private:
  grpc::Status Complete(const ingest::v1::ScanEnd& end, Stored* scan, ingest::v1::StoredScan* stored);

  mutable std::mutex mutex_;
  std::deque<StreamScript> scripts_;
  std::map<std::string, Stored> scans_;
  std::vector<std::vector<int>> received_;
};

}  // namespace sixpoint::testing
