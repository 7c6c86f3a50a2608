#include "services/plant/identity_provider.h"

#include <map>
#include <set>
#include <utility>

#include "identity/files.h"
#include "services/plant/key_set_fetch.h"
#include "services/runtime/errors.h"
#include "services/runtime/identity_provider_file.h"
#include "services/runtime/log.h"
#include "services/runtime/memory_guard.h"

namespace sixpoint::plant {
namespace {

using runtime::Refuse;
using std::chrono::seconds;

constexpr std::chrono::milliseconds kFetchPatience{5000};
constexpr seconds kKeysLast{3600}, kBetweenTries{60}, kBetweenTriesWithout{5};
// Keys that could not be got anew count no longer than this.
constexpr seconds kOldestKeys{24 * 3600};

// Whom the plant's people say a subject of the provider is: each of them one, and nobody two.
absl::StatusOr<std::map<std::string, std::string>> PersonsOf(const runtime::IdentityProviderFile& file) {
  const std::string& path = file.path;
  std::map<std::string, std::string> persons;
  std::set<std::string> seen;
  runtime::Refusals refusals;
  for (const auto& [subject, name] : file.persons) {
    if (!identity::IsUser(name))
      refusals.Add(Refuse(path + ": persons." + subject, name, "users/NAME"));
    else if (!seen.insert(name).second)
      refusals.Add(Refuse(path + ": persons." + subject, name + ", another subject's too", "one subject of each"));
    persons.emplace(subject, name);
  }
  if (absl::Status status = refusals.status(); !status.ok()) return status;
  return persons;
}

bool IsHttps(const std::string& url) { return url.rfind("https://", 0) == 0 && url.size() > 8 && url.size() <= 1024; }

}  // namespace

absl::StatusOr<IdentityProviderConfig> ReadIdentityProviderConfig(const std::string& path) {
  const absl::StatusOr<runtime::IdentityProviderFile> file = runtime::ReadIdentityProviderFile(path);
  if (!file.ok()) return file.status();
  IdentityProviderConfig config;
  const auto take = [&](const char* key, std::string* value) {
    if (const auto found = file->texts.find(key); found != file->texts.end()) *value = found->second;
  };
  take("issuer", &config.policy.issuer);
  take("client_id", &config.policy.client_id);
  take("keys_url", &config.keys_url);
  take("keys_file", &config.keys_file);
  take("ca_file", &config.ca_file);
  take("name_claim", &config.policy.name_claim);
  take("roles_claim", &config.policy.roles_claim);
  runtime::Refusals refusals;
  const auto refuse = [&](const std::string& key, const std::string& value, const std::string& wanted) {
    refusals.Add(Refuse(path + ": " + key, value, wanted));
  };
  if (!IsHttps(config.policy.issuer)) refuse("issuer", config.policy.issuer, "https://..., as iss says it");
  if (config.policy.client_id.empty()) refuse("client_id", "", "the gateway's, by the provider");
  if (config.policy.name_claim.empty()) refuse("name_claim", "", "a claim's name");
  if (config.policy.roles_claim.empty()) refuse("roles_claim", "", "a claim's name");
  if (config.keys_url.empty() == config.keys_file.empty())
    refuse("keys_url", config.keys_url, "it or keys_file, and not both");
  if (!config.keys_url.empty() && !IsHttps(config.keys_url)) refuse("keys_url", config.keys_url, "https://...");
  if (file->roles.empty()) refuse("roles", "", "at least one of the claim's values and the role that it gives");
  for (const auto& [value, word] : file->roles) {
    const absl::StatusOr<identity::Role> role = identity::RoleOf(path + ": roles." + value, word);
    const bool is_users = role.ok() && identity::IdentityOf("users/any", {*role}).ok();
    if (!is_users) {
      refuse("roles." + value, word, "engineer, quality, mes-reader or admin");
      continue;
    }
    config.policy.roles.emplace(value, *role);
  }
  absl::StatusOr<std::map<std::string, std::string>> persons = PersonsOf(*file);
  if (persons.ok())
    config.persons = *std::move(persons);
  else
    refusals.Add(persons.status());
  if (absl::Status status = refusals.status(); !status.ok()) return status;
  return config;
}

std::optional<std::string> IdentityProvider::PersonOf(const std::string& subject) const {
  const auto found = config_.persons.find(subject);
  if (found == config_.persons.end()) return std::nullopt;
  return found->second;
}

absl::StatusOr<identity::KeySet> IdentityProvider::Get() const {
  const absl::StatusOr<std::string> json =
      config_.keys_file.empty()
          ? FetchByHttps(config_.keys_url, config_.ca_file, identity::kLongestKeySet_bytes, kFetchPatience)
          : identity::ReadFile(config_.keys_file, identity::kLongestKeySet_bytes);
  if (!json.ok()) return json.status();
  return identity::KeySet::Read(*json);
}

IdentityProvider::Keys IdentityProvider::KeysYoungerThan(seconds age) {
  std::unique_lock<std::mutex> lock(mutex_);
  const auto are_young = [&] { return keys_ != nullptr && now_() - got_at_ < age; };
  if (are_young()) return keys_;
  // One asks the provider, without the lock: whose keys are young enough goes on meanwhile. The others have what he gets.
  if (is_fetching_) {
    fetched_.wait_for(lock, 2 * kFetchPatience, [this] { return !is_fetching_; });
    return keys_;
  }
  const Clock::time_point now = now_();
  const seconds between = keys_ == nullptr ? kBetweenTriesWithout : kBetweenTries;
  if (!tried_at_ || now - *tried_at_ >= between) {
    is_fetching_ = true;
    lock.unlock();
    absl::StatusOr<identity::KeySet> got =
        runtime::WithinMemory("the identity provider's keys: no memory left", [this] { return Get(); });
    lock.lock();
    is_fetching_ = false;
    tried_at_ = now_();  // who waited for this turn does not wait for another try
    if (got.ok()) {
      keys_ = std::make_shared<const identity::KeySet>(*std::move(got));
      got_at_ = now;
    } else {
      runtime::Log(runtime::LogLevel::kWarning,
                   "the identity provider's keys cannot be had: " + std::string(got.status().message()));
    }
    fetched_.notify_all();
  }
  if (keys_ != nullptr && now - got_at_ > kOldestKeys) keys_.reset();
  return keys_;
}

absl::StatusOr<identity::SignedInPerson> IdentityProvider::Judge(const std::string& id_token,
                                                                 const std::string& nonce) {
  absl::StatusOr<identity::SignedInPerson> person = absl::NotFoundError("");
  for (const seconds age : {kKeysLast, seconds(0)}) {  // of a key that is not among them: once more, with new ones
    const Keys keys = KeysYoungerThan(age);
    if (keys == nullptr)
      return runtime::Failure(errors::v1::IDENTITY_PROVIDER_AWAY,
                              "the identity provider's keys cannot be had now; the plant's log says why");
    person = identity::JudgeIdToken(id_token, nonce, config_.policy, *keys, std::chrono::system_clock::now());
    if (!absl::IsNotFound(person.status())) return person;
  }
  return absl::UnauthenticatedError(person.status().message());
}

}  // namespace sixpoint::plant
