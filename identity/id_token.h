// What an identity provider says of who signed in: an ID token (OpenID Connect Core 1.0, 2) and the keys that such tokens are signed
// with (RFC 7517). Judged by what the plant's own file says of the provider, by nothing that stands in the token itself.
#pragma once

#include <absl/status/statusor.h>

#include <chrono>
#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "identity/credentials.h"
#include "identity/identity.h"

namespace sixpoint::identity {

inline constexpr std::size_t kLongestIdToken_bytes = 16 * 1024, kLongestKeySet_bytes = 256 * 1024;

struct IdTokenPolicy {
  std::string issuer;     // as iss says it
  std::string client_id;  // the gateway's, by the provider
  std::string name_claim = "preferred_username";
  std::string roles_claim = "groups";
  std::map<std::string, Role> roles;  // by the claim's values; others count for nothing
  std::chrono::seconds leeway{60};    // of clocks
};

// The public keys of a provider that can sign ID tokens here: RSA of 2048 to 8192 bits, EC P-256. Thread-safe once made.
class KeySet {
 public:
  // INVALID_ARGUMENT of a text that is none, or holds no such key. Keys of other kinds and for other uses count for nothing.
  static absl::StatusOr<KeySet> Read(std::string_view json);
  KeySet(KeySet&&) noexcept;
  KeySet& operator=(KeySet&&) noexcept;
  ~KeySet();

 private:
  friend class IdTokenJudge;
  struct Keys;
  explicit KeySet(std::unique_ptr<Keys> keys);
  std::unique_ptr<Keys> keys_;
};

struct SignedInPerson {
  Identity person;      // a user
  std::string subject;  // sub: whose it is for ever, whatever he is called
};

// The person of a token that this provider signed with RS256, PS256 or ES256 for this client and nonce, and that holds now.
// UNAUTHENTICATED, in words for the plant's log: what was wrong, never what the token held. NOT_FOUND: signed with a key of another
// id (kid) than those of the set, which may have a new one by now.
absl::StatusOr<SignedInPerson> JudgeIdToken(std::string_view token, const std::string& nonce,
                                            const IdTokenPolicy& policy, const KeySet& keys, TimePoint now);

}  // namespace sixpoint::identity
