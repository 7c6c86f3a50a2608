// A sign-in that went to the identity provider and has not come back. The browser carries it, signed, so that the gateway keeps nothing of
// who goes and never comes back, however many they are. It holds no secret: state, nonce and verifier are made of it by the gateway's key.
#pragma once

#include <chrono>
#include <optional>
#include <string>

namespace sixpoint::gateway {

struct SignInTicket {
  std::string random;       // base64url of 32 bytes
  std::string return_path;  // where the person was
  std::chrono::system_clock::time_point begun;
};

// What goes with it to the provider: each 43 letters, digits and - _ .
struct SignInSecrets {
  std::string state;     // comes back in the browser's address
  std::string nonce;     // comes back in the ID token
  std::string verifier;  // of PKCE (RFC 7636): who has the code alone has nothing
};

// Thread-safe.
class SignInTickets {
 public:
  static constexpr std::chrono::minutes kLast{10};

  // With a key of its own: a gateway that was started again knows none of before.
  SignInTickets();

  static SignInTicket New(const std::string& return_path, std::chrono::system_clock::time_point now);
  // Letters, digits and - _ . alone.
  std::string TextOf(const SignInTicket& ticket) const;
  // None of a text that this gateway did not make, or that is older than kLast.
  std::optional<SignInTicket> Read(const std::string& text, std::chrono::system_clock::time_point now) const;
  SignInSecrets SecretsOf(const SignInTicket& ticket) const;

 private:
  const std::string key_;
};

// The same in as much time, whatever is different.
bool AreSame(const std::string& a, const std::string& b);
// base64url of the SHA-256: what the provider is told of the verifier first ("S256").
std::string ChallengeOf(const std::string& verifier);
// A path and a query of this site, as a browser reads them: no other host, nothing of the sign-in itself. At most 1024 bytes.
bool IsOwnPath(const std::string& path);

}  // namespace sixpoint::gateway
