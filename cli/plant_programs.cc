#include "cli/plant_programs.h"

#include <algorithm>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "cli/plant_folder.h"
#include "cli/subprocess.h"
#include "services/runtime/errors.h"

namespace sixpoint::cli {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> ProgramFiles(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const char* area : kAreas) files.push_back(folder / (std::string("sixpoint-") + area));
  for (const char* name :
       {"sixpoint-gateway", "sixpoint-migrate", "sixpoint-watchdog", "sixpoint-cad-worker", "sixpoint-decode-worker"})
    files.push_back(folder / name);
  return files;
}

bool Newer(const fs::path& program, const fs::path& than) {
  return !fs::exists(than) || fs::last_write_time(program) > fs::last_write_time(than);
}

}  // namespace

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
  if (!plant->web.empty()) {
    absl::StatusOr<fs::path> web = OutOfReach("--web", plant->web, user);
    if (!web.ok()) return web.status();
    plant->web = *std::move(web);
    if (!fs::is_regular_file(plant->web / "index.html"))
      return runtime::Refuse("--web", plant->web.string(), "a folder with index.html");
    for (const auto& entry : fs::recursive_directory_iterator(plant->web))
      if (const auto safe = OutOfReach("--web", entry.path(), user); !safe.ok()) return safe.status();
  }
  // As the supervisor's configuration holds them.
  using Named = std::pair<const char*, const fs::path&>;
  for (const auto& [field, folder] :
       {Named("programs", plant->binaries), Named("--migrations", plant->migrations), Named("--web", plant->web)})
    if (!folder.empty() && !IsPlainPath(folder.string()))
      return runtime::Refuse(field, folder.string(), "a path of letters, digits and /._-+@");
  return absl::OkStatus();
}

bool ServiceUserReaches(const LocalPlant& plant) {
  const std::string program = (plant.binaries / "sixpoint-migrate").string();
  const std::string page = plant.web.empty() ? program : (plant.web / "index.html").string();
  return RunProgram(AsServiceUser({"test", "-x", program, "-a", "-r", plant.migrations.string(), "-a", "-r", page}))
             .exit_code == 0;
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
  if (plant->web.empty()) return absl::OkStatus();
  const fs::path page = plant->data / "web";
  fs::remove_all(page);  // another release's
  if (absl::Status status = CopyFolder(plant->web, page); !status.ok()) return status;
  plant->web = page;
  return absl::OkStatus();
}

bool AreProgramsNewer(const LocalPlant& plant, const fs::path& than) {
  std::vector<fs::path> files = ProgramFiles(plant.binaries);
  if (!plant.web.empty()) files.push_back(plant.web / "index.html");
  return std::any_of(files.begin(), files.end(), [&](const fs::path& file) { return Newer(file, than); });
}

}  // namespace sixpoint::cli
