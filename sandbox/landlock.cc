#include "sandbox/landlock.h"

#include <linux/landlock.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>

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

}  // namespace sixpoint::sandbox
