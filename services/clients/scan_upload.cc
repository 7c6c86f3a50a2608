#include "services/clients/scan_upload.h"

#include <algorithm>
#include <condition_variable>
#include <limits>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"

namespace sixpoint::clients {
namespace {

using ingest::v1::StoredScan;
using ingest::v1::UploadProgress;
using ingest::v1::UploadScanRequest;
using ingest::v1::UploadScanResponse;

constexpr double kNoDeadline_s = 365.0 * 86400;
constexpr int kEveryBlock = std::numeric_limits<int>::max();

std::unique_ptr<grpc::ClientContext> ContextUntil(std::chrono::steady_clock::time_point deadline) {
  const double left_s = std::chrono::duration<double>(deadline - std::chrono::steady_clock::now()).count();
  return runtime::ContextFor(std::clamp(left_s, 0.001, kNoDeadline_s));
}

// Our servers give every status its details. INTERNAL, UNKNOWN and CANCELLED without them are gRPC's own words for a
// stream that broke.
absl::Status WhyItEnded(const grpc::Status& status) {
  if (status.ok()) return absl::UnavailableError("the stream ended without an answer");
  const bool broke = status.error_code() == grpc::StatusCode::INTERNAL ||
                     status.error_code() == grpc::StatusCode::UNKNOWN ||
                     status.error_code() == grpc::StatusCode::CANCELLED;
  if (broke && status.error_details().empty())
    return absl::UnavailableError("the stream broke: " + status.error_message());
  return runtime::FromGrpc(status);
}

}  // namespace

// One stream: written by its owner, read by a thread of its own.
class ScanUploader::Stream {
 public:
  Stream(ingest::v1::ScanService::Stub* stub, std::unique_ptr<grpc::ClientContext> context,
         const ingest::v1::ScanHeader& header)
      : context_(std::move(context)), stream_(stub->UploadScan(context_.get())) {
    UploadScanRequest request;
    *request.mutable_header() = header;
    stream_->Write(request);  // where it fails, the reader finds the end
    reader_ = std::thread([this] { ReadAnswers(); });
  }
  ~Stream() {
    context_->TryCancel();
    Finish();
  }

  bool Write(const UploadScanRequest& request) { return stream_->Write(request); }
  bool WritesDone() { return stream_->WritesDone(); }

  // Nothing where the stream ended before it came.
  std::optional<UploadProgress> WaitForAccepted() {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [&] { return accepted_.has_value() || ended_; });
    return accepted_;
  }
  int next_block() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return next_block_;
  }
  // For one more block or, after the end was sent, for the scan itself. False where the stream ended before it.
  bool WaitForMoreThan(int next_block, bool or_stored) {
    std::unique_lock<std::mutex> lock(mutex_);
    const auto came = [&] { return next_block_ > next_block || (or_stored && stored_.has_value()); };
    changed_.wait(lock, [&] { return came() || ended_; });
    return came();
  }
  std::optional<StoredScan> stored() {
    const std::lock_guard<std::mutex> lock(mutex_);
    return stored_;
  }
  // Of a stream that ended, or was cancelled.
  grpc::Status Finish() {
    if (reader_.joinable()) {
      reader_.join();
      status_ = stream_->Finish();
    }
    return status_;
  }

 private:
  void ReadAnswers() {
    UploadScanResponse response;
    while (stream_->Read(&response)) {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (response.has_accepted()) accepted_ = response.accepted();
      if (response.has_accepted()) next_block_ = response.accepted().next_block();
      if (response.has_acknowledged()) next_block_ = std::max(next_block_, response.acknowledged().next_block());
      if (response.has_stored()) stored_ = std::move(*response.mutable_stored());
      changed_.notify_all();
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    ended_ = true;
    changed_.notify_all();
  }

  const std::unique_ptr<grpc::ClientContext> context_;
  const std::unique_ptr<grpc::ClientReaderWriter<UploadScanRequest, UploadScanResponse>> stream_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<UploadProgress> accepted_;
  std::optional<StoredScan> stored_;
  int next_block_ = 0;
  bool ended_ = false;
  grpc::Status status_;
  std::thread reader_;
};

struct ScanUploader::Stubs {
  std::unique_ptr<ingest::v1::ScanService::Stub> scans;
};

ScanUploader::ScanUploader(std::shared_ptr<grpc::Channel> ingest, UploadOptions options)
    : channel_(std::move(ingest)),
      stubs_(new Stubs{ingest::v1::ScanService::NewStub(channel_)}),
      options_(std::move(options)),
      retry_("ingest", options_.retry) {}

ScanUploader::~ScanUploader() = default;

absl::Status ScanUploader::Begin(ingest::v1::ScanHeader header) {
  header_ = std::move(header);
  measuring_since_ = std::chrono::steady_clock::now();
  failure_ = Open();
  if (!failure_.ok()) failure_ = Reopen();
  return failure_;
}

// One attempt.
absl::Status ScanUploader::Open() {
  stream_ = std::make_unique<Stream>(stubs_->scans.get(), ContextUntil(options_.retry.deadline), header_);
  const std::optional<UploadProgress> accepted = stream_->WaitForAccepted();
  if (!accepted.has_value()) return WhyItEnded(stream_->Finish());
  const int durable = accepted->complete() ? kEveryBlock : accepted->next_block();
  if (durable < first_kept_) {
    return runtime::Failure(errors::v1::BLOCKS_FORGOTTEN,
                            "scan " + header_.scan_id() + ": ingest goes on from block " + std::to_string(durable) +
                                ", but had acknowledged all below " + std::to_string(first_kept_),
                            {{"resource", "scans/" + header_.scan_id()}});
  }
  next_to_send_ = durable;
  TakeAcknowledged(durable);
  return absl::OkStatus();
}

// After `failure_`, or where the stream ended: again and again, until it is an answer.
absl::Status ScanUploader::Reopen() {
  absl::Status why = failure_;
  if (why.ok()) {
    why = WhyItEnded(stream_->Finish());
    // Its last acknowledgements are progress too, before patience is asked.
    TakeAcknowledged(std::min(stream_->next_block(), next_to_send_));
  }
  while (!why.ok() && retry_.TryAgain(why, channel_)) why = Open();
  if (!why.ok()) stream_.reset();
  return why;
}

void ScanUploader::WaitForItsMeasurement(int profile_count) {
  if (!(options_.profiles_per_s > 0)) return;
  measured_profile_count_ += profile_count;
  const std::chrono::duration<double> measured(static_cast<double>(measured_profile_count_) / options_.profiles_per_s);
  std::this_thread::sleep_until(measuring_since_ +
                                std::chrono::duration_cast<std::chrono::steady_clock::duration>(measured));
}

// Told, and dropped where they need not be kept.
void ScanUploader::TakeAcknowledged(int next_block) {
  if (next_block > most_durable_) {
    most_durable_ = next_block;
    retry_.Progressed();
  }
  for (; told_block_count_ < std::min(next_block, block_count_); ++told_block_count_) {
    const auto& block = kept_[static_cast<std::size_t>(told_block_count_ - first_kept_)];
    if (options_.acknowledged) options_.acknowledged(block->point_count);
  }
  if (keeps_all_) return;
  for (; first_kept_ < std::min(next_block, block_count_); ++first_kept_) {
    kept_bytes_ -= kept_.front()->payload.size();
    kept_.pop_front();
  }
}

// False where the stream broke.
bool ScanUploader::WritePending() {
  UploadScanRequest request;
  for (; next_to_send_ < block_count_; ++next_to_send_) {
    const OutgoingBlock& kept = *kept_[static_cast<std::size_t>(next_to_send_ - first_kept_)];
    ingest::v1::ScanBlock* block = request.mutable_block();
    block->set_index(next_to_send_);
    block->set_point_count(kept.point_count);
    block->set_payload(kept.payload);
    if (!stream_->Write(request)) return false;
    // Nothing is durable that was not sent.
    TakeAcknowledged(std::min(stream_->next_block(), next_to_send_));
  }
  TakeAcknowledged(std::min(stream_->next_block(), next_to_send_));
  return true;
}

absl::Status ScanUploader::Send(OutgoingBlock block) {
  return SendShared(std::make_shared<const OutgoingBlock>(std::move(block)));
}

absl::Status ScanUploader::SendShared(std::shared_ptr<const OutgoingBlock> block) {
  if (!failure_.ok()) return failure_;
  if (stream_ == nullptr) return absl::FailedPreconditionError("Send before Begin");
  WaitForItsMeasurement(block->profile_count);
  digest_.Add(block->payload);
  point_count_ += block->point_count;
  if (!keeps_all_) kept_bytes_ += block->payload.size();
  kept_.push_back(std::move(block));
  ++block_count_;
  if (next_to_send_ >= block_count_) TakeAcknowledged(next_to_send_);  // the service has it already
  while (true) {
    const bool going = WritePending() && (kept_bytes_ <= options_.unacknowledged_limit_bytes ||
                                          stream_->WaitForMoreThan(first_kept_, false));
    if (!going) {
      failure_ = Reopen();
      if (!failure_.ok()) return failure_;
    } else if (kept_bytes_ <= options_.unacknowledged_limit_bytes) {
      return absl::OkStatus();
    }
  }
}

// False where the stream broke before the scan was stored.
bool ScanUploader::WriteEnd() {
  UploadScanRequest request;
  ingest::v1::ScanEnd* end = request.mutable_end();
  end->set_block_count(block_count_);
  end->set_point_count(point_count_);
  end->set_sha256(digest_.ToHex());
  if (!stream_->Write(request) || !stream_->WritesDone()) return false;
  int next_block = stream_->next_block();
  while (stream_->WaitForMoreThan(next_block, true)) {
    next_block = stream_->next_block();
    TakeAcknowledged(std::min(next_block, next_to_send_));
    if (stream_->stored().has_value()) return true;
  }
  return false;
}

absl::StatusOr<StoredScan> ScanUploader::End() {
  if (!failure_.ok()) return failure_;
  if (stream_ == nullptr) return absl::FailedPreconditionError("End before Begin");
  while (!(WritePending() && WriteEnd())) {
    failure_ = Reopen();
    if (!failure_.ok()) return failure_;
  }
  TakeAcknowledged(kEveryBlock);
  stream_->Finish();  // the scan is durable, whatever becomes of the stream
  return *stream_->stored();
}

absl::StatusOr<StoredScan> UploadScan(const std::shared_ptr<grpc::Channel>& ingest, const OutgoingScan& scan,
                                      UploadOptions options) {
  ScanUploader uploader(ingest, std::move(options));
  uploader.keeps_all_ = true;
  if (absl::Status begun = uploader.Begin(scan.header); !begun.ok()) return begun;
  for (const OutgoingBlock& block : scan.blocks) {
    // Not owned: the scan outlives the upload.
    absl::Status sent = uploader.SendShared(std::shared_ptr<const OutgoingBlock>(std::shared_ptr<void>(), &block));
    if (!sent.ok()) return sent;
  }
  return uploader.End();
}

}  // namespace sixpoint::clients
