// The gateway as a client of the plant's identity provider (OpenID Connect): where people are sent, and where their code becomes an ID
// token. Of the same file as the plant's service reads (docs/access.md).
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>

#include "services/gateway/sign_in_ticket.h"

namespace sixpoint::gateway {

struct DirectoryClient {
  std::string issuer, client_id;
  std::string client_secret;  // empty: a client without one, whom PKCE alone protects
  std::string authorization_url, token_url;
  std::string ca_file;  // empty: the system's authorities
  std::string scope = "openid profile";
  std::string display_name;  // of the provider, to people
  bool asks_again = true;    // also of who is signed in at the provider already
  std::string redirect_url;  // here, as the provider knows it
};

// None where the file names no authorization_url: people sign in by password alone. INVALID_ARGUMENT names the key, its value and what was
// wanted; of a secret only its file. page_url: where people find the page.
absl::StatusOr<std::optional<DirectoryClient>> ReadDirectoryClient(const std::string& path,
                                                                   const std::string& page_url);

// Where the browser is sent.
std::string AuthorizationUrl(const DirectoryClient& client, const SignInSecrets& secrets);
// A name or a value of a form (application/x-www-form-urlencoded).
std::string FormText(const std::string& text);

}  // namespace sixpoint::gateway
