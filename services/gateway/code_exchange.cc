#include "services/gateway/code_exchange.h"

#include <absl/strings/escaping.h>
#include <curl/curl.h>

#include <boost/asio/post.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "identity/id_token.h"
#include "services/runtime/outward_call.h"
#include "services/runtime/peer_address.h"

namespace sixpoint::gateway {
namespace {

constexpr std::chrono::milliseconds kPatience{10'000}, kConnectPatience{5'000};
constexpr std::size_t kMostAnswer_bytes = 64 << 10;

struct Exchanged {
  const std::function<bool()>* is_over;
  std::string body;
};

std::size_t Collect(const char* data, std::size_t size, std::size_t count, void* user) {
  auto* const exchanged = static_cast<Exchanged*>(user);
  if (exchanged->body.size() + size * count > kMostAnswer_bytes) return 0;  // ends the transfer
  exchanged->body.append(data, size * count);
  return size * count;
}

int GoOn(void* user, curl_off_t, curl_off_t, curl_off_t, curl_off_t) {
  return (*static_cast<Exchanged*>(user)->is_over)() ? 1 : 0;
}

// A secret goes as the standard has every provider take it (RFC 6749, 2.3.1); a client without one says its name in the form.
std::string FormOf(const DirectoryClient& client, const std::string& code, const std::string& verifier) {
  std::string form = "grant_type=authorization_code&code=" + FormText(code) +
                     "&redirect_uri=" + FormText(client.redirect_url) + "&code_verifier=" + FormText(verifier);
  if (client.client_secret.empty()) form += "&client_id=" + FormText(client.client_id);
  return form;
}

void Bound(CURL* curl, Exchanged* exchanged) {
  curl_easy_setopt(curl, CURLOPT_CONNECTTIMEOUT_MS, static_cast<long>(kConnectPatience.count()));
  curl_easy_setopt(curl, CURLOPT_USERAGENT, "sixpoint");
  curl_easy_setopt(curl, CURLOPT_MAXFILESIZE, static_cast<long>(kMostAnswer_bytes));
  curl_easy_setopt(curl, CURLOPT_WRITEFUNCTION, Collect);
  curl_easy_setopt(curl, CURLOPT_WRITEDATA, exchanged);
  curl_easy_setopt(curl, CURLOPT_NOPROGRESS, 0L);
  curl_easy_setopt(curl, CURLOPT_XFERINFOFUNCTION, GoOn);
  curl_easy_setopt(curl, CURLOPT_XFERINFODATA, exchanged);
}

std::string TextIn(const nlohmann::json& json, const char* name) {
  const auto found = json.is_object() ? json.find(name) : json.end();
  return found != json.end() && found->is_string() ? found->get<std::string>() : "";
}

CodeAnswer Read(long http_status, const std::string& body) {
  const std::string status = "HTTP " + std::to_string(http_status);
  const nlohmann::json json = nlohmann::json::parse(body, nullptr, /*allow_exceptions=*/false);
  if (http_status == 200) {
    CodeAnswer answer{CodeEnd::kGiven, TextIn(json, "id_token"), ""};
    if (!answer.id_token.empty() && answer.id_token.size() <= identity::kLongestIdToken_bytes) return answer;
    return {CodeEnd::kAway, "", "HTTP 200 without an id_token of at most 16 KiB"};
  }
  // What else the provider says of it is not repeated. RFC 6749, 5.2.
  const std::string error = TextIn(json, "error");
  if (http_status == 400 && error == "invalid_grant") return {CodeEnd::kCodeRefused, "", status + " (invalid_grant)"};
  if (http_status >= 400 && http_status < 500 && http_status != 408 && http_status != 429) {
    for (const char* const known :
         {"invalid_request", "invalid_client", "unauthorized_client", "unsupported_grant_type", "invalid_scope"})
      if (error == known) return {CodeEnd::kClientRefused, "", status + " (" + error + ")"};
    return {CodeEnd::kClientRefused, "", status};
  }
  return {CodeEnd::kAway, "", status + ", want 200"};
}

}  // namespace

CodeAnswer ExchangeCode(const DirectoryClient& client, const std::string& code, const std::string& verifier,
                        const std::function<bool()>& is_over) {
  const runtime::OutwardCall handle = runtime::NewOutwardCall(client.token_url, "https", client.ca_file, kPatience);
  if (handle == nullptr) return {CodeEnd::kAway, "", "curl does not start"};
  CURL* const curl = handle.get();
  Exchanged exchanged{&is_over, ""};
  runtime::OutwardHeaders headers;
  bool is_whole = runtime::AddHeader("Accept: application/json", &headers);
  if (!client.client_secret.empty()) {
    const std::string who = FormText(client.client_id) + ":" + FormText(client.client_secret);
    is_whole = is_whole && runtime::AddHeader("Authorization: Basic " + absl::Base64Escape(who), &headers);
  }
  if (!is_whole) return {CodeEnd::kAway, "", "out of memory"};
  const std::string form = FormOf(client, code, verifier);
  Bound(curl, &exchanged);
  curl_easy_setopt(curl, CURLOPT_HTTPHEADER, headers.get());
  curl_easy_setopt(curl, CURLOPT_POSTFIELDSIZE_LARGE, static_cast<curl_off_t>(form.size()));
  curl_easy_setopt(curl, CURLOPT_POSTFIELDS, form.data());
  const CURLcode ended = curl_easy_perform(curl);
  if (ended != CURLE_OK) return {CodeEnd::kAway, "", curl_easy_strerror(ended)};
  long http_status = 0;
  curl_easy_getinfo(curl, CURLINFO_RESPONSE_CODE, &http_status);
  return Read(http_status, exchanged.body);
}

std::string PeerOf(const std::string& client_address) {
  const bool is_v6 = client_address.find(':') != std::string::npos;
  return runtime::PeerKey(is_v6 ? "ipv6:%5B" + client_address + "%5D:0" : "ipv4:" + client_address + ":0");
}

std::shared_ptr<CodeWorkers::Place> CodeWorkers::Take(const std::string& client_address) {
  if (is_stopping_) return nullptr;
  std::optional<runtime::PeerShares::Share> share = shares_.Take(PeerOf(client_address));
  if (!share) return nullptr;
  if (running_.fetch_add(1) >= kMost) {
    --running_;
    return nullptr;
  }
  return std::make_shared<Place>(this, *std::move(share));
}

void CodeWorkers::Begin(std::shared_ptr<Place> place, std::function<void()> job) {
  boost::asio::post(pool_, [place = std::move(place), job = std::move(job)] { job(); });
}

void CodeWorkers::Stop() {
  is_stopping_ = true;
  pool_.join();
}

}  // namespace sixpoint::gateway
