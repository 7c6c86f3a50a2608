#include "cli/gateway_health.h"

#include <curl/curl.h>

#include <memory>

#include "identity/credentials.h"

namespace sixpoint::cli {
namespace {

std::size_t Ignore(const char* /*data*/, std::size_t size, std::size_t count, void* /*user*/) { return size * count; }

std::string GatewayHealthOf(CURLcode code, long http_status) {
  switch (code) {
    case CURLE_OK:
      return http_status == 200 ? "SERVING" : "NOT_SERVING";
    case CURLE_OPERATION_TIMEDOUT:
      return "SILENT";
    case CURLE_PEER_FAILED_VERIFICATION:
    case CURLE_SSL_CACERT_BADFILE:
      return "NOT_TRUSTED";
    default:
      return "NOT_REACHED";
  }
}

}  // namespace

std::string GatewayHealth(const std::string& url, const std::filesystem::path& certificates,
                          std::chrono::milliseconds patience) {
  static const CURLcode started = curl_global_init(CURL_GLOBAL_DEFAULT);
  const std::unique_ptr<CURL, decltype(&curl_easy_cleanup)> handle(started == CURLE_OK ? curl_easy_init() : nullptr,
                                                                   &curl_easy_cleanup);
  if (handle == nullptr) return "NOT_REACHED";
  CURL* const curl = handle.get();
  const std::string path = url + "/health/live", authority = (certificates / identity::kAuthorityFile).string();
  curl_easy_setopt(curl, CURLOPT_URL, path.c_str());
  curl_easy_setopt(curl, CURLOPT_PROTOCOLS_STR, "http,https");
  curl_easy_setopt(curl, CURLOPT_PROXY, "");
  curl_easy_setopt(curl, CURLOPT_CAINFO, authority.c_str());
  curl_easy_setopt(curl, CURLOPT_CAPATH, nullptr);
  curl_easy_setopt(curl, CURLOPT_NOSIGNAL, 1L);
  curl_easy_setopt(curl, CURLOPT_TIMEOUT_MS, static_cast<long>(patience.count()));
  curl_easy_setopt(curl, CURLOPT_MAXFILESIZE, 4096L);
  curl_easy_setopt(curl, CURLOPT_WRITEFUNCTION, Ignore);
  const CURLcode code = curl_easy_perform(curl);
  long http_status = 0;
  curl_easy_getinfo(curl, CURLINFO_RESPONSE_CODE, &http_status);
  return GatewayHealthOf(code, http_status);
}

}  // namespace sixpoint::cli
