#include "cli/local_plant.h"

#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <thread>

#include "cli/document.h"
#include "cli/gateway_health.h"
#include "cli/last_words.h"
#include "cli/plant_certificates.h"
#include "cli/plant_checks.h"
#include "cli/plant_folder.h"
#include "cli/plant_programs.h"
#include "cli/prometheus_config.h"
#include "cli/service_health.h"
#include "cli/service_user.h"
#include "cli/subprocess.h"
#include "cli/supervisor.h"
#include "services/runtime/credentials.h"
#include "services/runtime/errors.h"

namespace sixpoint::cli {
namespace {

namespace fs = std::filesystem;
using std::chrono::steady_clock;

constexpr std::chrono::seconds kHealthPatience{2};
constexpr std::chrono::seconds kStartPatience{60};
// A service that says for so long why it does not serve will not serve by waiting.
constexpr std::chrono::seconds kReasonPatience{10};

// Made beside and then renamed, so that a cluster is whole or not there.
absl::Status CreateDatabase(const LocalPlant& plant, const ServiceUser& user) {
  if (fs::symlink_status(plant.database()).type() != fs::file_type::not_found)
    return MakeServiceFolder(plant.database(), user);
  const fs::path beside = plant.database().string() + ".part";
  if (absl::Status status = MakeServiceFolder(beside, user); !status.ok()) return status;
  RunProgram(AsServiceUser({"find", beside.string(), "-mindepth", "1", "-delete"}));
  const Finished made = RunProgram(
      AsServiceUser({std::string(kPostgresBin) + "initdb", "--pgdata", beside.string(), "--data-checksums",
                     "--encoding", "UTF8", "--locale", "C.UTF-8", "--username", "sixpoint", "--auth", "trust"}));
  if (made.exit_code != 0) return absl::InternalError("initdb failed: " + made.output);
  fs::rename(beside, plant.database());
  return absl::OkStatus();
}

// By what it says of itself in its file: who connects before is refused, and stands in its log as FATAL.
bool DatabaseAccepts(const LocalPlant& plant) {
  std::ifstream file(plant.database() / "postmaster.pid");
  constexpr int kStatusLine = 8;
  std::string line;
  for (int i = 0; i < kStatusLine; ++i)
    if (!std::getline(file, line)) return false;
  return line.rfind("ready", 0) == 0 && RunProgram(AsServiceUser({std::string(kPostgresBin) + "pg_isready", "-q", "-d",
                                                                  "postgres", "-h", plant.sockets().string()}))
                                                .exit_code == 0;
}

// "1" where the plant's database is there, nothing where it is not yet.
Finished AskForDatabase(const LocalPlant& plant) {
  return RunProgram(AsServiceUser({std::string(kPostgresBin) + "psql", "-h", plant.sockets().string(), "-U", "sixpoint",
                                   "-d", "postgres", "-Atc", "SELECT 1 FROM pg_database WHERE datname = 'sixpoint'"}));
}

absl::Status WaitForDatabase(const LocalPlant& plant) {
  for (int attempt = 0; attempt < 120; ++attempt) {
    if (DatabaseAccepts(plant)) {
      Finished asked = AskForDatabase(plant);
      if (asked.exit_code == 0 && asked.output.rfind('1', 0) == 0) return absl::OkStatus();
      if (asked.exit_code == 0)
        asked = RunProgram(AsServiceUser({std::string(kPostgresBin) + "createdb", "-h", plant.sockets().string(), "-U",
                                          "sixpoint", "--maintenance-db", "postgres", "sixpoint"}));
      if (asked.exit_code == 0) return absl::OkStatus();
      if (asked.output.find("role \"sixpoint\" does not exist") != std::string::npos)
        return runtime::Refuse("--data", plant.database().string(), "a PostgreSQL cluster that `sixpoint up` made");
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(250));
  }
  return absl::InternalError("PostgreSQL did not start within 30 s; see " + (plant.logs() / "postgres.log").string());
}

absl::Status Migrate(const LocalPlant& plant, const fs::path& program) {
  const Finished migrated = RunProgram(AsServiceUser(
      {program.string(), "--database", plant.conninfo(), "--migrations", plant.migrations.string(), "--wait-s", "10"}));
  if (migrated.exit_code == 0) return absl::OkStatus();
  // "sixpoint-migrate: CODE: message"
  const std::string prefix = "FAILED_PRECONDITION: ";
  const std::size_t refused = migrated.output.find(prefix);
  if (refused == std::string::npos) return absl::InternalError("migration failed: " + migrated.output);
  const std::string sentence = migrated.output.substr(refused + prefix.size());
  return absl::FailedPreconditionError(sentence.substr(0, sentence.find_last_not_of('\n') + 1));
}

// That no other plant's clouds are in the bucket. The ingest service asks, which knows how.
absl::Status CheckBucket(const LocalPlant& plant) {
  if (plant.settings.blob_store == PlantSettings().blob_store) return absl::OkStatus();
  const std::size_t ingest = 1;
  const Finished asked = RunProgram(AsServiceUser(
      {(plant.binaries / "sixpoint-ingest").string(), "--listen", plant.ListensAt(ingest), "--database",
       plant.ConninfoOf(ingest), "--certificates", plant.certificates_of(kAreas[ingest]).string(), "--revoked",
       plant.revoked().string(), "--blob-store", plant.settings.blob_store, "--check-bucket"}));
  if (asked.exit_code == 0) return absl::OkStatus();
  const std::string said = LastWordsOf(asked.output), name = "sixpoint-ingest: ";
  if (said.empty()) return runtime::Refuse("--blob-store", plant.settings.blob_store, "one that can be asked");
  return absl::InvalidArgumentError(said.rfind(name, 0) == 0 ? said.substr(name.size()) : said);
}

// By the service's own program, as its user: root writes nothing where that user may.
absl::Status MakeLedgerKey(const LocalPlant& plant, const ServiceUser& user) {
  if (absl::Status made = MakeServiceFolder(plant.ledger(), user); !made.ok()) return made;
  const Finished made = RunProgram(
      AsServiceUser({(plant.binaries / "sixpoint-plant").string(), "--listen", plant.ListensAt(0), "--database",
                     plant.ConninfoOf(0), "--certificates", plant.certificates_of(kAreas[0]).string(), "--revoked",
                     plant.revoked().string(), "--ledger-key", plant.ledger_key().string(), "--make-ledger-key"}));
  if (made.exit_code == 0) return absl::OkStatus();
  return absl::InternalError("no key of the ledger: " + LastWordsOf(made.output));
}

absl::Status WriteSupervisorConfig(const LocalPlant& plant, Programs programs) {
  return WriteFile(plant.supervisor_config().string(), SupervisorConfig(plant, programs));
}

// PostgreSQL alone, where nothing runs yet: no service of the new release may meet the old schema. Says whether it was started here.
absl::StatusOr<bool> StartDatabase(const LocalPlant& plant) {
  if (SupervisorRuns(plant)) {
    Supervisorctl(plant.supervisor_config(), {"start", "postgres"});  // where a person had stopped it
    return false;
  }
  if (absl::Status status = WriteSupervisorConfig(plant, Programs::kDatabase); !status.ok()) return status;
  const Finished started = RunProgram(AsServiceUser({"supervisord", "-c", plant.supervisor_config().string()}));
  if (started.exit_code != 0) return absl::InternalError("supervisord: " + started.output);
  return true;
}

absl::Status StopSupervisor(const LocalPlant& plant) {
  Supervisorctl(plant.supervisor_config(), {"shutdown"});
  for (int attempt = 0; attempt < 600 && fs::exists(plant.supervisor_pid()); ++attempt)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  if (!fs::exists(plant.supervisor_pid())) return absl::OkStatus();
  return absl::InternalError("the services did not stop within 60 s; see " + plant.logs().string());
}

// New programs take the place of old ones, and those whose words changed start again; PostgreSQL goes on.
absl::Status StartServices(const LocalPlant& plant, bool all_start) {
  const bool programs_changed = AreProgramsNewer(plant, plant.supervisor_config());
  if (absl::Status status = WriteSupervisorConfig(plant, Programs::kAll); !status.ok()) return status;
  Supervisorctl(plant.supervisor_config(), {"update"});
  Supervisorctl(plant.supervisor_config(), {"start", "all"});  // what a person had stopped, or was given up
  if (all_start || !programs_changed) return absl::OkStatus();
  std::vector<std::string> restart = {"restart", "watchdog"};
  const std::vector<std::string> served = plant.Served();
  restart.insert(restart.end(), served.begin(), served.end());
  Supervisorctl(plant.supervisor_config(), restart);
  return absl::OkStatus();
}

// One that answers and is not ours is another plant's.
std::vector<ServiceState> StatesOf(const LocalPlant& plant, const std::map<std::string, std::string>& programs) {
  // As nobody: the folder has no identity.
  const auto credentials = runtime::ChannelCredentialsOf(plant.certificates());
  std::vector<ServiceState> states;
  const std::vector<std::string> served = plant.Served();
  for (std::size_t i = 0; i < served.size(); ++i) {
    const std::string& area = served[i];
    const auto program = programs.find(area);
    const bool runs = program != programs.end() && program->second == "RUNNING";
    ServiceState state{"NOT_REACHED", ""};
    if (runs && area == kGateway)
      state.health = GatewayHealth(plant.OwnGatewayUrl(), plant.certificates(), kHealthPatience);
    else if (runs && credentials.ok())
      state.health = ServiceHealth(plant.OwnAddress(i), *credentials, kHealthPatience);
    if (state.health != "SERVING") state.why = LastWords(plant.logs() / (area + ".log"));
    if (runs && !credentials.ok()) state.why = std::string(credentials.status().message());
    if (state.health == "NOT_TRUSTED" && state.why.empty())
      state.why = "its certificate does not hold, want what `sixpoint certs renew` makes";
    states.push_back(std::move(state));
  }
  return states;
}

absl::Status DoesNotServe(const LocalPlant& plant, const std::string& name, const std::string& why) {
  if (!why.empty()) return absl::FailedPreconditionError(name + " does not serve: " + why);
  return absl::InternalError(name + " does not serve; see " + (plant.logs() / (name + ".log")).string());
}

absl::Status WaitForServices(const LocalPlant& plant, ProgressLine* progress) {
  const auto start = steady_clock::now();
  std::string said;
  auto said_since = start;
  for (;;) {
    std::map<std::string, std::string> programs = ProgramStates(plant);
    const std::vector<ServiceState> states = StatesOf(plant, programs);
    std::size_t waiting = 0;
    while (waiting < states.size() && states[waiting].health == "SERVING") ++waiting;
    // A plant whose services nobody asks is not up: one that is stuck would stay so.
    if (waiting == states.size() && programs["watchdog"] == "RUNNING") return absl::OkStatus();
    const bool watchdog = waiting == states.size();
    const std::string name = watchdog ? "watchdog" : plant.Served()[waiting];
    const std::string why = watchdog ? "" : states[waiting].why;
    progress->Show("starting the services: waiting for " + name);
    if (why != said) {
      said = why;
      said_since = steady_clock::now();
    }
    if (steady_clock::now() > start + kStartPatience ||
        (!said.empty() && steady_clock::now() > said_since + kReasonPatience))
      return DoesNotServe(plant, name, said);
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
}

// A bucket that the plant was not told of before must be its own. One that it was told of may be another's since a restore: then it
// starts, and a person says which is right.
absl::Status CheckNewBucket(const LocalPlant& plant, ProgressLine* progress) {
  const absl::Status own = CheckBucket(plant);
  const absl::StatusOr<std::optional<PlantSettings>> stored = StoredSettings(plant.data);
  const bool known = stored.ok() && stored->has_value() && (*stored)->blob_store == plant.settings.blob_store;
  if (own.ok() || !known) return own;
  progress->Keep("warning: " + std::string(own.message()));
  return absl::OkStatus();
}

// The schema first: what runs already goes on with the new one, and what is new never meets the old one. The certificates last: what
// runs already takes those that are new by itself.
absl::Status BringUp(LocalPlant* plant, const ServiceUser& user, bool reached, ProgressLine* progress) {
  if (absl::Status status = WaitForDatabase(*plant); !status.ok()) return status;
  progress->Show("bringing the schema up to date");
  const fs::path migrate = (reached ? plant->binaries : plant->data / "bin") / "sixpoint-migrate";
  if (absl::Status status = Migrate(*plant, migrate); !status.ok()) return status;
  if (!reached)
    if (absl::Status status = CopyPrograms(plant); !status.ok()) return status;
  if (absl::Status status = CheckNewBucket(*plant, progress); !status.ok()) return status;
  progress->Show("looking at the certificates");
  const absl::Status renewed = RenewCertificates(*plant, user, Renewal::kWhereDue).status();
  return renewed.ok() ? MakeLedgerKey(*plant, user) : renewed;
}

absl::Status Start(LocalPlant* plant, ProgressLine* progress) {
  progress->Show("preparing " + plant->data.string());
  if (absl::Status status = CheckPrograms(plant, FindServiceUser()); !status.ok()) return status;
  if (absl::Status status = CheckPorts(*plant); !status.ok()) return status;
  if (absl::Status status = CheckRoom(*plant); !status.ok()) return status;
  if (absl::Status status = CheckCluster(*plant, FindServiceUser()); !status.ok()) return status;
  umask(022);
  const absl::StatusOr<ServiceUser> user = EnsureServiceUser();
  if (!user.ok()) return user.status();
  const absl::StatusOr<std::optional<PlantSettings>> stored = StoredSettings(plant->data);
  if (!stored.ok()) return stored.status();
  if (absl::Status status = MakeDataFolder(plant->data, *user); !status.ok()) return status;
  const absl::StatusOr<DataFolderLock> lock = DataFolderLock::Take(plant->data);
  if (!lock.ok()) return lock.status();
  // Whatever becomes of this start, the folder is a plant's from now on; what it was told counts once the schema is there.
  if (!stored->has_value())
    if (absl::Status status = StoreSettings(plant->data, PlantSettings()); !status.ok()) return status;
  if (absl::Status status = MakeAuthority(*plant, *user); !status.ok()) return status;
  progress->Show("making the database");
  if (absl::Status status = CreateDatabase(*plant, *user); !status.ok()) return status;
  const absl::StatusOr<std::string> system = DatabaseSystemOf(*plant);
  if (!system.ok()) return system.status();
  plant->settings.database_system = *system;
  const bool reached = ServiceUserReaches(*plant);
  if (!reached)
    if (absl::Status status = CopyMigrations(plant); !status.ok()) return status;
  progress->Show("starting PostgreSQL");
  const absl::StatusOr<bool> started = StartDatabase(*plant);
  if (!started.ok()) return started.status();
  if (absl::Status status = BringUp(plant, *user, reached, progress); !status.ok()) {
    if (*started) StopSupervisor(*plant).IgnoreError();
    return status;
  }
  if (absl::Status status = StoreSettings(plant->data, plant->settings); !status.ok()) return status;
  if (absl::Status status = WriteFile(plant->prometheus_config().string(), PrometheusConfig(*plant)); !status.ok())
    return status;
  if (absl::Status status = StartServices(*plant, *started); !status.ok()) return status;
  return WaitForServices(*plant, progress);
}

// Behind a proxy it is reached from this computer alone, whoever reaches the services.
bool IsAtListen(const LocalPlant& plant) { return plant.IsGatewaySecured() || plant.address.IsLoopback(); }

std::string GatewayUrl(const LocalPlant& plant, const std::string& host) {
  return (plant.IsGatewaySecured() ? "https://" : "http://") +
         HostAndPort(IsAtListen(plant) ? host : plant.GatewayHost(), plant.settings.HttpPort());
}

}  // namespace

std::vector<std::string> LocalPlant::Served() const {
  std::vector<std::string> served(kAreas.begin(), kAreas.end());
  if (HasGateway()) served.emplace_back(kGateway);
  return served;
}

std::string LocalPlant::GatewayHost() const { return IsAtListen(*this) ? address.listen : "127.0.0.1"; }
std::string LocalPlant::OwnGatewayUrl() const { return GatewayUrl(*this, address.Own()); }
std::string LocalPlant::PageUrl() const {
  if (!HasGateway()) return "";
  return settings.page_url.empty() ? AnnouncedGatewayUrl() : settings.page_url;
}
std::string LocalPlant::AnnouncedGatewayUrl() const { return GatewayUrl(*this, address.announce); }

absl::StatusOr<LocalPlant> PlantIn(const fs::path& data) {
  try {
    LocalPlant plant;
    absl::StatusOr<fs::path> folder = CheckDataFolder(data, FindServiceUser());
    if (!folder.ok()) return folder.status();
    plant.data = *std::move(folder);
    absl::StatusOr<std::optional<PlantSettings>> stored = StoredSettings(plant.data);
    if (!stored.ok()) return stored.status();
    plant.settings = std::move(*stored).value_or(PlantSettings());
    absl::StatusOr<ListenAddress> address = plant.settings.Address();
    if (!address.ok()) return address.status();
    plant.address = *std::move(address);
    return plant;
  } catch (const fs::filesystem_error& error) {
    return absl::PermissionDeniedError(error.what());
  }
}

absl::StatusOr<LocalPlant> KnownPlant(const fs::path& data) {
  absl::StatusOr<LocalPlant> plant = PlantIn(data);
  if (!plant.ok()) return plant;
  const absl::StatusOr<std::optional<PlantSettings>> stored = StoredSettings(plant->data);
  if (stored.ok() && !stored->has_value())
    return runtime::Refuse("--data", data.string(), "a folder made by `sixpoint up`");
  return plant;
}

absl::Status StartPlant(LocalPlant plant, ProgressLine* progress) {
  try {
    return Start(&plant, progress);
  } catch (const fs::filesystem_error& error) {
    return runtime::Refuse("--data", error.path1().string() + " (" + error.code().message() + ")",
                           "a folder that " + UserName(geteuid()) + " can write");
  }
}

absl::Status StopPlant(const fs::path& data) {
  const absl::StatusOr<LocalPlant> plant = KnownPlant(data);
  if (!plant.ok()) return plant.status();
  return SupervisorRuns(*plant) ? StopSupervisor(*plant) : absl::OkStatus();
}

bool PlantHealth::AllServe() const {
  bool all = supervised && database;
  for (const ServiceState& service : services) all = all && service.health == "SERVING";
  return all;
}

absl::StatusOr<PlantHealth> HealthOf(const fs::path& data) {
  absl::StatusOr<LocalPlant> plant = KnownPlant(data);
  if (!plant.ok()) return plant.status();
  PlantHealth health;
  health.plant = *std::move(plant);
  const std::map<std::string, std::string> programs = ProgramStates(health.plant);
  health.supervised = !programs.empty();
  health.database = DatabaseAccepts(health.plant);
  health.services = StatesOf(health.plant, programs);
  health.certificates = ServiceCertificates(health.plant, FindServiceUser());
  return health;
}

fs::path UsualDataFolder() {
  if (IsRoot()) return "/var/lib/sixpoint";
  const char* const home = std::getenv("HOME");
  return fs::path(home == nullptr ? "." : home) / ".sixpoint";
}

}  // namespace sixpoint::cli
