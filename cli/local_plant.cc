#include "cli/local_plant.h"

#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <thread>

#include "cli/document.h"
#include "cli/last_words.h"
#include "cli/plant_certificates.h"
#include "cli/plant_checks.h"
#include "cli/plant_folder.h"
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

std::vector<fs::path> ProgramFiles(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const char* area : kAreas) files.push_back(folder / (std::string("sixpoint-") + area));
  for (const char* name : {"sixpoint-migrate", "sixpoint-watchdog", "sixpoint-cad-worker", "sixpoint-decode-worker"})
    files.push_back(folder / name);
  return files;
}

// What root reads and runs is where the service user cannot put anything else.
absl::Status CheckPrograms(LocalPlant* plant, const ServiceUser& user) {
  for (const fs::path& program : ProgramFiles(plant->binaries))
    if (const auto safe = OutOfReach("programs", program, user); !safe.ok()) return safe.status();
  absl::StatusOr<fs::path> migrations = OutOfReach("--migrations", plant->migrations, user);
  if (!migrations.ok()) return migrations.status();
  plant->migrations = *std::move(migrations);
  int count = 0;
  for (const auto& entry : fs::directory_iterator(plant->migrations)) {
    if (entry.path().extension() != ".sql") continue;
    if (const auto safe = OutOfReach("--migrations", entry.path(), user); !safe.ok()) return safe.status();
    ++count;
  }
  if (count == 0) return runtime::Refuse("--migrations", plant->migrations.string(), "a folder of V0001__*.sql, ...");
  for (const fs::path& folder : {plant->binaries, plant->migrations})
    if (!IsPlainPath(folder.string()))
      return runtime::Refuse("programs", folder.string(), "a path of letters, digits and /._-+@");
  return absl::OkStatus();
}

// A checkout under /root cannot be entered by the service user: then the programs are copied beside the data.
bool ServiceUserReaches(const LocalPlant& plant) {
  const std::string program = (plant.binaries / "sixpoint-migrate").string();
  return RunProgram(AsServiceUser({"test", "-x", program, "-a", "-r", plant.migrations.string()})).exit_code == 0;
}

absl::Status CopyMigrations(LocalPlant* plant) {
  const fs::path copies = plant->data / "migrations";
  fs::remove_all(copies);  // another release's
  if (absl::Status status = CopyFiles(plant->migrations, "V", copies); !status.ok()) return status;
  plant->migrations = copies;
  return CopyFiles(plant->binaries, "sixpoint-migrate", plant->data / "bin");
}

absl::Status CopyPrograms(LocalPlant* plant) {
  const fs::path copies = plant->data / "bin";
  if (absl::Status status = CopyFiles(plant->binaries, "sixpoint-", copies); !status.ok()) return status;
  plant->binaries = copies;
  return absl::OkStatus();
}

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

bool DatabaseAccepts(const LocalPlant& plant) {
  return RunProgram(AsServiceUser({std::string(kPostgresBin) + "pg_isready", "-q", "-h", plant.sockets().string()}))
             .exit_code == 0;
}

absl::Status WaitForDatabase(const LocalPlant& plant) {
  for (int attempt = 0; attempt < 120; ++attempt) {
    if (DatabaseAccepts(plant)) {
      const Finished made =
          RunProgram(AsServiceUser({std::string(kPostgresBin) + "createdb", "-h", plant.sockets().string(), "-U",
                                    "sixpoint", "--maintenance-db", "postgres", "sixpoint"}));
      if (made.exit_code == 0 || made.output.find("already exists") != std::string::npos) return absl::OkStatus();
      if (made.output.find("role \"sixpoint\" does not exist") != std::string::npos)
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

bool Newer(const fs::path& program, const fs::path& than) {
  return !fs::exists(than) || fs::last_write_time(program) > fs::last_write_time(than);
}

// New programs take the place of old ones, and those whose words changed start again; PostgreSQL goes on.
absl::Status StartServices(const LocalPlant& plant, bool all_start) {
  bool programs_changed = false;
  for (const fs::path& program : ProgramFiles(plant.binaries))
    programs_changed = programs_changed || Newer(program, plant.supervisor_config());
  if (absl::Status status = WriteSupervisorConfig(plant, Programs::kAll); !status.ok()) return status;
  Supervisorctl(plant.supervisor_config(), {"update"});
  Supervisorctl(plant.supervisor_config(), {"start", "all"});  // what a person had stopped, or was given up
  if (all_start || !programs_changed) return absl::OkStatus();
  std::vector<std::string> restart = {"restart", "watchdog"};
  restart.insert(restart.end(), kAreas.begin(), kAreas.end());
  Supervisorctl(plant.supervisor_config(), restart);
  return absl::OkStatus();
}

// One that answers and is not ours is another plant's.
std::vector<ServiceState> StatesOf(const LocalPlant& plant, const std::map<std::string, std::string>& programs) {
  // As nobody: the folder has no identity.
  const auto credentials = runtime::ChannelCredentialsOf(plant.certificates());
  std::vector<ServiceState> states;
  for (std::size_t i = 0; i < kAreas.size(); ++i) {
    const std::string area = kAreas[i];
    const auto program = programs.find(area);
    const bool runs = program != programs.end() && program->second == "RUNNING";
    ServiceState state{"NOT_REACHED", ""};
    if (runs && credentials.ok()) state.health = ServiceHealth(plant.OwnAddress(i), *credentials, kHealthPatience);
    if (state.health != "SERVING") state.why = LastWords(plant.logs() / (area + ".log"));
    if (runs && !credentials.ok()) state.why = std::string(credentials.status().message());
    if (state.health == "NOT_TRUSTED" && state.why.empty())
      state.why = "its certificate does not hold, want what `sixpoint certs renew` makes";
    states.push_back(std::move(state));
  }
  return states;
}

absl::Status DoesNotServe(const LocalPlant& plant, std::size_t area, const std::string& why) {
  const std::string name = kAreas[area];
  if (!why.empty()) return absl::FailedPreconditionError(name + " does not serve: " + why);
  return absl::InternalError(name + " does not serve; see " + (plant.logs() / (name + ".log")).string());
}

absl::Status WaitForServices(const LocalPlant& plant, ProgressLine* progress) {
  const auto start = steady_clock::now();
  std::string said;
  auto said_since = start;
  for (;;) {
    const std::vector<ServiceState> states = StatesOf(plant, ProgramStates(plant));
    std::size_t waiting = 0;
    while (waiting < states.size() && states[waiting].health == "SERVING") ++waiting;
    if (waiting == states.size()) return absl::OkStatus();
    progress->Show("starting the services: waiting for " + std::string(kAreas[waiting]));
    if (states[waiting].why != said) {
      said = states[waiting].why;
      said_since = steady_clock::now();
    }
    if (steady_clock::now() > start + kStartPatience ||
        (!said.empty() && steady_clock::now() > said_since + kReasonPatience))
      return DoesNotServe(plant, waiting, said);
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

}  // namespace

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
