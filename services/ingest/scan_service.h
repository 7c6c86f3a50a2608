// sixpoint.ingest.v1.ScanService.
#pragma once

#include <memory>
#include <string>

#include "services/ingest/decode_workers.h"
#include "services/ingest/known_plant.h"
#include "services/runtime/call_watch.h"
#include "services/runtime/compute_pool.h"
#include "services/runtime/peer_shares.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"
#include "storage/scan_store.h"

namespace sixpoint::ingest {

struct ScanServiceOptions {
  std::string decode_worker;                          // path of sixpoint-decode-worker
  int worker_count = 2;                               // decoding at once in workers, and encoding at once here
  std::chrono::milliseconds decode_patience{10'000};  // for one block
  // Each holds a thread and one block; more are RESOURCE_EXHAUSTED at once.
  int greatest_upload_count = 64;
  // For its header, until which a stream has no place among the uploads.
  std::chrono::milliseconds header_patience{5'000};
  // For its place, once the header is there: a small scan's upload is soon over, and to refuse one costs nearly as much.
  std::chrono::milliseconds place_patience{10'000};
  // A stream on which nothing moves for so long is ended.
  std::chrono::milliseconds stream_patience{60'000};
};

class ScanService final : public v1::ScanService::Service {
 public:
  ScanService(const ScanServiceOptions& options, std::shared_ptr<storage::ScanStore> store,
              std::shared_ptr<grpc::Channel> plant);

  grpc::Status UploadScan(grpc::ServerContext* context,
                          grpc::ServerReaderWriter<v1::UploadScanResponse, v1::UploadScanRequest>* stream) override;
  grpc::Status GetScan(grpc::ServerContext* context, const v1::GetScanRequest* request, v1::Scan* response) override;
  grpc::Status ListScans(grpc::ServerContext* context, const v1::ListScansRequest* request,
                         v1::ListScansResponse* response) override;
  grpc::Status DownloadScan(grpc::ServerContext* context, const v1::DownloadScanRequest* request,
                            grpc::ServerWriter<v1::DownloadScanResponse>* writer) override;
  grpc::Status ListScanBlocks(grpc::ServerContext* context, const v1::ListScanBlocksRequest* request,
                              v1::ListScanBlocksResponse* response) override;
  grpc::Status GetScanBlob(grpc::ServerContext* context, const v1::GetScanBlobRequest* request,
                           v1::ScanBlob* response) override;
  grpc::Status PreviewScan(grpc::ServerContext* context, const v1::PreviewScanRequest* request,
                           v1::PreviewScanResponse* response) override;

 private:
  // A page asks for two at once; several people look at blades.
  static constexpr int kPreviewsAtOnce = 2, kPreviewsWaiting = 8;

  using UploadStream = grpc::ServerReaderWriter<v1::UploadScanResponse, v1::UploadScanRequest>;
  // A stream that is an upload: its header, and its place.
  struct Begun {
    v1::ScanHeader header;
    runtime::PeerShares::Share share;
    runtime::ComputePool::Slot slot;
  };
  // Waits among a bounded number of others.
  absl::StatusOr<Begun> BeginUpload(grpc::ServerContext* context, UploadStream* stream);
  absl::StatusOr<v1::ScanHeader> ReadHeader(grpc::ServerContext* context, UploadStream* stream);
  absl::Status Upload(grpc::ServerContext* context, UploadStream* stream);

  const std::shared_ptr<storage::ScanStore> store_;
  KnownPlant plant_;
  DecodeWorkers workers_;
  runtime::ComputePool encoding_;
  // Twice as many wait, for their header or their place, as upload; of both one peer has at most half, so that others go on.
  runtime::ComputePool headers_, uploads_;
  runtime::PeerShares header_shares_, upload_shares_;
  runtime::ComputePool previews_{{kPreviewsAtOnce, kPreviewsWaiting}, "previews", errors::v1::PREVIEWS_FULL};
  runtime::CallWatchdog watchdog_;
  const std::chrono::milliseconds header_patience_, place_patience_, stream_patience_;
};

}  // namespace sixpoint::ingest
