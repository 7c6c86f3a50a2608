// `sixpoint up | down | status`.
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>

#include "cli/certificate_text.h"
#include "cli/commands.h"
#include "cli/local_plant.h"

namespace sixpoint::cli {
namespace {

namespace fs = std::filesystem;

struct UpArguments {
  std::string migrations, web, http;
  PlantSettings settings;
  const Option *base_port = nullptr, *metrics_port = nullptr, *listen = nullptr, *announce = nullptr,
               *http_port = nullptr, *page = nullptr, *blob_store = nullptr, *oidc = nullptr;
};

fs::path OwnFolder() { return fs::canonical("/proc/self/exe").parent_path(); }

// In a checkout they lie beside the build folder; installed, beside the programs. Empty: nowhere.
fs::path FolderBeside(const fs::path& name) {
  for (fs::path folder = OwnFolder(); folder != folder.root_path(); folder = folder.parent_path())
    if (fs::exists(folder / name)) return folder / name;
  return {};
}

fs::path UsualMigrations() {
  const fs::path found = FolderBeside("migrations");
  return found.empty() ? OwnFolder() / "migrations" : found;
}

// Of the built page alone: a checkout may be without.
fs::path UsualWeb() { return FolderBeside(fs::path("web") / "dist" / "index.html").parent_path(); }

// They lie where the migrations do, or nowhere.
fs::path AlertsBeside(const fs::path& migrations) {
  const fs::path alerts = fs::weakly_canonical(migrations).parent_path() / "deploy" / "observe" / "alerts.yml";
  return fs::exists(alerts) ? alerts : fs::path();
}

// Before clients refuse the service for it. Empty where nothing is to be done.
std::string CertificateWarning(const std::string& area, const std::optional<identity::IssuedCertificate>& certificate) {
  if (certificate && StateText(*certificate) == "valid") return "";
  return "warning       the certificate of " + area +
         (certificate ? ": " + StateText(*certificate) + ", until " + TimeText(certificate->not_after)
                      : " is missing or cannot be read") +
         "; run `sixpoint certs renew`\n";
}

nlohmann::json GatewayToJson(const PlantHealth& health) {
  if (!health.plant.HasGateway()) return nullptr;
  const std::size_t last = kAreas.size();
  return {{"url", health.plant.AnnouncedGatewayUrl()},
          {"page", health.plant.PageUrl()},
          {"metrics", health.plant.IsSeen() ? health.plant.AnnouncedMetrics(last) : ""},
          {"health", health.services[last].health},
          {"why", health.services[last].why},
          {"certificate", health.certificates[last] ? CertificateToJson(*health.certificates[last]) : nullptr}};
}

nlohmann::json ToJson(const PlantHealth& health) {
  nlohmann::json services = nlohmann::json::array();
  for (std::size_t i = 0; i < kAreas.size(); ++i)
    services.push_back(
        {{"area", kAreas[i]},
         {"address", health.plant.AnnouncedAt(i)},
         {"metrics", health.plant.IsSeen() ? health.plant.AnnouncedMetrics(i) : ""},
         {"health", health.services[i].health},
         {"why", health.services[i].why},
         {"certificate", health.certificates[i] ? CertificateToJson(*health.certificates[i]) : nullptr}});
  return {{"data", health.plant.data.string()},
          {"supervisor", health.supervised},
          {"database", health.database ? "accepting connections" : "not reached"},
          {"loopback_only", health.plant.address.IsLoopback()},
          {"services", services},
          {"gateway", GatewayToJson(health)}};
}

std::string ToText(const PlantHealth& health) {
  std::string text = "data          " + health.plant.data.string() + "\nsupervisor    " +
                     (health.supervised ? "running" : "not running") + "\ndatabase      " +
                     (health.database ? "accepting connections" : "not reached") + "  (psql '" +
                     health.plant.conninfo() + "')\n";
  const std::vector<std::string> served = health.plant.Served();
  for (std::size_t i = 0; i < served.size(); ++i) {
    std::string name = served[i];
    name.resize(14, ' ');
    const ServiceState& state = health.services[i];
    text += name + (i < kAreas.size() ? health.plant.AnnouncedAt(i) : health.plant.AnnouncedGatewayUrl()) + "  " +
            state.health + (state.why.empty() ? "" : ": " + state.why) + "\n";
  }
  if (!health.plant.settings.page_url.empty()) text += "page          " + health.plant.PageUrl() + "\n";
  text += "metrics       ";
  if (health.plant.IsSeen())
    text += "https://" + health.plant.AnnouncedMetrics(0) + "/metrics and the next " +
            std::to_string(served.size() - 1) + " ports; for Prometheus: " + health.plant.prometheus_config().string() +
            "\n";
  else
    text += "none (--metrics-port 0)\n";
  for (std::size_t i = 0; i < served.size(); ++i) text += CertificateWarning(served[i], health.certificates[i]);
  return text;
}

absl::Status PrintHealth(Session* session) {
  const absl::StatusOr<PlantHealth> health = HealthOf(session->data);
  if (!health.ok()) return health.status();
  if (session->json) {
    PrintJson(ToJson(*health));
  } else {
    std::cout << ToText(*health);
  }
  if (!health->AllServe()) session->MarkFailed();
  return absl::OkStatus();
}

// As the plant was told before, and now. Who names another address decides anew what belongs to it.
PlantSettings SettingsOf(const UpArguments& arguments, PlantSettings settings) {
  const PlantSettings& given = arguments.settings;
  if (arguments.base_port->given()) settings.base_port = given.base_port;
  if (arguments.metrics_port->given()) settings.metrics_port = given.metrics_port;
  if (arguments.listen->given()) {
    settings.listen = given.listen;
    settings.announce.clear();
  }
  if (arguments.announce->given()) settings.announce = given.announce;
  if (!arguments.http.empty()) settings.http = HttpAccessOf(arguments.http).value_or(settings.http);
  if (arguments.http_port->given()) settings.http_port = given.http_port;
  if (arguments.page->given()) settings.page_url = given.page_url == "none" ? "" : given.page_url;
  if (arguments.blob_store->given()) settings.blob_store = given.blob_store;
  if (arguments.oidc->given()) settings.oidc = given.oidc == "none" ? "" : given.oidc;
  return settings;
}

absl::Status Up(Session* session, const UpArguments& arguments) {
  absl::StatusOr<LocalPlant> plant = PlantIn(session->data);
  if (!plant.ok()) return plant.status();
  plant->settings = SettingsOf(arguments, plant->settings);
  if (absl::Status status = CheckSettings(plant->settings); !status.ok()) return status;
  plant->address = *plant->settings.Address();
  plant->binaries = OwnFolder();
  plant->migrations = arguments.migrations.empty() ? UsualMigrations() : fs::path(arguments.migrations);
  plant->web = arguments.web.empty() ? UsualWeb() : fs::path(arguments.web);
  plant->alerts = AlertsBeside(plant->migrations);
  {
    ProgressLine progress(session->json);
    if (absl::Status status = StartPlant(*plant, &progress); !status.ok()) return status;
  }
  return PrintHealth(session);
}

absl::Status Down(Session* session) {
  {
    const Elapsed elapsed("stopping", session->json);
    if (absl::Status status = StopPlant(session->data); !status.ok()) return status;
  }
  if (session->json) {
    PrintJson({{"data", session->data}, {"stopped", true}});
  } else {
    std::cout << "stopped\n";
  }
  return absl::OkStatus();
}

}  // namespace

void AddLocalPlantCommands(Command* app, Session* session) {
  Command* up = app->AddCommand("up", "Starts all services and a private PostgreSQL on this machine");
  Command* down = app->AddCommand("down", "Stops them");
  Command* status = app->AddCommand("status", "Tells what runs; exit code 0 when everything serves");
  const auto arguments = std::make_shared<UpArguments>();
  PlantSettings* const settings = &arguments->settings;
  arguments->base_port =
      up->AddOption("--base-port", &settings->base_port, "The plant service's port; the others follow it")
          ->Within(kLowestPort, kHighestBasePort)
          ->ShowDefault();
  arguments->metrics_port =
      up->AddOption("--metrics-port", &settings->metrics_port,
                    "Where it is seen, the others following; 20 above --base-port unless told, 0 for none")
          ->Within(0, kHighestBasePort);
  arguments->listen =
      up->AddOption("--listen", &settings->listen, "Address to serve on, so that other hosts reach the plant")
          ->ShowDefault();
  arguments->announce =
      up->AddOption("--announce", &settings->announce, "Host that clients are told; without it, that of --listen");
  up->AddOption("--migrations", &arguments->migrations, "Folder of the SQL migrations");
  up->AddOption("--http", &arguments->http,
                "The gateway with the page: direct, proxied (by a proxy on this computer, on loopback alone), or none")
      ->OneOf({"direct", "proxied", "none"});
  arguments->http_port =
      up->AddOption("--http-port", &settings->http_port, "Its port; 80 above --base-port unless told")
          ->Within(kLowestPort, kHighestPort);
  arguments->page = up->AddOption("--page", &settings->page_url,
                                  "Where people find the page behind a proxy, such as https://plant.example; or none");
  up->AddOption("--web", &arguments->web, "Folder of the built page");
  arguments->blob_store =
      up->AddOption("--blob-store", &settings->blob_store,
                    "Where new clouds go: postgresql, or s3:// and the path of a file that the user sixpoint owns")
          ->ShowDefault();
  arguments->oidc =
      up->AddOption("--oidc", &settings->oidc,
                    "The identity provider by which people sign in: a YAML file that the user sixpoint may "
                    "read, or none");
  session->OnCommand(up, [session, arguments] { return Up(session, *arguments); });
  session->OnCommand(down, [session] { return Down(session); });
  session->OnCommand(status, [session] { return PrintHealth(session); });
}

}  // namespace sixpoint::cli
