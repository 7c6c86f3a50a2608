// Files that are replaced whole and never read half: what the authority keeps, and what somebody is handed.
#pragma once

#include <absl/status/statusor.h>
#include <sys/stat.h>

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace sixpoint::identity {

class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor();
  Descriptor(Descriptor&& other) noexcept : number_(other.number_) { other.number_ = -1; }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int number() const { return number_; }
  bool open() const { return number_ >= 0; }

 private:
  int number_;
};

// By what a file is known to be another one, or changed.
struct FileMark {
  dev_t device = 0;
  ino_t inode = 0;
  off_t size_bytes = 0;
  timespec modified{}, changed{};
  friend bool operator==(const FileMark& a, const FileMark& b);
};
std::optional<FileMark> MarkOf(const std::filesystem::path& path);  // none where there is no such file

// A regular file of at most that size; links are followed. `mark`: where not null, of what was read; none where the file changed
// meanwhile.
absl::StatusOr<std::string> ReadFile(const std::filesystem::path& path, std::size_t most_bytes,
                                     std::optional<FileMark>* mark = nullptr);

struct Owner {
  uid_t user = 0;
  gid_t group = 0;
};

// A folder that stays the same one whatever becomes of its path. Names are of files right in it; no link is followed.
class Folder {
 public:
  static absl::StatusOr<Folder> Open(const std::filesystem::path& path);
  // Made where it is missing, 0700; so are those above it, as the umask has it.
  static absl::StatusOr<Folder> Make(const std::filesystem::path& path);
  absl::StatusOr<Folder> OpenInside(const std::string& name) const;
  absl::StatusOr<Folder> MakeInside(const std::string& name) const;

  const std::filesystem::path& path() const { return path_; }
  absl::StatusOr<struct stat> Look() const;
  absl::Status MakePrivate() const;  // 0700
  absl::StatusOr<std::vector<std::string>> Names() const;
  absl::StatusOr<bool> Holds(const std::string& name) const;

  absl::StatusOr<std::string> Read(const std::string& name, std::size_t most_bytes, struct stat* found = nullptr) const;
  // Whole or not at all, also where the power fails; once it returns, for good. Its time of change is exact to the nanosecond. `owner`:
  // whose the file is to be; of nothing, whoever writes it.
  absl::Status Write(const std::string& name, std::string_view content, mode_t mode,
                     const std::optional<Owner>& owner = std::nullopt) const;
  // Waits for its turn: UNAVAILABLE after half a minute. Held until the descriptor goes.
  absl::StatusOr<Descriptor> Lock() const;

 private:
  Folder(Descriptor descriptor, std::filesystem::path path)
      : descriptor_(std::move(descriptor)), path_(std::move(path)) {}
  absl::Status Error(const std::string& name) const;

  Descriptor descriptor_;
  std::filesystem::path path_;
};

inline constexpr char kLockFile[] = "lock";
// How the name of a file begins that is being written.
inline constexpr char kUnfinished[] = ".new-";

}  // namespace sixpoint::identity
