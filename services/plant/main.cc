// sixpoint-plant: what the plant owns, and the record of everything.
#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <optional>
#include <utility>

#include "identity/credentials.h"
#include "sandbox/landlock.h"
#include "services/plant/account_service.h"
#include "services/plant/clearance_service.h"
#include "services/plant/credentials_service.h"
#include "services/plant/drawing_service.h"
#include "services/plant/event_service.h"
#include "services/plant/fleet_service.h"
#include "services/plant/ledger_service.h"
#include "services/plant/metrics.h"
#include "services/plant/person_service.h"
#include "services/plant/plant_service.h"
#include "services/plant/record_service.h"
#include "services/plant/webhook_service.h"
#include "services/runtime/log.h"
#include "services/runtime/server.h"

namespace sixpoint::plant {
namespace {

constexpr int kCatchUpConnections = 2;

std::unique_ptr<identity::Trust> TrustOf(const runtime::ServerOptions& options) {
  return std::make_unique<identity::Trust>(std::filesystem::path(options.certificates) / identity::kAuthorityFile,
                                           options.revoked_file);
}

// How the ledger is sealed.
struct LedgerOptions {
  std::string key_file;
  int every_s = 5, head_every_s = 60;
  std::string heads_file;
  bool make_key = false;
};

void AddLedgerFlags(CLI::App* app, LedgerOptions* options) {
  app->add_option("--ledger-key", options->key_file,
                  "The Ed25519 key by which heads of the ledger are signed, a PEM file that this service alone reads; "
                  "none: no head is signed");
  app->add_option("--ledger-heads", options->heads_file, "Where signed heads are sent out: a file, a line each");
  app->add_flag(
      "--make-ledger-key", options->make_key,
      "Serves nothing: makes the key of --ledger-key where there is none, with public.pem beside it, and ends");
  app->add_option("--ledger-every-s", options->every_s, "Time between looks for what is not sealed yet; 0: never")
      ->check(CLI::Range(0, 3600))
      ->capture_default_str();
  app->add_option("--ledger-head-every-s", options->head_every_s, "At most one head in that time")
      ->check(CLI::Range(1, 86'400))
      ->capture_default_str();
}

std::unique_ptr<LedgerSealer> MakeSealer(const LedgerOptions& options, const std::string& conninfo,
                                         std::optional<ledger::SigningKey> key) {
  LedgerSealerOptions sealer;
  sealer.every = std::chrono::seconds(options.every_s);
  sealer.head_every = std::chrono::seconds(options.head_every_s);
  sealer.heads_file = options.heads_file;
  if (options.every_s == 0) return nullptr;
  return std::make_unique<LedgerSealer>(sealer, storage::LedgerIn(storage::Database::Open(conninfo, 1)),
                                        std::move(key));
}

// provider: null where the plant has none.
std::vector<runtime::ServedService> MakeServices(const runtime::ServerOptions& options, storage::Database* database,
                                                 std::unique_ptr<IdentityProvider> provider,
                                                 std::unique_ptr<LedgerSealer> sealer,
                                                 const WebhookSenderOptions& webhooks, std::string page_url) {
  PlantServiceOptions plant_options;
  plant_options.cad_worker.program = options.worker_folder + "/sixpoint-cad-worker";
  plant_options.cad_worker_count = options.threads;
  plant_options.page_url = std::move(page_url);
  plant_options.endpoints = options.peers;
  plant_options.endpoints.emplace("plant", options.listen_address);  // unless clients are to be told another address
  if (sandbox::LandlockVersion() == 0) runtime::Log(runtime::LogLevel::kWarning, sandbox::kWithoutLandlock);
  std::vector<runtime::ServedService> services;
  const storage::PlantStores stores = storage::PlantIn(database);
  services.push_back(
      {v1::PlantService::service_full_name(), std::make_unique<PlantService>(std::move(plant_options), stores)});
  services.push_back({v1::DrawingService::service_full_name(),
                      std::make_unique<DrawingService>(storage::DrawingsIn(database), stores.parts)});
  services.push_back({v1::RecordService::service_full_name(),
                      std::make_unique<RecordService>(stores.journal, stores.blades), RecordSampled()});
  // Whoever listens takes no connection from calls.
  const auto pages = storage::EventsIn(storage::Database::Open(options.database, kCatchUpConnections));
  auto events = std::make_unique<EventService>(storage::EventsIn(storage::Database::Open(options.database, 1)), pages);
  const auto kept_webhooks = storage::WebhooksIn(database);
  auto sender = std::make_unique<WebhookSender>(kept_webhooks, storage::WebhookDeliveriesIn(database), pages,
                                                events->tail(), webhooks);
  services.push_back({v1::EventService::service_full_name(), std::move(events)});
  EventService* const told = static_cast<EventService*>(services.back().service.get());
  services.back().on_stop = [told] { told->Stop(); };
  auto sent = std::make_unique<WebhookService>(kept_webhooks, pages, std::move(sender));
  services.push_back({v1::WebhookService::service_full_name(), std::move(sent)});
  WebhookService* const sending = static_cast<WebhookService*>(services.back().service.get());
  services.back().on_stop = [sending] { sending->Stop(); };
  services.push_back({v1::CredentialsService::service_full_name(),
                      std::make_unique<CredentialsService>(storage::CredentialsIn(database), TrustOf(options))});
  SessionDeskOptions desk;
  desk.identity_file = std::filesystem::path(options.certificates) / identity::kIdentityFile;
  desk.trust = TrustOf(options);
  desk.provider = std::move(provider);
  desk.count_refused = options.count_refused_sign_in;
  services.push_back({v1::AccountService::service_full_name(),
                      std::make_unique<AccountService>(storage::AccountsIn(database), std::move(desk))});
  services.push_back(
      {v1::PersonService::service_full_name(), std::make_unique<PersonService>(storage::PersonsIn(database))});
  services.push_back({v1::ClearanceService::service_full_name(),
                      std::make_unique<ClearanceService>(storage::ClearanceStoreIn(database))});
  services.push_back({v1::FleetService::service_full_name(),
                      std::make_unique<FleetService>(storage::FleetIn(database), stores.clearances)});
  services.push_back({v1::LedgerService::service_full_name(),
                      std::make_unique<LedgerService>(storage::LedgerIn(database), stores.blades, stores.clearances,
                                                      std::move(sealer))});
  return services;
}

}  // namespace
}  // namespace sixpoint::plant

int main(int argc, char** argv) {
  using namespace sixpoint;
  std::string oidc_file, page_url;
  plant::LedgerOptions ledger_options;
  plant::WebhookSenderOptions webhooks;
  const runtime::ServerOptions options = runtime::ParseServerOptions(argc, argv, "plant", [&](CLI::App* app) {
    app->add_option("--oidc", oidc_file, "The identity provider by which people sign in, a YAML file (docs/access.md)");
    app->add_option("--page", page_url, "Where people find the page, such as https://plant.example");
    app->add_flag(
        "--webhook-link-local", webhooks.post.calls_link_local,
        "Webhooks may name addresses of the link, where clouds tell computers their secrets (docs/events.md)");
    plant::AddLedgerFlags(app, &ledger_options);
  });
  if (ledger_options.make_key) {
    const absl::Status made = ledger::SigningKey::MakeFile(ledger_options.key_file);
    if (!made.ok()) std::cerr << "sixpoint-plant: " << made.message() << "\n";
    return made.ok() ? 0 : 1;
  }
  std::optional<ledger::SigningKey> key;
  if (!ledger_options.key_file.empty()) {
    absl::StatusOr<ledger::SigningKey> read = ledger::SigningKey::Read(ledger_options.key_file);
    if (!read.ok()) {
      std::cerr << "sixpoint-plant: " << read.status().message() << "\n";
      return 1;
    }
    key.emplace(*std::move(read));
  }
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
    return plant::MakeServices(served, database, std::move(provider),
                               plant::MakeSealer(ledger_options, served.database, std::move(key)), webhooks, page_url);
  });
}
