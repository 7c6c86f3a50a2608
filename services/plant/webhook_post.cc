#include "services/plant/webhook_post.h"

#include <absl/strings/escaping.h>
#include <curl/curl.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <cstring>
#include <memory>

#include "identity/message_code.h"
#include "services/runtime/outward_call.h"

namespace sixpoint::plant {
namespace {

constexpr std::size_t kMostAnswer_bytes = 64 << 10;  // thrown away; who sends more is cut off
constexpr char kWantedUrl[] = "http:// or https:// with a host, without a user and a password";

struct FreeHandle {
  void operator()(CURLU* url) const { curl_url_cleanup(url); }
};

std::string Part(CURLU* url, CURLUPart part) {
  char* text = nullptr;
  if (curl_url_get(url, part, &text, 0) != CURLUE_OK || text == nullptr) return "";
  std::string copy = text;
  curl_free(text);
  return copy;
}

// 169.254.0.0/16, and the two outside it where clouds have their secrets. Bytes in the order of the net.
bool IsOfLink(const unsigned char* four) {
  const unsigned char outside[2][4] = {{168, 63, 129, 16}, {100, 100, 100, 200}};
  return (four[0] == 169 && four[1] == 254) || std::memcmp(four, outside[0], 4) == 0 ||
         std::memcmp(four, outside[1], 4) == 0;
}

bool IsOfLink(const sockaddr& address) {
  if (address.sa_family == AF_INET) {
    sockaddr_in four{};
    std::memcpy(&four, &address, sizeof four);
    unsigned char bytes[4];
    std::memcpy(bytes, &four.sin_addr.s_addr, sizeof bytes);
    return IsOfLink(bytes);
  }
  if (address.sa_family != AF_INET6) return false;
  sockaddr_in6 six{};
  std::memcpy(&six, &address, sizeof six);
  if (IN6_IS_ADDR_LINKLOCAL(&six.sin6_addr)) return true;
  // 169.254.x.y written as ::ffff:169.254.x.y, ::169.254.x.y or, for a translator, 64:ff9b::169.254.x.y; and fd00:ec2::254 and
  // fd20:ce::254, where clouds have their secrets.
  const unsigned char* const bytes = six.sin6_addr.s6_addr;
  const unsigned char translated[12] = {0x00, 0x64, 0xff, 0x9b};
  const bool holds_four = IN6_IS_ADDR_V4MAPPED(&six.sin6_addr) || IN6_IS_ADDR_V4COMPAT(&six.sin6_addr) ||
                          std::memcmp(bytes, translated, sizeof translated) == 0;
  const unsigned char metadata[2][16] = {{0xfd, 0x00, 0x0e, 0xc2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0x02, 0x54},
                                         {0xfd, 0x20, 0x00, 0xce, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0x02, 0x54}};
  return (holds_four && IsOfLink(bytes + 12)) || std::memcmp(bytes, metadata[0], 16) == 0 ||
         std::memcmp(bytes, metadata[1], 16) == 0;
}

struct Call {
  const WebhookPostOptions* options;
  const std::atomic<bool>* is_stopped;
  std::size_t answered_bytes = 0;
  bool met_link = false;
};

// Asked of the address that is really connected to, whatever the name said before.
curl_socket_t Open(void* user, curlsocktype, curl_sockaddr* address) {
  auto* const call = static_cast<Call*>(user);
  if (!call->options->calls_link_local && IsOfLink(address->addr)) {
    call->met_link = true;
    return CURL_SOCKET_BAD;
  }
  return socket(address->family, address->socktype | SOCK_CLOEXEC, address->protocol);
}

std::size_t ThrowAway(const char*, std::size_t size, std::size_t count, void* user) {
  auto* const call = static_cast<Call*>(user);
  call->answered_bytes += size * count;
  return call->answered_bytes > kMostAnswer_bytes ? 0 : size * count;
}

int GoOn(void* user, curl_off_t, curl_off_t, curl_off_t, curl_off_t) {
  return static_cast<Call*>(user)->is_stopped->load() ? 1 : 0;
}

}  // namespace

std::string WrongUrl(const std::string& url) {
  const std::unique_ptr<CURLU, FreeHandle> parsed(curl_url());
  const bool has_odd = url.find_first_of(std::string(" \t\r\n\0", 5)) != std::string::npos;
  if (parsed == nullptr || has_odd || curl_url_set(parsed.get(), CURLUPART_URL, url.c_str(), 0) != CURLUE_OK)
    return kWantedUrl;
  const std::string scheme = Part(parsed.get(), CURLUPART_SCHEME);
  const bool is_sound = (scheme == "http" || scheme == "https") && url.rfind(scheme + "://", 0) == 0 &&
                        !Part(parsed.get(), CURLUPART_HOST).empty() && Part(parsed.get(), CURLUPART_USER).empty() &&
                        Part(parsed.get(), CURLUPART_PASSWORD).empty();
  return is_sound ? "" : kWantedUrl;
}

std::vector<std::string> SignatureHeaders(const std::string& key, const std::string& id, std::int64_t timestamp_s,
                                          const std::string& body) {
  const std::string timestamp = std::to_string(timestamp_s);
  const std::string code = identity::MessageCode(key, id + "." + timestamp + "." + body);
  return {"webhook-id: " + id, "webhook-timestamp: " + timestamp, "webhook-signature: v1," + absl::Base64Escape(code)};
}

std::string SecretText(const std::string& key) { return "whsec_" + absl::Base64Escape(key); }

WebhookAnswer PostEvents(const std::string& url, const std::vector<std::string>& headers, const std::string& body,
                         const WebhookPostOptions& options, const std::atomic<bool>& is_stopped) {
  const runtime::OutwardCall handle = runtime::NewOutwardCall(url, "http,https", "", options.patience);
  if (handle == nullptr) return {0, "curl does not start"};
  CURL* const curl = handle.get();
  Call call{&options, &is_stopped};
  runtime::OutwardHeaders list;
  bool is_whole = runtime::AddHeader("content-type: application/cloudevents-batch+json; charset=utf-8", &list);
  for (const std::string& header : headers) is_whole = is_whole && runtime::AddHeader(header, &list);
  if (!is_whole) return {0, "out of memory"};
  curl_easy_setopt(curl, CURLOPT_CONNECTTIMEOUT_MS, static_cast<long>(options.connect_patience.count()));
  curl_easy_setopt(curl, CURLOPT_USERAGENT, "sixpoint");
  curl_easy_setopt(curl, CURLOPT_HTTPHEADER, list.get());
  curl_easy_setopt(curl, CURLOPT_POSTFIELDSIZE_LARGE, static_cast<curl_off_t>(body.size()));
  curl_easy_setopt(curl, CURLOPT_POSTFIELDS, body.data());
  curl_easy_setopt(curl, CURLOPT_OPENSOCKETFUNCTION, Open);
  curl_easy_setopt(curl, CURLOPT_OPENSOCKETDATA, &call);
  curl_easy_setopt(curl, CURLOPT_WRITEFUNCTION, ThrowAway);
  curl_easy_setopt(curl, CURLOPT_WRITEDATA, &call);
  curl_easy_setopt(curl, CURLOPT_NOPROGRESS, 0L);
  curl_easy_setopt(curl, CURLOPT_XFERINFOFUNCTION, GoOn);
  curl_easy_setopt(curl, CURLOPT_XFERINFODATA, &call);
  const CURLcode code = curl_easy_perform(curl);
  long http_status = 0;
  curl_easy_getinfo(curl, CURLINFO_RESPONSE_CODE, &http_status);
  if (call.met_link)
    return {0, "an address of the link, which is not called unless the plant is started with --webhook-link-local"};
  const int status = static_cast<int>(http_status);
  // What it says beyond its status is not asked for.
  const bool has_said_enough = call.answered_bytes > kMostAnswer_bytes && status > 0;
  if (code != CURLE_OK && !has_said_enough) return {status, curl_easy_strerror(code)};
  if (status < 200 || status > 299) return {status, "HTTP " + std::to_string(status) + ", want 200 to 299"};
  return {status, ""};
}

}  // namespace sixpoint::plant
