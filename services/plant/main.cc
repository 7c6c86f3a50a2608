// sixpoint-plant: what the plant owns, and the record of everything.
#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <utility>

#include "identity/credentials.h"
#include "sandbox/landlock.h"
#include "services/plant/account_service.h"
#include "services/plant/clearance_service.h"
#include "services/plant/credentials_service.h"
#include "services/plant/metrics.h"
#include "services/plant/person_service.h"
#include "services/plant/plant_service.h"
#include "services/plant/record_service.h"
#include "services/runtime/log.h"
#include "services/runtime/server.h"

namespace sixpoint::plant {
namespace {

std::unique_ptr<identity::Trust> TrustOf(const runtime::ServerOptions& options) {
  return std::make_unique<identity::Trust>(std::filesystem::path(options.certificates) / identity::kAuthorityFile,
                                           options.revoked_file);
}

// provider: null where the plant has none.
std::vector<runtime::ServedService> MakeServices(const runtime::ServerOptions& options, storage::Database* database,
                                                 std::unique_ptr<IdentityProvider> provider) {
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
  services.push_back(
      {v1::CredentialsService::service_full_name(), std::make_unique<CredentialsService>(database, TrustOf(options))});
  SessionDeskOptions desk;
  desk.identity_file = std::filesystem::path(options.certificates) / identity::kIdentityFile;
  desk.trust = TrustOf(options);
  desk.provider = std::move(provider);
  desk.count_refused = options.count_refused_sign_in;
  services.push_back(
      {v1::AccountService::service_full_name(), std::make_unique<AccountService>(database, std::move(desk))});
  services.push_back({v1::PersonService::service_full_name(), std::make_unique<PersonService>(database)});
  services.push_back({v1::ClearanceService::service_full_name(), std::make_unique<ClearanceService>(database)});
  return services;
}

}  // namespace
}  // namespace sixpoint::plant

int main(int argc, char** argv) {
  using namespace sixpoint;
  std::string oidc_file;
  const runtime::ServerOptions options = runtime::ParseServerOptions(argc, argv, "plant", [&](CLI::App* app) {
    app->add_option("--oidc", oidc_file, "The identity provider by which people sign in, a YAML file (docs/access.md)");
  });
  std::unique_ptr<plant::IdentityProvider> provider;
  if (!oidc_file.empty()) {
    absl::StatusOr<plant::IdentityProviderConfig> config = plant::ReadIdentityProviderConfig(oidc_file);
    if (!config.ok()) {
      std::cerr << "sixpoint-plant: " << config.status().message() << "\n";
      return 1;
    }
    provider = std::make_unique<plant::IdentityProvider>(*std::move(config));
  }
  return runtime::Serve(options, [&](const runtime::ServerOptions& served, storage::Database* database) {
    return plant::MakeServices(served, database, std::move(provider));
  });
}
