// The one client of ScanService.UploadScan: sends a scan block by block, and goes on where it broke off.
//
// UNAVAILABLE, RESOURCE_EXHAUSTED, ABORTED and a broken stream are tried again from the service's next `accepted`, until
// the patience of RetryLimits is over without one more block acknowledged. Everything else is an answer.
#pragma once

#include <absl/status/statusor.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>

#include "services/clients/scan_blocks.h"
#include "services/runtime/retry.h"
#include "sixpoint/ingest/v1/ingest.pb.h"

namespace sixpoint::clients {

struct UploadOptions {
  // Its deadline is that of each stream and of the whole; its patience begins anew with each block acknowledged.
  runtime::RetryLimits retry;
  // No block goes out before a scanner of this rate would have measured it; 0: as fast as it goes.
  double profiles_per_s = 0;
  // Send waits while more payload than this waits for its acknowledgement.
  std::size_t unacknowledged_limit_bytes = std::size_t{16} << 20;
  // Hears of points that became durable, each once, on the caller's thread; may be empty.
  std::function<void(std::int64_t)> acknowledged;
};

// For a machine that measures while it sends: keeps only what is not acknowledged yet, and the digest. One thread only.
// After a failure every call gives that failure; the same scan may be begun again, by this process or another.
class ScanUploader {
 public:
  ScanUploader(std::shared_ptr<grpc::Channel> ingest, UploadOptions options);
  // A scan that was not ended stays unfinished at the service.
  ~ScanUploader();

  // Returns once the service accepted the header. Blocks that it has already are not sent again, but must be given.
  absl::Status Begin(ingest::v1::ScanHeader header);
  // Returns once the block is on its way, and what waits is within the limit. DATA_LOSS (BLOCKS_FORGOTTEN) where the
  // service lost blocks that it had acknowledged.
  absl::Status Send(OutgoingBlock block);
  // Returns once the scan is durable.
  absl::StatusOr<ingest::v1::StoredScan> End();

  // Payload that is not acknowledged yet.
  std::size_t unacknowledged_bytes() const { return kept_bytes_; }

 private:
  friend absl::StatusOr<ingest::v1::StoredScan> UploadScan(const std::shared_ptr<grpc::Channel>& ingest,
                                                           const OutgoingScan& scan, UploadOptions options);
  class Stream;
  absl::Status SendShared(std::shared_ptr<const OutgoingBlock> block);
  absl::Status Open();
  absl::Status Reopen();
  bool WritePending();
  bool WriteEnd();
  void TakeAcknowledged(int next_block);
  void WaitForItsMeasurement(int profile_count);

  const std::shared_ptr<grpc::Channel> channel_;
  struct Stubs;  // as CalibrationClient's
  const std::unique_ptr<const Stubs> stubs_;
  const UploadOptions options_;
  runtime::Retry retry_;
  // Whether blocks outlive their acknowledgement: then the service may forget and ask for them again.
  bool keeps_all_ = false;

  ingest::v1::ScanHeader header_;
  PayloadsDigest digest_;
  std::int64_t point_count_ = 0;
  int block_count_ = 0;
  std::deque<std::shared_ptr<const OutgoingBlock>> kept_;
  int first_kept_ = 0;  // index of kept_.front()
  std::size_t kept_bytes_ = 0;
  int next_to_send_ = 0;
  int told_block_count_ = 0;  // options_.acknowledged heard of these
  int most_durable_ = 0;
  std::chrono::steady_clock::time_point measuring_since_;
  std::int64_t measured_profile_count_ = 0;
  std::unique_ptr<Stream> stream_;
  absl::Status failure_;
};

// The same for a scan that is there as a whole: may begin again even where the service forgot it. Thread-safe.
absl::StatusOr<ingest::v1::StoredScan> UploadScan(const std::shared_ptr<grpc::Channel>& ingest,
                                                  const OutgoingScan& scan, UploadOptions options);

}  // namespace sixpoint::clients
