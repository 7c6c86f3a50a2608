// sixpoint.ingest.v1.ScanService.
#pragma once

#include <memory>
#include <string>

#include "services/ingest/call_watch.h"
#include "services/ingest/decode_workers.h"
#include "services/ingest/known_plant.h"
#include "services/runtime/compute_pool.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"
#include "storage/scan_store.h"

namespace sixpoint::ingest {

struct ScanServiceOptions {
  std::string decode_worker;                          // path of sixpoint-decode-worker
  int worker_count = 2;                               // decoding at once in workers, and encoding at once here
  std::chrono::milliseconds decode_patience{10'000};  // for one block
  // Each holds a thread and one block; more are RESOURCE_EXHAUSTED at once.
  int greatest_upload_count = 64;
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
  grpc::Status PreviewScan(grpc::ServerContext* context, const v1::PreviewScanRequest* request,
                           v1::PreviewScanResponse* response) override;

 private:
  static constexpr int kPreviewsAtOnce = 2;

  absl::Status Upload(grpc::ServerContext* context,
                      grpc::ServerReaderWriter<v1::UploadScanResponse, v1::UploadScanRequest>* stream);

  const std::shared_ptr<storage::ScanStore> store_;
  KnownPlant plant_;
  DecodeWorkers workers_;
  runtime::ComputePool encoding_;
  runtime::ComputePool uploads_;
  runtime::ComputePool previews_{{kPreviewsAtOnce, 0}, "previews", errors::v1::PREVIEWS_FULL};
  CallWatchdog watchdog_;
  const std::chrono::milliseconds stream_patience_;
};

}  // namespace sixpoint::ingest
