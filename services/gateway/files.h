// The page's files, read and compressed once, at the start: what a build of web/ left (ADR 49).
#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "services/gateway/exchange.h"

namespace sixpoint::gateway {

class Files {
 public:
  // INVALID_ARGUMENT of a folder without index.html, UNAVAILABLE of one that cannot be read. Links are not followed; at most 64 MiB.
  static absl::StatusOr<Files> Read(const std::filesystem::path& folder);

  // Of none there is no page. One more file, by its path.
  Files() = default;
  void Add(const std::string& path, std::string bytes);

  // GET and HEAD of a file, or of the page itself where the path names no file: the page knows its own paths. None: there is no such file.
  std::optional<HttpResponse> Answer(const Exchange::Head& head, const std::string& path) const;

 private:
  struct File {
    std::string bytes, gzip;  // gzip empty: not kept so
    std::string type, etag;
    bool is_immutable = false;
  };
  std::map<std::string, File> files_;  // by path, "/assets/main-1234.js"
};

}  // namespace sixpoint::gateway
