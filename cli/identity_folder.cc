#include "cli/identity_folder.h"

#include <unistd.h>

#include <vector>

#include "cli/config.h"
#include "cli/local_plant.h"
#include "identity/authority.h"

namespace sixpoint::cli {

namespace fs = std::filesystem;

absl::StatusOr<fs::path> IdentityFolder(const std::string& identity, const std::string& data) {
  std::vector<fs::path> folders = {identity};
  if (identity.empty())
    folders = {LocalIdentityIn(data.empty() ? UsualDataFolder() : fs::path(data)), ConfigFolder() / "identity"};
  std::string looked;
  for (const fs::path& folder : folders) {
    if (access((folder / identity::kIdentityFile).c_str(), R_OK) == 0) return folder;
    looked += (looked.empty() ? "" : " or ") + folder.string();
  }
  return absl::FailedPreconditionError(
      "no certificate to show to the plant, want one that you may read in " + looked +
      " (on the plant's computer: `sixpoint certs issue users/NAME --role engineer --folder DIR`)");
}

}  // namespace sixpoint::cli
