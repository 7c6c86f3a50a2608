#include "services/plant/key_set_fetch.h"

#include <curl/curl.h>

#include "services/runtime/outward_call.h"

namespace sixpoint::plant {
namespace {

struct Body {
  std::string bytes;
  std::size_t most_bytes = 0;
};

std::size_t Collect(const char* data, std::size_t size, std::size_t count, void* user) {
  auto* const body = static_cast<Body*>(user);
  if (body->bytes.size() + size * count > body->most_bytes) return 0;  // ends the transfer
  body->bytes.append(data, size * count);
  return size * count;
}

}  // namespace

absl::StatusOr<std::string> FetchByHttps(const std::string& url, const std::string& ca_file, std::size_t most_bytes,
                                         std::chrono::milliseconds patience) {
  const runtime::OutwardCall handle = runtime::NewOutwardCall(url, "https", ca_file, patience);
  if (handle == nullptr) return absl::UnavailableError("keys: curl does not start");
  CURL* const curl = handle.get();
  Body body;
  body.most_bytes = most_bytes;
  curl_easy_setopt(curl, CURLOPT_MAXFILESIZE, static_cast<long>(most_bytes));
  curl_easy_setopt(curl, CURLOPT_WRITEFUNCTION, Collect);
  curl_easy_setopt(curl, CURLOPT_WRITEDATA, &body);
  const CURLcode code = curl_easy_perform(curl);
  if (code != CURLE_OK) return absl::UnavailableError("keys: " + url + ": " + curl_easy_strerror(code));
  long http_status = 0;
  curl_easy_getinfo(curl, CURLINFO_RESPONSE_CODE, &http_status);
  if (http_status != 200)
    return absl::UnavailableError("keys: " + url + ": HTTP " + std::to_string(http_status) + ", want 200");
  return std::move(body.bytes);
}

}  // namespace sixpoint::plant
