#include "sandbox/landlock.h"

#include <fcntl.h>
#include <linux/landlock.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <set>

namespace sixpoint::sandbox {
namespace {

// As the newest kernels have it; Debian 12's header ends after the first field. Older kernels take it with zeros there.
struct RulesetAttributes {
  std::uint64_t handled_access_fs;
  std::uint64_t handled_access_net;
  std::uint64_t scoped;
};

// Every right that a version knows. What is handled and granted by no rule is denied.
RulesetAttributes Everything(int version) {
  const int file_right_count = version >= 5 ? 16 : version >= 3 ? 15 : version == 2 ? 14 : 13;
  RulesetAttributes all{};
  all.handled_access_fs = (std::uint64_t{1} << file_right_count) - 1;
  if (version >= 4) all.handled_access_net = 3;  // bind, connect
  if (version >= 6) all.scoped = 3;              // abstract sockets, signals
  return all;
}

constexpr std::uint64_t kReading =
    LANDLOCK_ACCESS_FS_EXECUTE | LANDLOCK_ACCESS_FS_READ_FILE | LANDLOCK_ACCESS_FS_READ_DIR;
// Of a file: the rest are of folders.
constexpr std::uint64_t kReadingFiles = LANDLOCK_ACCESS_FS_EXECUTE | LANDLOCK_ACCESS_FS_READ_FILE;

// In all that is under the descriptor, which is closed.
bool Grant(int ruleset, int opened, std::uint64_t rights) {
  landlock_path_beneath_attr rule{};
  rule.allowed_access = rights;
  rule.parent_fd = opened;
  const bool added = syscall(SYS_landlock_add_rule, ruleset, LANDLOCK_RULE_PATH_BENEATH, &rule, 0) == 0;
  const int error = errno;
  close(opened);
  errno = error;
  return added;
}

bool IsAbove(const std::filesystem::path& folder, const std::filesystem::path& path) {
  auto own = folder.begin(), its = path.begin();
  for (; own != folder.end() && its != path.end() && *own == *its; ++own, ++its) continue;
  return own == folder.end() || own->empty();
}

// Lets be read what is in the folder and is not, and does not hold, one of the hidden ones. What cannot be opened is nobody's to read.
bool GrantReadingAllBut(const std::vector<std::filesystem::path>& hidden, const std::filesystem::path& folder,
                        int ruleset) {
  std::error_code unreadable;
  std::filesystem::directory_iterator entry(folder, unreadable), end;
  for (; !unreadable && entry != end; entry.increment(unreadable)) {
    const std::filesystem::path& path = entry->path();
    bool is_hidden = false, holds_hidden = false;
    for (const std::filesystem::path& one : hidden) {
      is_hidden = is_hidden || path == one;
      holds_hidden = holds_hidden || IsAbove(path, one);
    }
    if (is_hidden || std::filesystem::is_symlink(path)) continue;
    if (holds_hidden) {
      if (!GrantReadingAllBut(hidden, path, ruleset)) return false;
      continue;
    }
    const int opened = open(path.c_str(), O_PATH | O_CLOEXEC | O_NOFOLLOW);
    if (opened < 0) continue;
    struct stat found {};
    if (fstat(opened, &found) != 0 || S_ISLNK(found.st_mode))
      close(opened);
    else if (!Grant(ruleset, opened, S_ISDIR(found.st_mode) ? kReading : kReadingFiles))
      return false;
  }
  return true;
}

bool GrantAll(const std::vector<std::filesystem::path>& folders, std::uint64_t rights, int ruleset) {
  for (const std::filesystem::path& folder : folders) {
    const int opened = open(folder.c_str(), O_PATH | O_CLOEXEC | O_DIRECTORY);
    if (opened < 0 || !Grant(ruleset, opened, rights)) return false;
  }
  return true;
}

}  // namespace

int LandlockVersion() {
  const long version = syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION);
  return version > 0 ? static_cast<int>(version) : 0;
}

bool GiveUpFiles() {
  const int version = LandlockVersion();
  if (version == 0) return true;
  const RulesetAttributes attributes = Everything(version);
  const auto ruleset = static_cast<int>(syscall(SYS_landlock_create_ruleset, &attributes, sizeof attributes, 0));
  if (ruleset < 0) return false;
  const bool restricted = syscall(SYS_landlock_restrict_self, ruleset, 0) == 0;
  const int error = errno;
  close(ruleset);
  errno = error;
  return restricted;
}

bool GiveUpFolders(const std::vector<std::filesystem::path>& hidden,
                   const std::vector<std::filesystem::path>& writable) {
  const int version = LandlockVersion();
  if (version == 0) return true;
  RulesetAttributes attributes{};
  attributes.handled_access_fs = Everything(version).handled_access_fs;
  std::vector<std::filesystem::path> real;
  std::error_code odd;
  for (const std::filesystem::path& folder : hidden) real.push_back(std::filesystem::weakly_canonical(folder, odd));
  const auto ruleset = static_cast<int>(syscall(SYS_landlock_create_ruleset, &attributes, sizeof attributes, 0));
  if (ruleset < 0 || odd) return false;
  const bool restricted =
      GrantReadingAllBut(real, "/", ruleset) && GrantAll(writable, attributes.handled_access_fs, ruleset) &&
      prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 && syscall(SYS_landlock_restrict_self, ruleset, 0) == 0;
  const int error = errno;
  close(ruleset);
  errno = error;
  return restricted;
}

}  // namespace sixpoint::sandbox
