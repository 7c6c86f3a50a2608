#include "cli/service_user.h"

#include <grp.h>
#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>

#include "cli/subprocess.h"
#include "services/runtime/errors.h"

namespace sixpoint::cli {
namespace {

namespace fs = std::filesystem;

constexpr char kServiceUser[] = "sixpoint";

bool MayWrite(const ServiceUser& user, const struct stat& found, bool through) {
  if (found.st_uid == user.uid) return true;  // an owner may give himself what the mode denies
  // In a sticky folder nobody replaces what is another's.
  const bool replaces = !through || (found.st_mode & S_ISVTX) == 0;
  const bool in_group = std::find(user.groups.begin(), user.groups.end(), found.st_gid) != user.groups.end();
  return replaces && ((found.st_mode & S_IWOTH) != 0 || (in_group && (found.st_mode & S_IWGRP) != 0));
}

}  // namespace

bool IsRoot() { return geteuid() == 0; }

std::string UserName(uid_t uid) {
  const passwd* entry = getpwuid(uid);
  return entry == nullptr ? "uid-" + std::to_string(uid) : entry->pw_name;
}

ServiceUser FindServiceUser() {
  if (!IsRoot()) return {geteuid(), getegid(), {}};
  const passwd* entry = getpwnam(kServiceUser);
  if (entry == nullptr) return {};
  ServiceUser user{entry->pw_uid, entry->pw_gid, {}};
  int count = 0;
  getgrouplist(kServiceUser, user.gid, nullptr, &count);
  user.groups.resize(static_cast<std::size_t>(count));
  getgrouplist(kServiceUser, user.gid, user.groups.data(), &count);
  return user;
}

absl::StatusOr<ServiceUser> EnsureServiceUser() {
  if (IsRoot() && getpwnam(kServiceUser) == nullptr) {
    const Finished made = RunProgram({"useradd", "--system", "--user-group", "--home-dir", "/nonexistent", "--shell",
                                      "/usr/sbin/nologin", kServiceUser});
    if (made.exit_code != 0) return absl::InternalError("cannot add the system user sixpoint: " + made.output);
  }
  const ServiceUser user = FindServiceUser();
  if (IsRoot() && user.uid == 0) return runtime::Refuse("user sixpoint", "root", "a system user without rights");
  return user;
}

std::vector<std::string> AsServiceUser(std::vector<std::string> command) {
  if (!IsRoot()) return command;
  const std::string user = kServiceUser;
  const std::vector<std::string> wrapped = {"setpriv", "--reuid=" + user, "--regid=" + user, "--init-groups", "--"};
  command.insert(command.begin(), wrapped.begin(), wrapped.end());
  return command;
}

absl::StatusOr<fs::path> OutOfReach(const std::string& field, const fs::path& path, const ServiceUser& user) {
  std::error_code missing;
  const fs::path real = fs::canonical(path, missing);
  if (missing) return runtime::Refuse(field, path.string(), "one that is there: " + missing.message());
  if (!IsRoot()) return real;
  for (fs::path at = real;; at = at.parent_path()) {
    struct stat found {};
    if (lstat(at.c_str(), &found) != 0 || MayWrite(user, found, /*through=*/at != real))
      return absl::PermissionDeniedError(field + ": " + at.string() +
                                         ", want what the user sixpoint cannot write, since root relies on it");
    if (at == at.root_path()) return real;
  }
}

}  // namespace sixpoint::cli
