// sixpoint.ingest.v1.ScanService.
#pragma once

#include <atomic>
#include <memory>
#include <string>

#include "services/ingest/decode_workers.h"
#include "services/ingest/known_plant.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"
#include "storage/database.h"

namespace sixpoint::ingest {

struct ScanServiceOptions {
  std::string decode_worker;  // path of sixpoint-decode-worker
  int worker_count = 2;
  std::chrono::milliseconds decode_patience{10'000};  // for one block
  // Each holds a connection of the pool; more are RESOURCE_EXHAUSTED at once.
  int greatest_upload_count = 6;
};

class ScanService final : public v1::ScanService::Service {
 public:
  ScanService(const ScanServiceOptions& options, storage::Database* database, std::shared_ptr<grpc::Channel> plant);

  grpc::Status UploadScan(grpc::ServerContext* context, grpc::ServerReader<v1::UploadScanRequest>* reader,
                          v1::UploadScanResponse* response) override;
  grpc::Status GetScan(grpc::ServerContext* context, const v1::GetScanRequest* request, v1::Scan* response) override;
  grpc::Status ListScans(grpc::ServerContext* context, const v1::ListScansRequest* request,
                         v1::ListScansResponse* response) override;
  grpc::Status DownloadScan(grpc::ServerContext* context, const v1::DownloadScanRequest* request,
                            grpc::ServerWriter<v1::DownloadScanResponse>* writer) override;

 private:
  absl::Status Upload(grpc::ServerContext* context, grpc::ServerReader<v1::UploadScanRequest>* reader,
                      v1::UploadScanResponse* response);

  storage::Database* const database_;
  KnownPlant plant_;
  DecodeWorkers workers_;
  const int greatest_upload_count_;
  std::atomic<int> upload_count_ = 0;
};

}  // namespace sixpoint::ingest
