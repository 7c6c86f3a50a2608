#include "cli/local_plant.h"

#include <grpcpp/grpcpp.h>
#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "cli/subprocess.h"
#include "grpc/health/v1/health.grpc.pb.h"

namespace sixpoint::cli {
namespace {

namespace fs = std::filesystem;

// Areas in the order of their ports: base_port + index.
constexpr std::array<const char*, 6> kAreas = {"plant",        "ingest",     "calibration",
                                               "registration", "correction", "inspection"};
constexpr const char* kPostgresBin = "/usr/lib/postgresql/15/bin/";
constexpr const char* kServiceUser = "sixpoint";
// A unix socket's path holds 107 bytes; PostgreSQL appends "/.s.PGSQL.5432.lock".
constexpr std::size_t kLongestSocketFolder = 80;

struct LocalPlant {
  fs::path data;
  fs::path binaries;    // where the service programs are
  fs::path migrations;  // where the SQL files are
  int base_port = 7400;
  std::string blob_store = "postgresql";

  fs::path database() const { return data / "postgres"; }
  fs::path sockets() const { return data / "run"; }
  fs::path logs() const { return data / "log"; }
  fs::path supervisor_config() const { return data / "supervisord.conf"; }
  std::string conninfo() const { return "host=" + sockets().string() + " dbname=sixpoint user=sixpoint"; }
  std::string address(std::size_t area) const {
    return "127.0.0.1:" + std::to_string(base_port + static_cast<int>(area));
  }
};

// What an engineer can act on; printed as it is.
struct Problem : std::runtime_error {
  using std::runtime_error::runtime_error;
};

bool IsRoot() { return geteuid() == 0; }

// PostgreSQL refuses root, and no service needs it: as root, everything runs as the system user `sixpoint`.
void EnsureServiceUser() {
  if (!IsRoot() || getpwnam(kServiceUser) != nullptr) return;
  const Finished made = RunProgram({"useradd", "--system", "--user-group", "--home-dir", "/nonexistent", "--shell",
                                    "/usr/sbin/nologin", kServiceUser});
  if (made.exit_code != 0) throw Problem("cannot add the system user sixpoint: " + made.output);
}

std::vector<std::string> AsServiceUser(std::vector<std::string> command) {
  if (!IsRoot()) return command;
  std::vector<std::string> wrapped = {"runuser", "-u", kServiceUser, "--"};
  wrapped.insert(wrapped.end(), command.begin(), command.end());
  return wrapped;
}

void MakeFolder(const fs::path& folder) {
  fs::create_directories(folder);
  fs::permissions(folder, fs::perms::owner_all);
  if (IsRoot()) {
    const passwd* user = getpwnam(kServiceUser);
    if (chown(folder.c_str(), user->pw_uid, user->pw_gid) != 0)
      throw Problem("cannot give " + folder.string() + " to the user sixpoint");
  }
}

// A checkout under /root cannot be entered by the service user: then the programs are copied beside the data.
void MakeBinariesReachable(LocalPlant& plant) {
  if (!IsRoot()) return;
  const Finished reachable = RunProgram(AsServiceUser({"test", "-x", (plant.binaries / "sixpoint-ingest").string()}));
  if (reachable.exit_code == 0) return;
  const fs::path copies = plant.data / "bin";
  MakeFolder(copies);
  for (const auto& entry : fs::directory_iterator(plant.binaries)) {
    const std::string name = entry.path().filename().string();
    if (name.rfind("sixpoint-", 0) == 0 && entry.is_regular_file())
      fs::copy_file(entry.path(), copies / name, fs::copy_options::update_existing);
  }
  plant.binaries = copies;
}

std::string SupervisorConfig(const LocalPlant& plant) {
  std::ostringstream out;
  const std::string run_as = IsRoot() ? std::string("user=") + kServiceUser + "\n" : "";
  const auto program = [&](const std::string& name, const std::string& command, int priority,
                           const std::string& stop_signal) {
    // startretries: after a crash PostgreSQL refuses to start for some seconds; a killed service always comes back.
    out << "\n[program:" << name << "]\ncommand=" << command << "\n"
        << run_as << "priority=" << priority
        << "\nautorestart=true\nstartsecs=1\nstartretries=1000\nstopsignal=" << stop_signal
        << "\nstopwaitsecs=30\nstdout_logfile=/dev/null\nstderr_logfile=" << (plant.logs() / (name + ".log")).string()
        << "\nstderr_logfile_maxbytes=16MB\nstderr_logfile_backups=4\n";
  };
  out << "; Written by `sixpoint up`.\n[supervisord]\nnodaemon=false\nminfds=4096\n"
      << (IsRoot() ? "user=root\n" : "") << "pidfile=" << (plant.data / "supervisord.pid").string()
      << "\nlogfile=" << (plant.logs() / "supervisord.log").string() << "\nchildlogdir=" << plant.logs().string()
      << "\n\n[unix_http_server]\nfile=" << (plant.sockets() / "supervisor.sock").string()
      << "\nchmod=0700\n\n[rpcinterface:supervisor]\n"
         "supervisor.rpcinterface_factory=supervisor.rpcinterface:make_main_rpcinterface\n\n[supervisorctl]\nserverurl="
         "unix://"
      << (plant.sockets() / "supervisor.sock").string() << "\n";
  program("postgres",
          std::string(kPostgresBin) + "postgres -D " + plant.database().string() + " -k " + plant.sockets().string() +
              " -c listen_addresses='' -c max_connections=100 -c shared_buffers=128MB -c wal_compression=on"
              // After a crash one flush of the file system, not one of each file: seconds less until it is back.
              " -c recovery_init_sync_method=syncfs",
          1, "INT");
  std::string peers;
  for (std::size_t i = 0; i < kAreas.size(); ++i) peers += std::string(" --peer ") + kAreas[i] + "=" + plant.address(i);
  for (std::size_t i = 0; i < kAreas.size(); ++i) {
    const std::string own = kAreas[i] == std::string("ingest") ? " --blob-store " + plant.blob_store : "";
    program(kAreas[i],
            (plant.binaries / (std::string("sixpoint-") + kAreas[i])).string() + " --listen " + plant.address(i) +
                " --database \"" + plant.conninfo() + "\" --workers " + plant.binaries.string() + peers + own,
            10, "TERM");
  }
  return out.str();
}

Finished Supervisorctl(const LocalPlant& plant, std::vector<std::string> words) {
  std::vector<std::string> command = {"supervisorctl", "-c", plant.supervisor_config().string()};
  command.insert(command.end(), words.begin(), words.end());
  return RunProgram(command);
}

bool SupervisorRuns(const LocalPlant& plant) {
  return fs::exists(plant.supervisor_config()) && Supervisorctl(plant, {"pid"}).exit_code == 0;
}

std::string HealthOf(const std::string& address) {
  const auto stub = grpc::health::v1::Health::NewStub(grpc::CreateChannel(address, grpc::InsecureChannelCredentials()));
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(2));
  grpc::health::v1::HealthCheckResponse response;
  const grpc::Status status = stub->Check(&context, {}, &response);
  if (!status.ok()) return "NOT_REACHED";
  return grpc::health::v1::HealthCheckResponse::ServingStatus_Name(response.status());
}

void CreateDatabase(const LocalPlant& plant) {
  if (!fs::exists(plant.database() / "PG_VERSION")) {
    const Finished made = RunProgram(
        AsServiceUser({std::string(kPostgresBin) + "initdb", "--pgdata", plant.database().string(), "--data-checksums",
                       "--encoding", "UTF8", "--locale", "C.UTF-8", "--username", "sixpoint", "--auth", "trust"}));
    if (made.exit_code != 0) throw Problem("initdb failed: " + made.output);
  }
}

void WaitForDatabase(const LocalPlant& plant) {
  const std::string sockets = plant.sockets().string();
  for (int attempt = 0; attempt < 120; ++attempt) {
    if (RunProgram({std::string(kPostgresBin) + "pg_isready", "-q", "-h", sockets}).exit_code == 0) {
      const Finished made =
          RunProgram({std::string(kPostgresBin) + "createdb", "-h", sockets, "-U", "sixpoint", "sixpoint"});
      if (made.exit_code == 0 || made.output.find("already exists") != std::string::npos) return;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(250));
  }
  throw Problem("PostgreSQL did not start within 30 s; see " + (plant.logs() / "postgres.log").string());
}

void WaitForServices(const LocalPlant& plant) {
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  for (std::size_t i = 0; i < kAreas.size(); ++i) {
    while (HealthOf(plant.address(i)) != "SERVING") {
      if (std::chrono::steady_clock::now() > give_up)
        throw Problem(std::string(kAreas[i]) + " is not serving after 60 s; see " +
                      (plant.logs() / (std::string(kAreas[i]) + ".log")).string());
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
  }
}

void Up(LocalPlant plant) {
  if (plant.base_port < 1024 || plant.base_port > 65000)
    throw Problem("--base-port: " + std::to_string(plant.base_port) + ", want 1024 to 65000");
  EnsureServiceUser();
  MakeFolder(plant.data);
  plant.data = fs::canonical(plant.data);
  if (plant.sockets().string().size() > kLongestSocketFolder)
    throw Problem("--data: " + plant.data.string() + ", want a shorter path (unix sockets hold 107 bytes)");
  for (const fs::path& folder : {plant.database(), plant.sockets(), plant.logs()}) MakeFolder(folder);
  MakeBinariesReachable(plant);
  CreateDatabase(plant);
  const fs::path last_up = plant.data / "plant.json";
  bool programs_changed = false;
  for (const char* area : kAreas)
    programs_changed =
        programs_changed || !fs::exists(last_up) ||
        fs::last_write_time(plant.binaries / (std::string("sixpoint-") + area)) > fs::last_write_time(last_up);
  std::ofstream(plant.supervisor_config()) << SupervisorConfig(plant);
  std::ofstream(last_up) << nlohmann::json{{"base_port", plant.base_port}}.dump() << "\n";
  if (SupervisorRuns(plant)) {
    // New programs take the place of old ones; PostgreSQL goes on.
    Supervisorctl(plant, {"update"});
    std::vector<std::string> restart = {"restart"};
    restart.insert(restart.end(), kAreas.begin(), kAreas.end());
    if (programs_changed) Supervisorctl(plant, restart);
  } else {
    const Finished started = RunProgram({"supervisord", "-c", plant.supervisor_config().string()});
    if (started.exit_code != 0) throw Problem("supervisord did not start: " + started.output);
  }
  WaitForDatabase(plant);
  const Finished migrated = RunProgram({(plant.binaries / "sixpoint-migrate").string(), "--database", plant.conninfo(),
                                        "--migrations", plant.migrations.string()});
  if (migrated.exit_code != 0) throw Problem("migration failed: " + migrated.output);
  WaitForServices(plant);
}

LocalPlant Stored(const fs::path& data) {
  LocalPlant plant;
  std::error_code missing;
  plant.data = fs::canonical(data, missing);
  std::ifstream file(plant.data / "plant.json");
  if (missing || !file) throw Problem("--data: " + data.string() + ", want a folder made by `sixpoint up`");
  plant.base_port = nlohmann::json::parse(file).value("base_port", 7400);
  return plant;
}

void Down(const fs::path& data) {
  const LocalPlant plant = Stored(data);
  if (!SupervisorRuns(plant)) return;
  Supervisorctl(plant, {"shutdown"});
  for (int attempt = 0; attempt < 600 && fs::exists(plant.data / "supervisord.pid"); ++attempt)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  if (fs::exists(plant.data / "supervisord.pid"))
    throw Problem("the services did not stop within 60 s; see " + plant.logs().string());
}

// True when everything serves.
bool Status(const fs::path& data, bool json) {
  const LocalPlant plant = Stored(data);
  const bool supervised = SupervisorRuns(plant);
  nlohmann::json services = nlohmann::json::array();
  bool all = supervised;
  for (std::size_t i = 0; i < kAreas.size(); ++i) {
    const std::string health = HealthOf(plant.address(i));
    all = all && health == "SERVING";
    services.push_back({{"area", kAreas[i]}, {"address", plant.address(i)}, {"health", health}});
  }
  const std::string database =
      RunProgram({std::string(kPostgresBin) + "pg_isready", "-q", "-h", plant.sockets().string()}).exit_code == 0
          ? "accepting connections"
          : "not reached";
  all = all && database == "accepting connections";
  if (json) {
    std::cout << nlohmann::json{{"data", plant.data.string()},
                                {"supervisor", supervised},
                                {"database", database},
                                {"services", services}}
                     .dump(2)
              << "\n";
    return all;
  }
  std::cout << "data          " << plant.data.string() << "\nsupervisor    " << (supervised ? "running" : "not running")
            << "\ndatabase      " << database << "  (psql '" << plant.conninfo() << "')\n";
  for (const auto& service : services) {
    std::string area = service["area"];
    area.resize(14, ' ');
    std::cout << area << service["address"].get<std::string>() << "  " << service["health"].get<std::string>() << "\n";
  }
  return all;
}

fs::path DefaultData() {
  return IsRoot() ? fs::path("/var/lib/sixpoint")
                  : fs::path(std::getenv("HOME") ? std::getenv("HOME") : ".") / ".sixpoint";
}

fs::path OwnFolder() { return fs::canonical("/proc/self/exe").parent_path(); }

// In a checkout the migrations lie beside the build folder; installed, beside the programs.
fs::path DefaultMigrations() {
  for (fs::path folder = OwnFolder(); folder != folder.root_path(); folder = folder.parent_path())
    if (fs::exists(folder / "migrations")) return folder / "migrations";
  return OwnFolder() / "migrations";
}

// Runs a command, printing a Problem as the engineer should see it.
template <typename Command>
void OrExit(const Command& command) {
  try {
    if (!command()) std::exit(1);
  } catch (const std::exception& problem) {
    std::cerr << "sixpoint: " << problem.what() << "\n";
    std::exit(1);
  }
}

}  // namespace

void AddLocalPlantCommands(CLI::App& app) {
  struct Flags {
    std::string data = DefaultData().string();
    std::string migrations;
    std::string blob_store = "postgresql";
    int base_port = 7400;
    bool json = false;
  };
  auto flags = std::make_shared<Flags>();
  auto* up = app.add_subcommand("up", "Start all services and a private PostgreSQL under --data");
  auto* down = app.add_subcommand("down", "Stop them");
  auto* status = app.add_subcommand("status", "Tell what runs; exit code 0 when everything serves");
  for (CLI::App* command : {up, down, status})
    command->add_option("--data", flags->data, "Data folder")->capture_default_str();
  up->add_option("--base-port", flags->base_port, "The plant service's port; the others follow it")
      ->capture_default_str();
  up->add_option("--migrations", flags->migrations, "Folder of the SQL migrations");
  up->add_option("--blob-store", flags->blob_store,
                 "Where new clouds go: postgresql, or s3:// and the path of a file that the user sixpoint owns")
      ->capture_default_str();
  status->add_flag("--json", flags->json, "For programs");
  up->callback([flags] {
    OrExit([&] {
      LocalPlant plant;
      plant.data = flags->data;
      plant.binaries = OwnFolder();
      plant.migrations = flags->migrations.empty() ? DefaultMigrations() : fs::path(flags->migrations);
      plant.base_port = flags->base_port;
      plant.blob_store = flags->blob_store;
      Up(plant);
      return Status(plant.data, false);
    });
  });
  down->callback([flags] {
    OrExit([&] {
      Down(flags->data);
      std::cout << "stopped\n";
      return true;
    });
  });
  status->callback([flags] { OrExit([&] { return Status(flags->data, flags->json); }); });
}

}  // namespace sixpoint::cli
