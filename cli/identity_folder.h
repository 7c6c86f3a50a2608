// Whose certificate a command shows to the plant.
#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <string>

namespace sixpoint::cli {

// The folder of credentials: `identity` where it is not empty (--identity); else the one that `sixpoint up` made in `data` (empty: the
// usual folder), where this user may read it; else the user's own, ~/.config/sixpoint/identity. FAILED_PRECONDITION says where it
// looked.
absl::StatusOr<std::filesystem::path> IdentityFolder(const std::string& identity, const std::string& data);

}  // namespace sixpoint::cli
