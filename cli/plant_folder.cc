#include "cli/plant_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <thread>

#include "cli/document.h"
#include "services/runtime/errors.h"

namespace sixpoint::cli {
namespace {

namespace fs = std::filesystem;

constexpr char kSettingsFile[] = "plant.json";
constexpr off_t kGreatestFile_bytes = 65536;
constexpr char kWantedFolder[] = "an empty folder, or one that `sixpoint up` made";
// A unix socket's path holds 107 bytes; PostgreSQL appends "/.s.PGSQL.5432.lock".
constexpr std::size_t kLongestFolder = 76;

absl::Status RefuseFolder(const fs::path& folder, const std::string& what, const std::string& wanted = kWantedFolder) {
  return runtime::Refuse("--data", folder.string() + " (" + what + ")", wanted);
}

// Never through a link. A folder that is another's stays as it is.
absl::Status MakeFolder(const fs::path& folder, uid_t uid, gid_t gid, mode_t mode) {
  const bool made = mkdir(folder.c_str(), 0700) == 0;
  const int error = errno;
  if (!made && error != EEXIST)
    return RefuseFolder(folder, std::strerror(error), "a folder that " + UserName(geteuid()) + " can write");
  const Descriptor opened(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
  struct stat found {};
  if (opened.number() < 0 || fstat(opened.number(), &found) != 0)
    return RefuseFolder(folder, "not a folder itself", "a folder of the plant's own, and no link");
  if (!made && found.st_uid != uid)
    return RefuseFolder(folder, "of the user " + UserName(found.st_uid), UserName(uid) + "'s");
  if (fchown(opened.number(), uid, gid) == 0 && fchmod(opened.number(), mode) == 0) return absl::OkStatus();
  return absl::PermissionDeniedError(folder.string() + ": cannot be given to " + UserName(uid));
}

absl::Status CheckContent(const fs::path& folder) {
  const auto holds = [&](const char* name) {
    return fs::symlink_status(folder / name).type() != fs::file_type::not_found;
  };
  if (holds(kSettingsFile) || fs::is_empty(folder)) return absl::OkStatus();
  return RefuseFolder(folder, holds("PG_VERSION") ? "a PostgreSQL cluster" : "holds something else");
}

}  // namespace

absl::StatusOr<fs::path> CheckDataFolder(const fs::path& data, const ServiceUser& user) {
  fs::path given = fs::absolute(data).lexically_normal();
  if (!given.has_filename()) given = given.parent_path();
  // The folder itself may not be a link; those above it are followed once, here.
  fs::path above = given.parent_path();
  while (!fs::exists(above)) above = above.parent_path();
  const absl::StatusOr<fs::path> real = OutOfReach("--data", above, user);
  if (!real.ok()) return real.status();
  const fs::path folder = *real / given.lexically_relative(above);
  if (!IsPlainPath(folder.string()) || folder.string().size() > kLongestFolder)
    return runtime::Refuse("--data", folder.string(),
                           "at most 76 letters, digits and /._-+@, which unix sockets and configurations hold");
  struct stat found {};
  if (lstat(folder.c_str(), &found) != 0) {
    if (errno == ENOENT) return folder;
    return RefuseFolder(folder, std::strerror(errno));
  }
  if (S_ISLNK(found.st_mode)) return RefuseFolder(folder, "a symbolic link", "the folder itself");
  if (!S_ISDIR(found.st_mode)) return RefuseFolder(folder, "not a folder");
  if (found.st_uid != geteuid())
    return RefuseFolder(folder, "of the user " + UserName(found.st_uid), "a folder of " + UserName(geteuid()) + "'s");
  if (const auto safe = OutOfReach("--data", folder, user); !safe.ok()) return safe.status();
  if (absl::Status status = CheckContent(folder); !status.ok()) return status;
  return folder;
}

Descriptor::~Descriptor() {
  if (number_ >= 0) close(number_);
}

absl::StatusOr<Descriptor> OpenFileOf(uid_t uid, const fs::path& file) {
  Descriptor opened(open(file.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
  if (opened.number() < 0 && errno == ENOENT) return absl::NotFoundError(file.string() + ": no such file");
  struct stat found {};
  if (opened.number() < 0 || fstat(opened.number(), &found) != 0 || !S_ISREG(found.st_mode) || found.st_uid != uid ||
      found.st_size > kGreatestFile_bytes)
    return absl::InvalidArgumentError(file.string() + ": want a file of " + UserName(uid) +
                                      "'s, no link, of at most 64 KiB");
  return opened;
}

absl::StatusOr<std::string> ReadFileOf(uid_t uid, const fs::path& file) {
  const absl::StatusOr<Descriptor> opened = OpenFileOf(uid, file);
  if (!opened.ok()) return opened.status();
  std::string text(kGreatestFile_bytes, '\0');
  const ssize_t got = read(opened->number(), text.data(), text.size());
  text.resize(got < 0 ? 0 : static_cast<std::size_t>(got));
  return text;
}

absl::StatusOr<std::optional<PlantSettings>> StoredSettings(const fs::path& data) {
  const fs::path file = data / kSettingsFile;
  const absl::StatusOr<std::string> text = ReadFileOf(geteuid(), file);
  if (absl::IsNotFound(text.status())) return std::nullopt;
  if (!text.ok()) return text.status();
  return ParseSettings(file.string(), *text);
}

absl::Status StoreSettings(const fs::path& data, const PlantSettings& settings) {
  return WriteFile((data / kSettingsFile).string(), SettingsText(settings));
}

absl::Status MakeDataFolder(const fs::path& data, const ServiceUser& user) {
  fs::create_directories(data.parent_path());
  // The service user enters and reads; nobody else may, for a socket in it takes everybody for the database's owner.
  if (absl::Status status = MakeFolder(data, geteuid(), user.gid, IsRoot() ? 0750 : 0700); !status.ok()) return status;
  for (const char* name : {"run", "log"})
    if (absl::Status status = MakeServiceFolder(data / name, user); !status.ok()) return status;
  return absl::OkStatus();
}

absl::StatusOr<DataFolderLock> DataFolderLock::Take(const fs::path& folder, std::chrono::seconds patience) {
  Descriptor handle(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (handle.number() < 0) return absl::ErrnoToStatus(errno, folder.string());
  const auto until = std::chrono::steady_clock::now() + patience;
  while (flock(handle.number(), LOCK_EX | LOCK_NB) != 0) {
    if (std::chrono::steady_clock::now() >= until)
      return absl::FailedPreconditionError(folder.string() + ": another `sixpoint` is at work on it, wait for its end");
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return DataFolderLock(std::move(handle));
}

absl::Status MakeOwnFolder(const fs::path& folder, mode_t mode) {
  return MakeFolder(folder, geteuid(), getegid(), mode);
}

absl::Status MakeServiceFolder(const fs::path& folder, const ServiceUser& user) {
  return MakeFolder(folder, user.uid, user.gid, 0700);
}

absl::Status CopyFiles(const fs::path& from, const std::string& beginning, const fs::path& to) {
  if (absl::Status status = MakeOwnFolder(to, 0755); !status.ok()) return status;
  for (const auto& entry : fs::directory_iterator(from)) {
    const std::string name = entry.path().filename().string();
    if (name.rfind(beginning, 0) != 0 || !entry.is_regular_file()) continue;
    const fs::path copy = to / name, beside = to / (name + ".part");
    if (fs::exists(copy) && fs::file_size(copy) == entry.file_size() &&
        fs::last_write_time(copy) >= entry.last_write_time())
      continue;
    fs::copy_file(entry.path(), beside, fs::copy_options::overwrite_existing);
    fs::rename(beside, copy);
  }
  return absl::OkStatus();
}

absl::Status CopyFolder(const fs::path& from, const fs::path& to) {
  if (absl::Status status = CopyFiles(from, "", to); !status.ok()) return status;
  for (const auto& entry : fs::directory_iterator(from))
    if (entry.is_directory() && !entry.is_symlink())
      if (absl::Status status = CopyFolder(entry.path(), to / entry.path().filename()); !status.ok()) return status;
  return absl::OkStatus();
}

}  // namespace sixpoint::cli
