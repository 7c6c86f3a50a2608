// `sixpoint up | down | status`.
#include <iostream>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/local_plant.h"

namespace sixpoint::cli {
namespace {

namespace fs = std::filesystem;

struct UpArguments {
  std::string migrations, blob_store = "postgresql", listen = "127.0.0.1", announce;
  int base_port = 7400;
  bool insecure = false;
};

fs::path OwnFolder() { return fs::canonical("/proc/self/exe").parent_path(); }

// In a checkout the migrations lie beside the build folder; installed, beside the programs.
fs::path UsualMigrations() {
  for (fs::path folder = OwnFolder(); folder != folder.root_path(); folder = folder.parent_path())
    if (fs::exists(folder / "migrations")) return folder / "migrations";
  return OwnFolder() / "migrations";
}

nlohmann::json ToJson(const PlantHealth& health) {
  nlohmann::json services = nlohmann::json::array();
  for (std::size_t i = 0; i < kAreas.size(); ++i)
    services.push_back({{"area", kAreas[i]}, {"address", health.plant.AnnouncedAt(i)}, {"health", health.services[i]}});
  return {{"data", health.plant.data.string()},
          {"supervisor", health.supervised},
          {"database", health.database ? "accepting connections" : "not reached"},
          {"loopback_only", health.plant.address.IsLoopback()},
          {"services", services}};
}

std::string ToText(const PlantHealth& health) {
  std::string text = "data          " + health.plant.data.string() + "\nsupervisor    " +
                     (health.supervised ? "running" : "not running") + "\ndatabase      " +
                     (health.database ? "accepting connections" : "not reached") + "  (psql '" +
                     health.plant.conninfo() + "')\n";
  for (std::size_t i = 0; i < kAreas.size(); ++i) {
    std::string area = kAreas[i];
    area.resize(14, ' ');
    text += area + health.plant.AnnouncedAt(i) + "  " + health.services[i] + "\n";
  }
  if (!health.plant.address.IsLoopback())
    text += "INSECURE      listens on " + health.plant.address.listen + ", and nothing identifies callers\n";
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

absl::Status Up(Session* session, const UpArguments& arguments) {
  const absl::StatusOr<ListenAddress> address =
      ListenAddressOf(arguments.listen, arguments.announce, arguments.insecure);
  if (!address.ok()) return address.status();
  LocalPlant plant;
  plant.data = session->data;
  plant.binaries = OwnFolder();
  plant.migrations = arguments.migrations.empty() ? UsualMigrations() : fs::path(arguments.migrations);
  plant.base_port = arguments.base_port;
  plant.address = *address;
  plant.blob_store = arguments.blob_store;
  if (!address->IsLoopback())
    std::cerr << "warning: INSECURE: the plant listens on " << address->listen
              << ", and nothing identifies callers: whoever reaches it may read and change everything in it\n";
  {
    ProgressLine progress(session->json);
    if (absl::Status status = StartPlant(std::move(plant), &progress); !status.ok()) return status;
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
  if (session->data.empty()) session->data = UsualDataFolder().string();
  Command* up = app->AddCommand("up", "Starts all services and a private PostgreSQL on this machine");
  Command* down = app->AddCommand("down", "Stops them");
  Command* status = app->AddCommand("status", "Tells what runs; exit code 0 when everything serves");
  for (Command* command : {up, down, status})
    command->AddOption("--data", &session->data, "Data folder")->ShowDefault();
  const auto arguments = std::make_shared<UpArguments>();
  up->AddOption("--base-port", &arguments->base_port, "The plant service's port; the others follow it")
      ->Within(1024, 65000)
      ->ShowDefault();
  up->AddOption("--listen", &arguments->listen, "Address to serve on, so that other hosts reach the plant")
      ->ShowDefault();
  up->AddOption("--announce", &arguments->announce, "Host that clients are told; without it, that of --listen");
  up->AddFlag("--insecure", &arguments->insecure, "Listens off loopback, though nothing identifies callers");
  up->AddOption("--migrations", &arguments->migrations, "Folder of the SQL migrations");
  up->AddOption("--blob-store", &arguments->blob_store,
                "Where new clouds go: postgresql, or s3:// and the path of a file that the user sixpoint owns")
      ->ShowDefault();
  session->OnCommand(up, [session, arguments] { return Up(session, *arguments); });
  session->OnCommand(down, [session] { return Down(session); });
  session->OnCommand(status, [session] { return PrintHealth(session); });
}

}  // namespace sixpoint::cli
