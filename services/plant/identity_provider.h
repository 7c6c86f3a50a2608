// The plant's identity provider (OpenID Connect): whom its tokens name, and what it says of them. Its file: docs/access.md, which the gateway
// reads too (services/runtime/identity_provider_file.h).
#pragma once

#include <absl/status/statusor.h>

#include <chrono>
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "identity/id_token.h"

namespace sixpoint::plant {

struct IdentityProviderConfig {
  identity::IdTokenPolicy policy;
  std::string keys_url, keys_file;  // one of them
  std::string ca_file;
  std::map<std::string, std::string> persons;  // by subject: users/jane
};

// INVALID_ARGUMENT names the key, its value and what was wanted; also of a key that is not known, for a misspelt one must not pass.
absl::StatusOr<IdentityProviderConfig> ReadIdentityProviderConfig(const std::string& path);

// Thread-safe.
class IdentityProvider {
 public:
  using Clock = std::chrono::steady_clock;
  // `now`: a test has its own.
  explicit IdentityProvider(IdentityProviderConfig config, std::function<Clock::time_point()> now = Clock::now)
      : config_(std::move(config)), now_(std::move(now)) {}

  // As identity::JudgeIdToken, by the provider's keys as they were got within the last hour; of a key that is not among them they are
  // got again, at most once a minute. UNAVAILABLE (IDENTITY_PROVIDER_AWAY) where there are none.
  absl::StatusOr<identity::SignedInPerson> Judge(const std::string& id_token, const std::string& nonce);
  // Whom the file says that subject is; none: whom the token names.
  std::optional<std::string> PersonOf(const std::string& subject) const;
  const std::string& issuer() const { return config_.policy.issuer; }

 private:
  using Keys = std::shared_ptr<const identity::KeySet>;
  // Got now where what there is is older than that; what there was stays where it cannot be had.
  Keys KeysYoungerThan(std::chrono::seconds age);
  absl::StatusOr<identity::KeySet> Get() const;

  const IdentityProviderConfig config_;
  const std::function<Clock::time_point()> now_;
  std::mutex mutex_;
  std::condition_variable fetched_;
  bool is_fetching_ = false;  // by one, who does not hold the lock meanwhile
  Keys keys_;
  std::optional<Clock::time_point> tried_at_;
  Clock::time_point got_at_;
};

}  // namespace sixpoint::plant
