#include "cli/plant_checks.h"

#include <sys/statvfs.h>
#include <unistd.h>

#include <cstdint>
#include <set>
#include <sstream>

#include "cli/plant_folder.h"
#include "cli/plant_ports.h"
#include "cli/subprocess.h"
#include "cli/supervisor.h"
#include "services/runtime/errors.h"

namespace sixpoint::cli {
namespace {

namespace fs = std::filesystem;

constexpr char kPostgresVersion[] = "15";
// An empty plant is 60 MB; its write-ahead log grows to some hundred before it is used again.
constexpr std::uint64_t kNewPlant_bytes = 500'000'000, kKnownPlant_bytes = 64'000'000;

bool HasCluster(const LocalPlant& plant) {
  std::error_code none;
  return fs::symlink_status(plant.database(), none).type() != fs::file_type::not_found;
}

// A plant that runs holds its ports, unless what holds one keeps its service from running. Where it is seen it holds what its
// supervisor was told: what runs may be of a release, or of settings, without.
std::set<int> OwnPorts(const LocalPlant& plant) {
  std::set<int> own;
  const auto stored = StoredSettings(plant.data);
  if (!stored.ok() || !stored->has_value()) return own;
  LocalPlant running = plant;
  running.settings = **stored;
  if (const auto address = running.settings.Address(); address.ok()) running.address = *address;
  const absl::StatusOr<std::string> told = ReadFileOf(geteuid(), plant.supervisor_config());
  const auto states = ProgramStates(plant);
  for (std::size_t i = 0; i < kAreas.size(); ++i) {
    if (const auto state = states.find(kAreas[i]); state == states.end() || state->second != "RUNNING") continue;
    own.insert(running.settings.base_port + static_cast<int>(i));
    if (told.ok() && told->find(" --metrics " + running.MetricsAt(i) + " ") != std::string::npos)
      own.insert(running.settings.MetricsPort() + static_cast<int>(i));
  }
  if (const auto state = states.find(kGateway); state != states.end() && state->second == "RUNNING") {
    own.insert(running.settings.HttpPort());
    if (told.ok() && told->find(" --metrics " + running.MetricsAt(kAreas.size()) + " ") != std::string::npos)
      own.insert(running.settings.MetricsPort() + kPortCount);
  }
  return own;
}

}  // namespace

absl::Status CheckPorts(const LocalPlant& plant) {
  const std::set<int> own = OwnPorts(plant);
  const PlantSettings& settings = plant.settings;
  absl::Status free = RequirePorts(
      {"--base-port", settings.listen, settings.base_port, kPortCount, "six ports that are free, or this plant's own"},
      own);
  if (free.ok() && plant.IsSeen())
    free = RequirePorts(
        {"--metrics-port", settings.listen, settings.MetricsPort(), plant.HasGateway() ? kSeenCount : kPortCount,
         "ports that are free, one a service, or this plant's own; 0 for none"},
        own);
  if (!free.ok() || !plant.HasGateway()) return free;
  return RequirePorts({"--http-port", plant.GatewayHost(), settings.HttpPort(), 1,
                       "a port that is free, or this plant's own; --http none for no gateway"},
                      own);
}

absl::Status CheckRoom(const LocalPlant& plant) {
  fs::path there = plant.data;
  std::error_code none;
  while (!fs::exists(there, none) && there != there.root_path()) there = there.parent_path();
  struct statvfs found {};
  if (statvfs(there.c_str(), &found) != 0) return absl::OkStatus();  // who cannot be asked says so when he is used
  if ((found.f_flag & ST_RDONLY) != 0)
    return runtime::Refuse("--data", plant.data.string() + " (mounted to be read only)",
                           "a folder that can be written");
  const std::uint64_t free_bytes = static_cast<std::uint64_t>(found.f_bavail) * found.f_frsize,
                      wanted_bytes = HasCluster(plant) ? kKnownPlant_bytes : kNewPlant_bytes;
  if (free_bytes >= wanted_bytes) return absl::OkStatus();
  return runtime::Refuse("--data", plant.data.string() + " (" + std::to_string(free_bytes / 1'000'000) + " MB free)",
                         "a disk with at least " + std::to_string(wanted_bytes / 1'000'000) + " MB free");
}

absl::StatusOr<std::string> DatabaseSystemOf(const LocalPlant& plant) {
  if (!HasCluster(plant)) return "";
  const Finished read = RunProgram(
      AsServiceUser({"env", "LC_ALL=C", std::string(kPostgresBin) + "pg_controldata", plant.database().string()}));
  const std::string name = "Database system identifier:";
  const std::size_t at = read.output.find(name);
  if (read.exit_code != 0 || at == std::string::npos)
    return runtime::Refuse("--data", plant.database().string() + " (pg_controldata cannot read it)",
                           "a PostgreSQL cluster that `sixpoint up` made");
  std::istringstream words(read.output.substr(at + name.size()));
  std::string number;
  words >> number;
  return number;
}

absl::Status CheckCluster(const LocalPlant& plant, const ServiceUser& user) {
  if (!HasCluster(plant)) return absl::OkStatus();
  const absl::StatusOr<std::string> version = ReadFileOf(user.uid, plant.database() / "PG_VERSION");
  // What is no cluster, or leads elsewhere, is refused by who looks closer.
  if (!version.ok()) return absl::OkStatus();
  const std::string number = version->substr(0, version->find('\n'));
  if (number != kPostgresVersion)
    return runtime::Refuse("--data", plant.database().string() + " (of PostgreSQL " + number.substr(0, 20) + ")",
                           std::string("one of PostgreSQL ") + kPostgresVersion + ": move it by pg_upgrade");
  const std::string& known = plant.settings.database_system;
  if (known.empty()) return absl::OkStatus();
  const absl::StatusOr<std::string> system = DatabaseSystemOf(plant);
  if (!system.ok()) return system.status();
  if (*system == known) return absl::OkStatus();
  return runtime::Refuse("--data", plant.database().string() + " (database system " + *system + ", another plant's)",
                         known +
                             ", as plant.json has it; where this one is right from now on, take `database_system` "
                             "out of that file");
}

}  // namespace sixpoint::cli
