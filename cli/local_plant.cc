#include "cli/local_plant.h"

#include <grpcpp/grpcpp.h>
#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "cli/subprocess.h"
#include "cli/supervisor.h"
#include "grpc/health/v1/health.grpc.pb.h"
#include "services/runtime/errors.h"

namespace sixpoint::cli {
namespace {

namespace fs = std::filesystem;

constexpr char kServiceUser[] = "sixpoint";
// A unix socket's path holds 107 bytes; PostgreSQL appends "/.s.PGSQL.5432.lock".
constexpr std::size_t kLongestSocketFolder = 80;

bool IsRoot() { return geteuid() == 0; }

// PostgreSQL refuses root, and no service needs it: as root, everything runs as the system user `sixpoint`.
absl::Status EnsureServiceUser() {
  if (!IsRoot() || getpwnam(kServiceUser) != nullptr) return absl::OkStatus();
  const Finished made = RunProgram({"useradd", "--system", "--user-group", "--home-dir", "/nonexistent", "--shell",
                                    "/usr/sbin/nologin", kServiceUser});
  if (made.exit_code == 0) return absl::OkStatus();
  return absl::InternalError("cannot add the system user sixpoint: " + made.output);
}

std::vector<std::string> AsServiceUser(std::vector<std::string> command) {
  if (!IsRoot()) return command;
  std::vector<std::string> wrapped = {"runuser", "-u", kServiceUser, "--"};
  wrapped.insert(wrapped.end(), command.begin(), command.end());
  return wrapped;
}

absl::Status MakeFolder(const fs::path& folder) {
  fs::create_directories(folder);
  fs::permissions(folder, fs::perms::owner_all);
  if (!IsRoot()) return absl::OkStatus();
  const passwd* user = getpwnam(kServiceUser);
  if (chown(folder.c_str(), user->pw_uid, user->pw_gid) == 0) return absl::OkStatus();
  return absl::PermissionDeniedError("cannot give " + folder.string() + " to the user sixpoint");
}

absl::Status MakeFolders(LocalPlant* plant) {
  if (absl::Status status = MakeFolder(plant->data); !status.ok()) return status;
  plant->data = fs::canonical(plant->data);
  if (plant->sockets().string().size() > kLongestSocketFolder)
    return runtime::Refuse("--data", plant->data.string(), "a shorter path (unix sockets hold 107 bytes)");
  for (const fs::path& folder : {plant->database(), plant->sockets(), plant->logs()})
    if (absl::Status status = MakeFolder(folder); !status.ok()) return status;
  return absl::OkStatus();
}

// A checkout under /root cannot be entered by the service user: then the programs are copied beside the data.
absl::Status MakeBinariesReachable(LocalPlant* plant) {
  if (!IsRoot()) return absl::OkStatus();
  const Finished reachable = RunProgram(AsServiceUser({"test", "-x", (plant->binaries / "sixpoint-ingest").string()}));
  if (reachable.exit_code == 0) return absl::OkStatus();
  const fs::path copies = plant->data / "bin";
  if (absl::Status status = MakeFolder(copies); !status.ok()) return status;
  for (const auto& entry : fs::directory_iterator(plant->binaries)) {
    const std::string name = entry.path().filename().string();
    if (name.rfind("sixpoint-", 0) == 0 && entry.is_regular_file())
      fs::copy_file(entry.path(), copies / name, fs::copy_options::update_existing);
  }
  plant->binaries = copies;
  return absl::OkStatus();
}

absl::Status CreateDatabase(const LocalPlant& plant) {
  if (fs::exists(plant.database() / "PG_VERSION")) return absl::OkStatus();
  const Finished made = RunProgram(
      AsServiceUser({std::string(kPostgresBin) + "initdb", "--pgdata", plant.database().string(), "--data-checksums",
                     "--encoding", "UTF8", "--locale", "C.UTF-8", "--username", "sixpoint", "--auth", "trust"}));
  return made.exit_code == 0 ? absl::OkStatus() : absl::InternalError("initdb failed: " + made.output);
}

bool DatabaseAccepts(const LocalPlant& plant) {
  return RunProgram({std::string(kPostgresBin) + "pg_isready", "-q", "-h", plant.sockets().string()}).exit_code == 0;
}

absl::Status WaitForDatabase(const LocalPlant& plant) {
  for (int attempt = 0; attempt < 120; ++attempt) {
    if (DatabaseAccepts(plant)) {
      const Finished made = RunProgram(
          {std::string(kPostgresBin) + "createdb", "-h", plant.sockets().string(), "-U", "sixpoint", "sixpoint"});
      if (made.exit_code == 0 || made.output.find("already exists") != std::string::npos) return absl::OkStatus();
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(250));
  }
  return absl::InternalError("PostgreSQL did not start within 30 s; see " + (plant.logs() / "postgres.log").string());
}

absl::Status Migrate(const LocalPlant& plant) {
  const Finished migrated = RunProgram({(plant.binaries / "sixpoint-migrate").string(), "--database", plant.conninfo(),
                                        "--migrations", plant.migrations.string()});
  return migrated.exit_code == 0 ? absl::OkStatus() : absl::InternalError("migration failed: " + migrated.output);
}

std::string ServiceHealth(const std::string& address) {
  grpc::ChannelArguments arguments;
  // A proxy in the environment is for the world outside, not for the plant's own services.
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  const auto stub = grpc::health::v1::Health::NewStub(
      grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments));
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(2));
  grpc::health::v1::HealthCheckResponse response;
  const grpc::Status status = stub->Check(&context, {}, &response);
  if (!status.ok()) return "NOT_REACHED";
  return grpc::health::v1::HealthCheckResponse::ServingStatus_Name(response.status());
}

absl::Status WaitForServices(const LocalPlant& plant, ProgressLine* progress) {
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  for (std::size_t i = 0; i < kAreas.size(); ++i) {
    while (ServiceHealth(plant.OwnAddress(i)) != "SERVING") {
      progress->Show("starting the services: " + std::to_string(i) + " of " + std::to_string(kAreas.size()) +
                     " serve, waiting for " + kAreas[i]);
      if (std::chrono::steady_clock::now() > give_up)
        return absl::InternalError(std::string(kAreas[i]) + " is not serving after 60 s; see " +
                                   (plant.logs() / (std::string(kAreas[i]) + ".log")).string());
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
  }
  return absl::OkStatus();
}

// New programs take the place of old ones, and those whose words changed start again; PostgreSQL goes on.
void Refresh(const LocalPlant& plant, bool programs_changed) {
  Supervisorctl(plant, {"update"});
  std::vector<std::string> restart = {"restart"};
  restart.insert(restart.end(), kAreas.begin(), kAreas.end());
  if (programs_changed) Supervisorctl(plant, restart);
}

absl::Status Supervise(const LocalPlant& plant) {
  const fs::path last_up = plant.data / "plant.json";
  bool programs_changed = !fs::exists(last_up);
  for (const char* area : kAreas)
    programs_changed = programs_changed || fs::last_write_time(plant.binaries / (std::string("sixpoint-") + area)) >
                                               fs::last_write_time(last_up);
  std::ofstream(plant.supervisor_config()) << SupervisorConfig(plant, IsRoot() ? kServiceUser : "");
  std::ofstream(last_up) << nlohmann::json{{"base_port", plant.base_port},
                                           {"listen", plant.address.listen},
                                           {"announce", plant.address.announce}}
                                .dump()
                         << "\n";
  if (SupervisorRuns(plant)) {
    Refresh(plant, programs_changed);
    return absl::OkStatus();
  }
  const Finished started = RunProgram({"supervisord", "-c", plant.supervisor_config().string()});
  return started.exit_code == 0 ? absl::OkStatus() : absl::InternalError("supervisord: " + started.output);
}

absl::Status Start(LocalPlant* plant, ProgressLine* progress) {
  progress->Show("preparing " + plant->data.string());
  if (absl::Status status = EnsureServiceUser(); !status.ok()) return status;
  if (absl::Status status = MakeFolders(plant); !status.ok()) return status;
  if (absl::Status status = MakeBinariesReachable(plant); !status.ok()) return status;
  progress->Show("making the database");
  if (absl::Status status = CreateDatabase(*plant); !status.ok()) return status;
  progress->Show("starting PostgreSQL");
  if (absl::Status status = Supervise(*plant); !status.ok()) return status;
  if (absl::Status status = WaitForDatabase(*plant); !status.ok()) return status;
  progress->Show("bringing the schema up to date");
  if (absl::Status status = Migrate(*plant); !status.ok()) return status;
  return WaitForServices(*plant, progress);
}

// The plant that was last started there.
absl::StatusOr<LocalPlant> Stored(const fs::path& data) {
  LocalPlant plant;
  std::error_code missing;
  plant.data = fs::canonical(data, missing);
  std::ifstream file(plant.data / "plant.json");
  const nlohmann::json stored = nlohmann::json::parse(file, nullptr, false);
  if (missing || !stored.is_object()) return runtime::Refuse("--data", data.string(), "a folder made by `sixpoint up`");
  plant.base_port = stored.value("base_port", plant.base_port);
  plant.address.listen = stored.value("listen", plant.address.listen);
  plant.address.announce = stored.value("announce", plant.address.listen);
  return plant;
}

}  // namespace

absl::Status StartPlant(LocalPlant plant, ProgressLine* progress) {
  try {
    return Start(&plant, progress);
  } catch (const fs::filesystem_error& error) {
    return absl::PermissionDeniedError(error.what());
  }
}

absl::Status StopPlant(const fs::path& data) {
  const absl::StatusOr<LocalPlant> plant = Stored(data);
  if (!plant.ok()) return plant.status();
  if (!SupervisorRuns(*plant)) return absl::OkStatus();
  Supervisorctl(*plant, {"shutdown"});
  for (int attempt = 0; attempt < 600 && fs::exists(plant->data / "supervisord.pid"); ++attempt)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  if (!fs::exists(plant->data / "supervisord.pid")) return absl::OkStatus();
  return absl::InternalError("the services did not stop within 60 s; see " + plant->logs().string());
}

bool PlantHealth::AllServe() const {
  bool all = supervised && database;
  for (const std::string& health : services) all = all && health == "SERVING";
  return all;
}

absl::StatusOr<PlantHealth> HealthOf(const fs::path& data) {
  absl::StatusOr<LocalPlant> plant = Stored(data);
  if (!plant.ok()) return plant.status();
  PlantHealth health;
  health.plant = *std::move(plant);
  health.supervised = SupervisorRuns(health.plant);
  health.database = DatabaseAccepts(health.plant);
  for (std::size_t i = 0; i < kAreas.size(); ++i) health.services.push_back(ServiceHealth(health.plant.OwnAddress(i)));
  return health;
}

fs::path UsualDataFolder() {
  if (IsRoot()) return "/var/lib/sixpoint";
  const char* const home = std::getenv("HOME");
  return fs::path(home == nullptr ? "." : home) / ".sixpoint";
}

}  // namespace sixpoint::cli
