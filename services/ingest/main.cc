// sixpoint-ingest: the plant's front door for scans.
#include "services/ingest/block_memory.h"
#include "services/ingest/scan_service.h"
#include "services/runtime/call.h"
#include "services/runtime/server.h"

namespace sixpoint::ingest {
namespace {

std::vector<std::unique_ptr<grpc::Service>> MakeServices(const runtime::ServerOptions& options,
                                                         storage::Database* database) {
  static const std::unique_ptr<storage::BlobStore> blobs = storage::MakePostgresqlBlobStore();
  ScanServiceOptions scan_options;
  scan_options.decode_worker = options.worker_folder + "/sixpoint-decode-worker";
  scan_options.worker_count = options.threads;
  const auto plant = options.peers.find("plant");
  std::vector<std::unique_ptr<grpc::Service>> services;
  services.push_back(std::make_unique<ScanService>(
      scan_options, database, blobs.get(),
      runtime::ConnectTo(plant == options.peers.end() ? "127.0.0.1:7400" : plant->second)));
  return services;
}

}  // namespace
}  // namespace sixpoint::ingest

int main(int argc, char** argv) {
  sixpoint::ingest::KeepBlockMemory();
  return sixpoint::runtime::Serve(sixpoint::runtime::ParseServerOptions(argc, argv, "ingest"),
                                  sixpoint::ingest::MakeServices);
}
