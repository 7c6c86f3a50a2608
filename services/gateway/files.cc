#include "services/gateway/files.h"

#include <zlib.h>

#include <fstream>
#include <iterator>

#include "services/runtime/errors.h"

namespace sixpoint::gateway {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMost_bytes = 64 << 20;
constexpr char kPage[] = "/index.html", kImmutable[] = "/assets/";

std::string TypeOf(const std::string& extension) {
  static const auto* const kTypes =
      new std::map<std::string, std::string>{{".html", "text/html; charset=utf-8"},
                                             {".js", "text/javascript; charset=utf-8"},
                                             {".css", "text/css; charset=utf-8"},
                                             {".json", "application/json"},
                                             {".wasm", "application/wasm"},
                                             {".svg", "image/svg+xml"},
                                             {".png", "image/png"},
                                             {".ico", "image/x-icon"},
                                             {".txt", "text/plain; charset=utf-8"},
                                             {".webmanifest", "application/manifest+json"}};
  const auto found = kTypes->find(extension);
  return found == kTypes->end() ? "application/octet-stream" : found->second;
}

// Empty where it gains nothing.
std::string GzipOf(const std::string& bytes) {
  constexpr int kGzip = 15 + 16;  // the greatest window, with gzip's own head
  z_stream stream{};
  if (deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, kGzip, 9, Z_DEFAULT_STRATEGY) != Z_OK) return "";
  std::string gzip(deflateBound(&stream, bytes.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(gzip.data());
  stream.avail_out = static_cast<uInt>(gzip.size());
  const bool is_done = deflate(&stream, Z_FINISH) == Z_STREAM_END;
  gzip.resize(stream.total_out);
  deflateEnd(&stream);
  return is_done && gzip.size() < bytes.size() ? gzip : "";
}

bool Accepts(const std::string& header, const std::string& what) { return header.find(what) != std::string::npos; }

}  // namespace

absl::StatusOr<Files> Files::Read(const fs::path& folder) {
  Files files;
  std::size_t total_bytes = 0;
  std::error_code error;
  for (fs::recursive_directory_iterator each(folder, error), end; !error && each != end; each.increment(error)) {
    if (each->is_symlink() || !each->is_regular_file()) continue;
    std::ifstream stream(each->path(), std::ios::binary);
    std::string bytes{std::istreambuf_iterator<char>(stream), {}};
    if (!stream) return absl::UnavailableError("web: " + each->path().string() + " cannot be read");
    total_bytes += bytes.size();
    if (total_bytes > kMost_bytes) return runtime::Refuse("web", folder.string() + " (over 64 MiB)", "a built page");
    const std::string path = "/" + each->path().lexically_relative(folder).generic_string();
    files.Add(path, std::move(bytes));
  }
  if (error) return absl::UnavailableError("web: " + folder.string() + ": " + error.message());
  if (files.files_.count(kPage) == 0) return runtime::Refuse("web", folder.string(), "a folder with index.html");
  return files;
}

void Files::Add(const std::string& path, std::string bytes) {
  File file{std::move(bytes), "", TypeOf(fs::path(path).extension().string()), "", path.rfind(kImmutable, 0) == 0};
  file.etag = EtagOf(file.bytes);
  file.gzip = GzipOf(file.bytes);
  files_[path] = std::move(file);
}

std::optional<HttpResponse> Files::Answer(const Exchange::Head& head, const std::string& path) const {
  auto found = files_.find(path == "/" ? kPage : path);
  // /blades/SN-1 is the page's own; a file that is missing is missing.
  if (found == files_.end() && path.find('.', path.rfind('/')) == std::string::npos &&
      Accepts(HeaderOf(head, "Accept"), "text/html"))
    found = files_.find(kPage);
  if (found == files_.end()) return std::nullopt;
  const File& file = found->second;
  const bool as_gzip = !file.gzip.empty() && Accepts(HeaderOf(head, "Accept-Encoding"), "gzip");
  HttpResponse response;
  response.headers = {{"Content-Type", file.type},
                      {"Cache-Control", file.is_immutable ? "public, max-age=31536000, immutable" : "no-cache"},
                      {"ETag", file.etag},
                      {"Vary", "Accept-Encoding"}};
  if (HeaderOf(head, "If-None-Match") == file.etag) {
    response.status = 304;
    return response;
  }
  if (as_gzip) response.headers.emplace_back("Content-Encoding", "gzip");
  response.body = as_gzip ? file.gzip : file.bytes;
  return response;
}

}  // namespace sixpoint::gateway
