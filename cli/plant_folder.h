// A plant's data folder: told from everybody else's before anything in it is changed, and made so that the service user writes
// only below postgres/, run/, log/ and certificates/AREA/. What lies beside those is root's, where root starts the plant.
#pragma once

#include <absl/status/statusor.h>

#include <chrono>
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
// Closed at its end.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&&) = delete;
  ~Descriptor();
  int number() const { return number_; }

 private:
  int number_;
};

// A regular file of that user's, itself and no link, of at most 64 KiB: what root may read in a folder of another's. NOT_FOUND where
// there is none.
absl::StatusOr<Descriptor> OpenFileOf(uid_t uid, const std::filesystem::path& file);
absl::StatusOr<std::string> ReadFileOf(uid_t uid, const std::filesystem::path& file);

// While one lives nobody else gets one for that folder, which is there: one `sixpoint up` at a time works on it.
class DataFolderLock {
 public:
  // FAILED_PRECONDITION where another has it for longer than that.
  static absl::StatusOr<DataFolderLock> Take(const std::filesystem::path& folder, std::chrono::seconds patience = {});

 private:
  explicit DataFolderLock(Descriptor handle) : handle_(std::move(handle)) {}
  Descriptor handle_;
};

// Below the data folder, of whoever runs this.
absl::Status MakeOwnFolder(const std::filesystem::path& folder, mode_t mode);
// Below the data folder, for the service user alone.
absl::Status MakeServiceFolder(const std::filesystem::path& folder, const ServiceUser& user);
// Each file of it, or only those whose names begin so: replaced whole, since what is at work may be replaced but not written to.
absl::Status CopyFiles(const std::filesystem::path& from, const std::string& beginning,
                       const std::filesystem::path& to);
// All of its files, in a folder that is not there yet or empty; links to folders are not followed.
absl::Status CopyFolder(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace sixpoint::cli
