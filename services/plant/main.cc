// sixpoint-plant: what the plant owns, and the record of everything.
#include <algorithm>

#include "sandbox/landlock.h"
#include "services/plant/plant_service.h"
#include "services/plant/record_service.h"
#include "services/runtime/log.h"
#include "services/runtime/server.h"

namespace sixpoint::plant {
namespace {

// CreatePart carries a CAD file of up to 48 MiB.
constexpr int kLeastMessageMb = 64;

std::vector<std::unique_ptr<grpc::Service>> MakeServices(const runtime::ServerOptions& options,
                                                         storage::Database* database) {
  PlantServiceOptions plant_options;
  plant_options.cad_worker.program = options.worker_folder + "/sixpoint-cad-worker";
  plant_options.cad_worker_count = options.threads;
  plant_options.endpoints = options.peers;
  plant_options.endpoints.emplace("plant", options.listen_address);  // unless clients are to be told another address
  if (sandbox::LandlockVersion() == 0) runtime::Log(runtime::LogLevel::kWarning, sandbox::kWithoutLandlock);
  std::vector<std::unique_ptr<grpc::Service>> services;
  const storage::PlantStores stores = storage::PlantIn(database);
  services.push_back(std::make_unique<PlantService>(std::move(plant_options), stores));
  services.push_back(std::make_unique<RecordService>(stores.journal, stores.blades));
  return services;
}

}  // namespace
}  // namespace sixpoint::plant

int main(int argc, char** argv) {
  sixpoint::runtime::ServerOptions options = sixpoint::runtime::ParseServerOptions(argc, argv, "plant");
  options.max_message_mb = std::max(options.max_message_mb, sixpoint::plant::kLeastMessageMb);
  return sixpoint::runtime::Serve(options, sixpoint::plant::MakeServices);
}
