#include "services/runtime/outward_call.h"

#include <curl/curl.h>

namespace sixpoint::runtime {

void FreeCurl::operator()(void* call) const { curl_easy_cleanup(call); }
void FreeCurl::operator()(curl_slist* list) const { curl_slist_free_all(list); }

OutwardCall NewOutwardCall(const std::string& url, const char* protocols, const std::string& ca_file,
                           std::chrono::milliseconds patience) {
  static const CURLcode started = curl_global_init(CURL_GLOBAL_DEFAULT);
  OutwardCall call(started == CURLE_OK ? curl_easy_init() : nullptr);
  if (call == nullptr) return call;
  CURL* const curl = call.get();
  curl_easy_setopt(curl, CURLOPT_URL, url.c_str());
  curl_easy_setopt(curl, CURLOPT_PROTOCOLS_STR, protocols);
  curl_easy_setopt(curl, CURLOPT_FOLLOWLOCATION, 0L);
  curl_easy_setopt(curl, CURLOPT_PROXY, "");
  curl_easy_setopt(curl, CURLOPT_SSL_VERIFYPEER, 1L);
  curl_easy_setopt(curl, CURLOPT_SSL_VERIFYHOST, 2L);
  curl_easy_setopt(curl, CURLOPT_SSLVERSION, static_cast<long>(CURL_SSLVERSION_TLSv1_2));
  if (!ca_file.empty()) {
    curl_easy_setopt(curl, CURLOPT_CAINFO, ca_file.c_str());
    curl_easy_setopt(curl, CURLOPT_CAPATH, nullptr);
  }
  curl_easy_setopt(curl, CURLOPT_NOSIGNAL, 1L);
#if LIBCURL_VERSION_NUM >= 0x075700
  // A look-up of a name that does not end is left to itself: waited for, it would outlast every patience.
  curl_easy_setopt(curl, CURLOPT_QUICK_EXIT, 1L);
#endif
  curl_easy_setopt(curl, CURLOPT_TIMEOUT_MS, static_cast<long>(patience.count()));
  return call;
}

bool AddHeader(const std::string& header, OutwardHeaders* headers) {
  curl_slist* const longer = curl_slist_append(headers->get(), header.c_str());
  if (longer == nullptr) return false;
  headers->release();
  headers->reset(longer);
  return true;
}

}  // namespace sixpoint::runtime
