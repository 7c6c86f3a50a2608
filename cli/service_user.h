// Whom a plant's processes run as. PostgreSQL refuses root, and no service needs it: as root, everything runs as the system user
// `sixpoint`, which may write into its own folders and nowhere else. So root reads, executes and changes nothing that this user
// could have put there.
#pragma once

#include <absl/status/statusor.h>
#include <sys/types.h>

#include <filesystem>
#include <string>
#include <vector>

namespace sixpoint::cli {

bool IsRoot();
// The login, or "uid-1000" where there is none.
std::string UserName(uid_t uid);

struct ServiceUser {
  uid_t uid = static_cast<uid_t>(-1);  // nobody's: there is no such user yet
  gid_t gid = static_cast<gid_t>(-1);
  std::vector<gid_t> groups;
};
// Whoever is not root is it himself.
ServiceUser FindServiceUser();
// Made where it is missing.
absl::StatusOr<ServiceUser> EnsureServiceUser();
std::vector<std::string> AsServiceUser(std::vector<std::string> command);

// Where the path really is. As root, PERMISSION_DENIED where the service user could write there, or put another thing in its
// place. `field` is what the refusal names.
absl::StatusOr<std::filesystem::path> OutOfReach(const std::string& field, const std::filesystem::path& path,
                                                 const ServiceUser& user);

}  // namespace sixpoint::cli
