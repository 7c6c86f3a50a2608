#include "identity/files.h"

#include <dirent.h>
#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <ctime>
#include <memory>
#include <random>
#include <thread>
#include <utility>

#include "refusal/refusal.h"

namespace sixpoint::identity {
namespace {

namespace fs = std::filesystem;

constexpr auto kLongestWait = std::chrono::seconds(30);
constexpr auto kBetweenTries = std::chrono::milliseconds(5);

absl::Status ErrnoStatus(const fs::path& path) { return absl::ErrnoToStatus(errno, path.string()); }

bool Same(const timespec& a, const timespec& b) { return a.tv_sec == b.tv_sec && a.tv_nsec == b.tv_nsec; }

FileMark MarkOf(const struct stat& found) {
  return {found.st_dev, found.st_ino, found.st_size, found.st_mtim, found.st_ctim};
}

absl::StatusOr<std::string> ReadWhole(const Descriptor& file, const fs::path& path, std::size_t most_bytes,
                                      struct stat* found) {
  if (!file.open() || fstat(file.number(), found) != 0) return ErrnoStatus(path);
  if (!S_ISREG(found->st_mode)) return Refuse(path.string(), "no regular file", "one");
  std::string content;
  char piece[16384];
  while (content.size() <= most_bytes) {
    const ssize_t got = read(file.number(), piece, sizeof piece);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return ErrnoStatus(path);
    if (got == 0) return content;
    content.append(piece, static_cast<std::size_t>(got));
  }
  return Refuse(path.string(), "longer", "at most " + std::to_string(most_bytes) + " bytes");
}

bool WriteWhole(int file, std::string_view content) {
  while (!content.empty()) {
    const ssize_t written = write(file, content.data(), content.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    content.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

// The umask may have taken from the mode. The kernel's own times go in steps of milliseconds, within which one file after
// another would look unchanged, or be of no order.
bool Finish(int file, std::string_view content, mode_t mode, const std::optional<Owner>& owner) {
  timespec times[2] = {};
  if (owner && fchown(file, owner->user, owner->group) != 0) return false;
  if (fchmod(file, mode) != 0 || !WriteWhole(file, content)) return false;
  if (clock_gettime(CLOCK_REALTIME, &times[0]) != 0) return false;
  times[1] = times[0];
  return futimens(file, times) == 0 && fsync(file) == 0;
}

std::string UnfinishedName() {
  std::random_device random;
  return kUnfinished + std::to_string(std::uint64_t{random()} << 32 | random());
}

}  // namespace

Descriptor::~Descriptor() {
  if (number_ >= 0) close(number_);
}

bool operator==(const FileMark& a, const FileMark& b) {
  return a.device == b.device && a.inode == b.inode && a.size_bytes == b.size_bytes && Same(a.modified, b.modified) &&
         Same(a.changed, b.changed);
}

std::optional<FileMark> MarkOf(const fs::path& path) {
  struct stat found {};
  if (stat(path.c_str(), &found) != 0) return std::nullopt;
  return MarkOf(found);
}

absl::StatusOr<std::string> ReadFile(const fs::path& path, std::size_t most_bytes, std::optional<FileMark>* mark) {
  // A pipe of that name would hold up whoever opens it.
  const Descriptor file(open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC));
  struct stat before {
  }, after{};
  absl::StatusOr<std::string> content = ReadWhole(file, path, most_bytes, &before);
  if (mark == nullptr) return content;
  mark->reset();
  // An error of the moment leaves none, so that it is tried again; so does a file that changed while it was read.
  const bool decided = content.ok() || !ViolationsOf(content.status()).empty();
  if (decided && fstat(file.number(), &after) == 0 && MarkOf(before) == MarkOf(after)) *mark = MarkOf(before);
  return content;
}

absl::StatusOr<Folder> Folder::Open(const fs::path& path) {
  Descriptor folder(open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!folder.open()) return ErrnoStatus(path);
  return Folder(std::move(folder), path);
}

absl::StatusOr<Folder> Folder::Make(const fs::path& given) {
  fs::path path = given;
  if (!path.has_filename()) path = path.parent_path();
  const fs::path above = path.has_parent_path() ? path.parent_path() : fs::path(".");
  std::error_code error;
  fs::create_directories(above, error);
  if (error) return absl::ErrnoToStatus(error.value(), above.string());
  if (mkdir(path.c_str(), 0700) != 0) return errno == EEXIST ? Open(path) : ErrnoStatus(path);
  const absl::StatusOr<Folder> opened = Open(above);
  if (!opened.ok()) return opened.status();
  if (fsync(opened->descriptor_.number()) != 0) return ErrnoStatus(above);
  return Open(path);
}

absl::StatusOr<Folder> Folder::OpenInside(const std::string& name) const {
  Descriptor folder(openat(descriptor_.number(), name.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
  if (!folder.open()) return Error(name);
  return Folder(std::move(folder), path_ / name);
}

absl::StatusOr<Folder> Folder::MakeInside(const std::string& name) const {
  if (mkdirat(descriptor_.number(), name.c_str(), 0700) != 0 && errno != EEXIST) return Error(name);
  if (fsync(descriptor_.number()) != 0) return Error("");
  return OpenInside(name);
}

absl::Status Folder::Error(const std::string& name) const { return ErrnoStatus(name.empty() ? path_ : path_ / name); }

absl::StatusOr<struct stat> Folder::Look() const {
  struct stat found {};
  if (fstat(descriptor_.number(), &found) != 0) return Error("");
  return found;
}

absl::Status Folder::MakePrivate() const {
  return fchmod(descriptor_.number(), 0700) == 0 ? absl::OkStatus() : Error("");
}

absl::StatusOr<std::vector<std::string>> Folder::Names() const {
  const int number = openat(descriptor_.number(), ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  const std::unique_ptr<DIR, int (*)(DIR*)> entries(number < 0 ? nullptr : fdopendir(number), closedir);
  if (entries == nullptr) {
    const absl::Status error = Error("");
    if (number >= 0) close(number);
    return error;
  }
  std::vector<std::string> names;
  errno = 0;
  while (const dirent* entry = readdir(entries.get())) {
    const std::string name = entry->d_name;
    if (name != "." && name != "..") names.push_back(name);
    errno = 0;
  }
  if (errno != 0) return Error("");
  return names;
}

absl::StatusOr<bool> Folder::Holds(const std::string& name) const {
  struct stat found {};
  if (fstatat(descriptor_.number(), name.c_str(), &found, AT_SYMLINK_NOFOLLOW) == 0) return true;
  if (errno == ENOENT) return false;
  return Error(name);
}

absl::StatusOr<std::string> Folder::Read(const std::string& name, std::size_t most_bytes, struct stat* found) const {
  struct stat unasked {};
  const Descriptor file(openat(descriptor_.number(), name.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
  return ReadWhole(file, path_ / name, most_bytes, found == nullptr ? &unasked : found);
}

absl::Status Folder::Write(const std::string& name, std::string_view content, mode_t mode,
                           const std::optional<Owner>& owner) const {
  const int folder = descriptor_.number();
  const std::string unfinished = UnfinishedName();
  const Descriptor file(openat(folder, unfinished.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, mode));
  if (!file.open()) return Error(unfinished);
  if (!Finish(file.number(), content, mode, owner) || renameat(folder, unfinished.c_str(), folder, name.c_str()) != 0) {
    const absl::Status error = Error(name);
    unlinkat(folder, unfinished.c_str(), 0);
    return error;
  }
  return fsync(folder) == 0 ? absl::OkStatus() : Error("");
}

absl::StatusOr<Descriptor> Folder::Lock() const {
  Descriptor lock(openat(descriptor_.number(), kLockFile, O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0600));
  if (!lock.open()) return Error(kLockFile);
  const auto until = std::chrono::steady_clock::now() + kLongestWait;
  while (flock(lock.number(), LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK && errno != EINTR) return Error(kLockFile);
    if (std::chrono::steady_clock::now() > until)
      return absl::UnavailableError(path_.string() + ": another program is at work on it, wait for its end");
    std::this_thread::sleep_for(kBetweenTries);
  }
  return lock;
}

}  // namespace sixpoint::identity
