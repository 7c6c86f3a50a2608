#include "tests/support/https_get.h"

#include <curl/curl.h>

#include <memory>

#include "identity/credentials.h"

namespace sixpoint::testing {
namespace {

std::size_t Append(char* bytes, std::size_t size, std::size_t count, void* text) {
  static_cast<std::string*>(text)->append(bytes, size * count);
  return size * count;
}

std::string SerialOf(CURL* curl) {
  curl_certinfo* chain = nullptr;
  if (curl_easy_getinfo(curl, CURLINFO_CERTINFO, &chain) != CURLE_OK || chain == nullptr) return "";
  for (int i = 0; i < chain->num_of_certs; ++i)
    for (const curl_slist* line = chain->certinfo[i]; line != nullptr; line = line->next)
      if (const std::string text = line->data; text.rfind("Serial Number:", 0) == 0) return text;
  return "";
}

}  // namespace

HttpsAnswer HttpsGet(const std::string& url, const std::filesystem::path& credentials, double seconds) {
  const std::unique_ptr<CURL, decltype(&curl_easy_cleanup)> curl(curl_easy_init(), &curl_easy_cleanup);
  const std::string authority = (credentials / identity::kAuthorityFile).string(),
                    own = (credentials / identity::kIdentityFile).string();
  HttpsAnswer answer;
  curl_easy_setopt(curl.get(), CURLOPT_URL, url.c_str());
  curl_easy_setopt(curl.get(), CURLOPT_PROXY, "");
  curl_easy_setopt(curl.get(), CURLOPT_NOSIGNAL, 1L);
  curl_easy_setopt(curl.get(), CURLOPT_TIMEOUT_MS, static_cast<long>(1e3 * seconds));
  curl_easy_setopt(curl.get(), CURLOPT_CAINFO, authority.c_str());
  curl_easy_setopt(curl.get(), CURLOPT_CERTINFO, 1L);
  if (std::filesystem::exists(own)) {
    curl_easy_setopt(curl.get(), CURLOPT_SSLCERT, own.c_str());
    curl_easy_setopt(curl.get(), CURLOPT_SSLKEY, own.c_str());
  }
  curl_easy_setopt(curl.get(), CURLOPT_WRITEFUNCTION, Append);
  curl_easy_setopt(curl.get(), CURLOPT_WRITEDATA, &answer.body);
  const CURLcode done = curl_easy_perform(curl.get());
  if (done != CURLE_OK) {
    answer.error = curl_easy_strerror(done);
    return answer;
  }
  curl_easy_getinfo(curl.get(), CURLINFO_RESPONSE_CODE, &answer.code);
  answer.serial = SerialOf(curl.get());
  return answer;
}

}  // namespace sixpoint::testing
