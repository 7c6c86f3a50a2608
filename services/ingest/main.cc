// sixpoint-ingest: the plant's front door for scans.
#include <algorithm>

#include "services/ingest/scan_service.h"
#include "services/runtime/call.h"
#include "services/runtime/server.h"

namespace sixpoint::ingest {
namespace {

// Kept free of uploads, so that reads and health go on when all upload slots are taken.
constexpr int kConnectionsForReads = 2;

std::vector<std::unique_ptr<grpc::Service>> MakeServices(const runtime::ServerOptions& options,
                                                         storage::Database* database) {
  ScanServiceOptions scan_options;
  scan_options.decode_worker = options.worker_folder + "/sixpoint-decode-worker";
  scan_options.worker_count = options.threads;
  scan_options.greatest_upload_count = std::max(1, options.database_connections - kConnectionsForReads);
  const auto plant = options.peers.find("plant");
  std::vector<std::unique_ptr<grpc::Service>> services;
  services.push_back(std::make_unique<ScanService>(
      scan_options, database, runtime::ConnectTo(plant == options.peers.end() ? "127.0.0.1:7400" : plant->second)));
  return services;
}

}  // namespace
}  // namespace sixpoint::ingest

int main(int argc, char** argv) {
  return sixpoint::runtime::Serve(sixpoint::runtime::ParseServerOptions(argc, argv, "ingest"),
                                  sixpoint::ingest::MakeServices);
}
