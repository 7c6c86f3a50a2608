#include "services/gateway/directory_client.h"

#include <absl/strings/str_split.h>
#include <sys/stat.h>

#include <algorithm>
#include <cctype>
#include <vector>

#include "identity/files.h"
#include "services/runtime/errors.h"
#include "services/runtime/identity_provider_file.h"

namespace sixpoint::gateway {
namespace {

using runtime::Refuse;

constexpr std::size_t kLongestUrl_bytes = 1024, kLongestName_bytes = 64, kLongestSecret_bytes = 1024,
                      kLongestScope_bytes = 256, kLongestId_bytes = 256;
constexpr char kWantedUrl[] = "https:// with a host, of at most 1024 letters, without a user and a #";

bool IsPrintable(const std::string& text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c > ' ' && c < 0x7f; });
}

// Of a url that begins with its scheme.
std::string HostOf(const std::string& url) {
  const std::size_t begin = url.find("://") + 3;
  return url.substr(begin, url.find_first_of("/?#", begin) - begin);
}

// It goes into a header of the browser's answer, and into curl.
bool IsHttps(const std::string& url) {
  return url.rfind("https://", 0) == 0 && url.size() <= kLongestUrl_bytes && IsPrintable(url) &&
         url.find_first_of("#\"<>\\") == std::string::npos && !HostOf(url).empty() &&
         HostOf(url).find('@') == std::string::npos;
}

absl::StatusOr<std::string> ReadSecret(const std::string& key, const std::string& path) {
  struct stat file {};
  if (stat(path.c_str(), &file) != 0) return Refuse(key, path, "a file that the gateway's user may read");
  if ((file.st_mode & S_IRWXO) != 0)
    return Refuse(key, path + ", which everybody may read", "a secret's file, mode 0600 or 0640");
  absl::StatusOr<std::string> secret = identity::ReadFile(path, kLongestSecret_bytes);
  if (!secret.ok()) return Refuse(key, path, "a file of at most 1024 bytes that the gateway's user may read");
  while (!secret->empty() && (secret->back() == '\n' || secret->back() == '\r')) secret->pop_back();
  if (secret->empty() || !IsPrintable(*secret)) return Refuse(key, path, "one line of it: letters, digits and signs");
  return secret;
}

absl::StatusOr<std::string> RedirectUrl(const std::string& page_url) {
  std::string page = page_url;
  if (!page.empty() && page.back() == '/') page.pop_back();
  const bool is_http = page.rfind("http://", 0) == 0 || page.rfind("https://", 0) == 0;
  if (!is_http || page.size() > 200 || !IsPrintable(page) || HostOf(page).empty() ||
      page.size() != page.find("://") + 3 + HostOf(page).size())
    return Refuse(
        "--page", page_url,
        "http:// or https:// and a host, such as https://plant.example: the provider sends people back there");
  return page + "/session/callback";
}

// What the file says beside its addresses.
void TakeTexts(const runtime::IdentityProviderFile& file, DirectoryClient* client, runtime::Refusals* refusals) {
  const auto refuse = [&](const std::string& key, const std::string& value, const std::string& wanted) {
    refusals->Add(Refuse(file.path + ": " + key, value, wanted));
  };
  if (const std::string scope = file.Text("scope"); !scope.empty()) {
    client->scope = scope;
    const std::vector<std::string> words = absl::StrSplit(scope, ' ');
    const bool are_words =
        scope.size() <= kLongestScope_bytes && std::all_of(words.begin(), words.end(), [](const std::string& word) {
          return !word.empty() && IsPrintable(word) && word.find_first_of("\"\\") == word.npos;
        });
    if (!are_words || std::count(words.begin(), words.end(), "openid") != 1)
      refuse("scope", scope, "words with one blank between them, openid among them");
  }
  client->display_name = file.Text("display_name");
  if (client->display_name.empty()) client->display_name = HostOf(client->authorization_url);
  const bool has_controls = std::any_of(client->display_name.begin(), client->display_name.end(),
                                        [](unsigned char c) { return c < 0x20 || c == 0x7f; });
  if (has_controls || client->display_name.size() > kLongestName_bytes)
    refuse("display_name", client->display_name, "at most 64 bytes, without control characters");
  const std::string asks = file.Text("asks_again");
  client->asks_again = asks != "false";
  if (!asks.empty() && asks != "true" && asks != "false") refuse("asks_again", asks, "true or false");
  if (const std::string secret_file = file.Text("client_secret_file"); !secret_file.empty()) {
    absl::StatusOr<std::string> secret = ReadSecret(file.path + ": client_secret_file", secret_file);
    refusals->Add(secret.status());
    if (secret.ok()) client->client_secret = *std::move(secret);
  }
}

}  // namespace

absl::StatusOr<std::optional<DirectoryClient>> ReadDirectoryClient(const std::string& path,
                                                                   const std::string& page_url) {
  const absl::StatusOr<runtime::IdentityProviderFile> file = runtime::ReadIdentityProviderFile(path);
  if (!file.ok()) return file.status();
  DirectoryClient client;
  client.authorization_url = file->Text("authorization_url");
  client.token_url = file->Text("token_url");
  if (client.authorization_url.empty() && client.token_url.empty()) return std::nullopt;
  client.issuer = file->Text("issuer");
  client.client_id = file->Text("client_id");
  client.ca_file = file->Text("ca_file");
  runtime::Refusals refusals;
  const auto refuse = [&](const std::string& key, const std::string& value, const std::string& wanted) {
    refusals.Add(Refuse(path + ": " + key, value, wanted));
  };
  if (!IsHttps(client.authorization_url)) refuse("authorization_url", client.authorization_url, kWantedUrl);
  if (!IsHttps(client.token_url)) refuse("token_url", client.token_url, kWantedUrl);
  if (!IsHttps(client.issuer)) refuse("issuer", client.issuer, "https://..., as iss says it");
  if (client.client_id.empty() || client.client_id.size() > kLongestId_bytes)
    refuse("client_id", client.client_id, "the gateway's, by the provider, of at most 256 bytes");
  TakeTexts(*file, &client, &refusals);
  absl::StatusOr<std::string> redirect = RedirectUrl(page_url);
  refusals.Add(redirect.status());
  if (absl::Status status = refusals.status(); !status.ok()) return status;
  client.redirect_url = *std::move(redirect);
  return client;
}

std::string FormText(const std::string& text) {
  constexpr char kHex[] = "0123456789ABCDEF";
  std::string form;
  for (const unsigned char c : text) {
    if (std::isalnum(c) != 0 || c == '-' || c == '.' || c == '_' || c == '~')
      form += static_cast<char>(c);
    else
      form += {'%', kHex[c >> 4], kHex[c & 15]};
  }
  return form;
}

std::string AuthorizationUrl(const DirectoryClient& client, const SignInSecrets& secrets) {
  const char first = client.authorization_url.find('?') == std::string::npos ? '?' : '&';
  return client.authorization_url + first + "response_type=code&client_id=" + FormText(client.client_id) +
         "&redirect_uri=" + FormText(client.redirect_url) + "&scope=" + FormText(client.scope) +
         "&state=" + secrets.state + "&nonce=" + secrets.nonce + "&code_challenge=" + ChallengeOf(secrets.verifier) +
         "&code_challenge_method=S256" + (client.asks_again ? "&prompt=login" : "");
}

}  // namespace sixpoint::gateway
