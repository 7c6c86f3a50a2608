#include "identity/id_token.h"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <set>
#include <vector>

#include "identity/json_web_token.h"
#include "identity/key_set.h"
#include "identity/signatures.h"
#include "identity/strict_json.h"

namespace sixpoint::identity {
namespace {

using nlohmann::json;

constexpr std::size_t kLongestSubject_bytes = 255, kMostValues = 1000;
// A token is shown right after it was made: an old one was kept by somebody.
constexpr std::chrono::minutes kOldest{10};

absl::Status Wrong(const std::string& what) { return absl::UnauthenticatedError("id_token: " + what); }

// What the header asks for is done only where it is one of three; a key or its address in it is never looked at.
absl::StatusOr<std::string> AlgorithmOf(const json& header) {
  const std::string algorithm = TextIn(header, "alg").value_or("");
  if (algorithm != "RS256" && algorithm != "PS256" && algorithm != "ES256")
    return Wrong("of another algorithm, want RS256, PS256 or ES256");
  if (header.contains("crit") || header.contains("b64")) return Wrong("with crit or b64 in its header, want none");
  // An access token is none that says who signed in.
  if (header.contains("typ") && TextIn(header, "typ") != "JWT") return Wrong("of another typ, want JWT");
  if (header.contains("kid") && !TextIn(header, "kid")) return Wrong("with a kid that is no text");
  return algorithm;
}

bool Fits(const ProviderKey& key, const std::string& algorithm) {
  const bool is_of_kind = algorithm == "ES256" ? IsP256(key.key.get()) : IsRsa(key.key.get());
  return is_of_kind && (key.algorithm.empty() || key.algorithm == algorithm);
}

bool Verifies(const ProviderKey& key, const std::string& algorithm, const JsonWebToken& parts) {
  if (algorithm == "ES256") return VerifiesEs256(key.key.get(), parts.signed_text, parts.signature, EitherS::kTaken);
  const RsaPadding padding = algorithm == "PS256" ? RsaPadding::kPss : RsaPadding::kPkcs1;
  return VerifiesRsa(key.key.get(), padding, parts.signed_text, parts.signature);
}

absl::Status CheckTimes(const json& claims, std::chrono::seconds leeway, TimePoint now) {
  const std::optional<TimePoint> ends = TimeIn(claims, "exp"), made = TimeIn(claims, "iat");
  if (!ends || !made) return Wrong("without exp or iat as whole seconds");
  if (now >= *ends + leeway) return Wrong("over (exp)");
  if (*made > now + leeway) return Wrong("of a moment to come (iat)");
  if (*made + kOldest + leeway < now) return Wrong("made more than 10 minutes ago (iat)");
  if (!claims.contains("nbf")) return absl::OkStatus();
  const std::optional<TimePoint> begins = TimeIn(claims, "nbf");
  if (!begins || *begins > now + leeway) return Wrong("not valid yet (nbf)");
  return absl::OkStatus();
}

// One value or a list of them; none of anything else.
std::optional<std::vector<std::string>> TextsIn(const json& claims, const std::string& name) {
  const auto found = claims.find(name);
  if (found == claims.end()) return std::nullopt;
  if (found->is_string()) return std::vector<std::string>{found->get<std::string>()};
  if (!found->is_array() || found->size() > kMostValues) return std::nullopt;
  std::vector<std::string> texts;
  for (const json& one : *found) {
    if (!one.is_string()) return std::nullopt;
    texts.push_back(one.get<std::string>());
  }
  return texts;
}

absl::Status CheckMeantForUs(const json& claims, const std::string& nonce, const IdTokenPolicy& policy) {
  if (TextIn(claims, "iss") != policy.issuer) return Wrong("of another issuer (iss)");
  const auto audience = TextsIn(claims, "aud");
  if (!audience || std::count(audience->begin(), audience->end(), policy.client_id) == 0)
    return Wrong("for another client (aud)");
  // For several it has to say whom it was given to (OpenID Connect Core 1.0, 3.1.3.7).
  if ((audience->size() > 1 || claims.contains("azp")) && TextIn(claims, "azp") != policy.client_id)
    return Wrong("given to another client (azp)");
  if (nonce.empty() || TextIn(claims, "nonce") != nonce) return Wrong("of another sign-in (nonce)");
  return absl::OkStatus();
}

absl::StatusOr<SignedInPerson> PersonOf(const json& claims, const IdTokenPolicy& policy) {
  const std::string subject = TextIn(claims, "sub").value_or("");
  if (subject.empty() || subject.size() > kLongestSubject_bytes) return Wrong("without a sub of 1 to 255 bytes");
  std::set<Role> roles;
  const auto values = TextsIn(claims, policy.roles_claim);
  for (const std::string& value : values.value_or(std::vector<std::string>()))
    if (const auto role = policy.roles.find(value); role != policy.roles.end()) roles.insert(role->second);
  if (roles.empty()) return Wrong("with no value of the claim " + policy.roles_claim + " that gives a role");
  absl::StatusOr<Identity> person =
      IdentityOf("users/" + TextIn(claims, policy.name_claim.c_str()).value_or(""), {roles.begin(), roles.end()});
  if (!person.ok())
    return Wrong("with a claim " + policy.name_claim + " that is no name: 1 to 64 of A-Z, a-z, 0-9, '.', '_', '-'");
  return SignedInPerson{*std::move(person), subject};
}

}  // namespace

// Reads the set's keys.
class IdTokenJudge {
 public:
  // Whatever the kid says is compared with the set's, nothing else.
  static absl::Status CheckSigned(const JsonWebToken& parts, const std::string& algorithm, const KeySet& set) {
    const std::optional<std::string> id = TextIn(parts.header, "kid");
    std::vector<const ProviderKey*> fitting;
    bool is_id_known = !id;
    for (const ProviderKey& key : set.keys_->keys) {
      is_id_known = is_id_known || key.id == *id;
      if (Fits(key, algorithm) && (!id || key.id == *id)) fitting.push_back(&key);
    }
    if (!is_id_known) return absl::NotFoundError("id_token: signed with a key (kid) that the provider does not name");
    // Without an id there is one key that it can be, or it is not known which.
    if (fitting.empty() || (!id && fitting.size() > 1)) return Wrong("without a key of its algorithm, or with several");
    const bool holds = std::any_of(fitting.begin(), fitting.end(),
                                   [&](const ProviderKey* key) { return Verifies(*key, algorithm, parts); });
    return holds ? absl::OkStatus() : Wrong("with a signature that does not hold");
  }
};

absl::StatusOr<SignedInPerson> JudgeIdToken(std::string_view token, const std::string& nonce,
                                            const IdTokenPolicy& policy, const KeySet& keys, TimePoint now) {
  const OwnErrors errors;
  const std::optional<JsonWebToken> parts = JsonWebTokenOf(token, kLongestIdToken_bytes);
  if (!parts) return Wrong("not one that can be read, want three parts of base64url, each JSON with each key once");
  const absl::StatusOr<std::string> algorithm = AlgorithmOf(parts->header);
  if (!algorithm.ok()) return algorithm.status();
  if (absl::Status held = IdTokenJudge::CheckSigned(*parts, *algorithm, keys); !held.ok()) return held;
  if (absl::Status meant = CheckMeantForUs(parts->claims, nonce, policy); !meant.ok()) return meant;
  if (absl::Status holds = CheckTimes(parts->claims, policy.leeway, now); !holds.ok()) return holds;
  return PersonOf(parts->claims, policy);
}

}  // namespace sixpoint::identity
