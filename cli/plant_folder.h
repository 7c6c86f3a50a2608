// A plant's data folder: told from everybody else's before anything in it is changed, and made so that the service user writes
// only below postgres/, run/ and log/. What lies beside those is root's, where root starts the plant.
#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include "cli/plant_settings.h"
#include "cli/service_user.h"

namespace sixpoint::cli {

// Where it really is. Refused where it is a link, another user's, or holds what no `sixpoint up` made; may be missing or empty.
absl::StatusOr<std::filesystem::path> CheckDataFolder(const std::filesystem::path& data, const ServiceUser& user);
// Of a folder that was checked; none where no plant was started in it yet.
absl::StatusOr<std::optional<PlantSettings>> StoredSettings(const std::filesystem::path& data);
absl::Status StoreSettings(const std::filesystem::path& data, const PlantSettings& settings);

// With its folders; those that are there keep what they hold.
absl::Status MakeDataFolder(const std::filesystem::path& data, const ServiceUser& user);
// While one lives nobody else gets one for that folder, which is there: one `sixpoint up` at a time works on it.
class DataFolderLock {
 public:
  // FAILED_PRECONDITION where another has it.
  static absl::StatusOr<DataFolderLock> Take(const std::filesystem::path& data);
  DataFolderLock(DataFolderLock&& other) noexcept : handle_(std::exchange(other.handle_, -1)) {}
  DataFolderLock& operator=(DataFolderLock&&) = delete;
  ~DataFolderLock();

 private:
  explicit DataFolderLock(int handle) : handle_(handle) {}
  int handle_;
};

// Below the data folder, for the service user alone.
absl::Status MakeServiceFolder(const std::filesystem::path& folder, const ServiceUser& user);
// Each file of it, or only those whose names begin so: replaced whole, since what is at work may be replaced but not written to.
absl::Status CopyFiles(const std::filesystem::path& from, const std::string& beginning,
                       const std::filesystem::path& to);

}  // namespace sixpoint::cli
