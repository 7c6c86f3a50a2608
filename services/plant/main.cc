// sixpoint-plant: what the plant owns, and the record of everything.
#include <filesystem>

#include "identity/credentials.h"
#include "sandbox/landlock.h"
#include "services/plant/credentials_service.h"
#include "services/plant/metrics.h"
#include "services/plant/plant_service.h"
#include "services/plant/record_service.h"
#include "services/runtime/log.h"
#include "services/runtime/server.h"

namespace sixpoint::plant {
namespace {

std::vector<runtime::ServedService> MakeServices(const runtime::ServerOptions& options, storage::Database* database) {
  PlantServiceOptions plant_options;
  plant_options.cad_worker.program = options.worker_folder + "/sixpoint-cad-worker";
  plant_options.cad_worker_count = options.threads;
  plant_options.endpoints = options.peers;
  plant_options.endpoints.emplace("plant", options.listen_address);  // unless clients are to be told another address
  if (sandbox::LandlockVersion() == 0) runtime::Log(runtime::LogLevel::kWarning, sandbox::kWithoutLandlock);
  std::vector<runtime::ServedService> services;
  const storage::PlantStores stores = storage::PlantIn(database);
  services.push_back(
      {v1::PlantService::service_full_name(), std::make_unique<PlantService>(std::move(plant_options), stores)});
  services.push_back({v1::RecordService::service_full_name(),
                      std::make_unique<RecordService>(stores.journal, stores.blades), RecordSampled()});
  services.push_back({v1::CredentialsService::service_full_name(),
                      std::make_unique<CredentialsService>(
                          database, std::make_unique<identity::Trust>(
                                        std::filesystem::path(options.certificates) / identity::kAuthorityFile,
                                        options.revoked_file))});
  return services;
}

}  // namespace
}  // namespace sixpoint::plant

int main(int argc, char** argv) {
  return sixpoint::runtime::Serve(sixpoint::runtime::ParseServerOptions(argc, argv, "plant"),
                                  sixpoint::plant::MakeServices);
}
