#include "identity/key_set.h"

#include <openssl/core_names.h>
#include <openssl/param_build.h>

#include <optional>
#include <utility>

#include "identity/base64url.h"
#include "identity/signatures.h"
#include "identity/strict_json.h"
#include "refusal/refusal.h"

namespace sixpoint::identity {
namespace {

using nlohmann::json;
using Parameters = std::unique_ptr<OSSL_PARAM, FreedBy<OSSL_PARAM_free>>;
using Builder = std::unique_ptr<OSSL_PARAM_BLD, FreedBy<OSSL_PARAM_BLD_free>>;
using Context = std::unique_ptr<EVP_PKEY_CTX, FreedBy<EVP_PKEY_CTX_free>>;

constexpr std::size_t kMostKeys = 100, kLongestId_bytes = 256, kCoordinate_bytes = 32;
constexpr int kLeastRsa_bits = 2048, kMostRsa_bits = 8192, kMostExponent_bits = 33;

BigNumber NumberOf(const std::string& bytes) {
  return BigNumber(
      BN_bin2bn(reinterpret_cast<const unsigned char*>(bytes.data()), static_cast<int>(bytes.size()), nullptr));
}

Key KeyOf(const char* kind, OSSL_PARAM* parameters) {
  const Context context(EVP_PKEY_CTX_new_from_name(nullptr, kind, nullptr));
  EVP_PKEY* key = nullptr;
  if (parameters == nullptr || context == nullptr || EVP_PKEY_fromdata_init(context.get()) != 1 ||
      EVP_PKEY_fromdata(context.get(), &key, EVP_PKEY_PUBLIC_KEY, parameters) != 1)
    return nullptr;
  return Key(key);
}

// An exponent of 1 would let anybody sign.
Key RsaKeyOf(const std::string& modulus, const std::string& exponent) {
  if (modulus.size() > kMostRsa_bits / 8 || exponent.size() > 8) return nullptr;
  const BigNumber n = NumberOf(modulus), e = NumberOf(exponent);
  if (n == nullptr || e == nullptr || BN_num_bits(n.get()) < kLeastRsa_bits || !BN_is_odd(n.get()) ||
      !BN_is_odd(e.get()) || BN_is_one(e.get()) || BN_num_bits(e.get()) > kMostExponent_bits)
    return nullptr;
  const Builder builder(OSSL_PARAM_BLD_new());
  if (builder == nullptr || OSSL_PARAM_BLD_push_BN(builder.get(), OSSL_PKEY_PARAM_RSA_N, n.get()) != 1 ||
      OSSL_PARAM_BLD_push_BN(builder.get(), OSSL_PKEY_PARAM_RSA_E, e.get()) != 1)
    return nullptr;
  const Parameters parameters(OSSL_PARAM_BLD_to_param(builder.get()));
  return KeyOf("RSA", parameters.get());
}

Key EcKeyOf(const std::string& x, const std::string& y) {
  if (x.size() != kCoordinate_bytes || y.size() != kCoordinate_bytes) return nullptr;
  const std::string point = "\x04" + x + y;
  const Builder builder(OSSL_PARAM_BLD_new());
  if (builder == nullptr ||
      OSSL_PARAM_BLD_push_utf8_string(builder.get(), OSSL_PKEY_PARAM_GROUP_NAME, "prime256v1", 0) != 1 ||
      OSSL_PARAM_BLD_push_octet_string(builder.get(), OSSL_PKEY_PARAM_PUB_KEY, point.data(), point.size()) != 1)
    return nullptr;
  const Parameters parameters(OSSL_PARAM_BLD_to_param(builder.get()));
  Key key = KeyOf("EC", parameters.get());
  const Context check(key == nullptr ? nullptr : EVP_PKEY_CTX_new_from_pkey(nullptr, key.get(), nullptr));
  if (check == nullptr || EVP_PKEY_public_check(check.get()) != 1) return nullptr;  // on its curve
  return key;
}

std::optional<std::string> BytesIn(const json& object, const char* name) {
  const std::optional<std::string> text = TextIn(object, name);
  return text ? FromBase64Url(*text) : std::nullopt;
}

// None of a key that cannot sign tokens here.
std::optional<ProviderKey> ProviderKeyOf(const json& member) {
  if (!member.is_object()) return std::nullopt;
  for (const char* name : {"kid", "alg", "use"})
    if (member.contains(name) && !TextIn(member, name)) return std::nullopt;
  ProviderKey key{TextIn(member, "kid").value_or(""), TextIn(member, "alg").value_or(""), nullptr};
  if (key.id.size() > kLongestId_bytes || TextIn(member, "use").value_or("sig") != "sig") return std::nullopt;
  const std::string kind = TextIn(member, "kty").value_or("");
  if (kind == "RSA") {
    const auto n = BytesIn(member, "n"), e = BytesIn(member, "e");
    if (n && e) key.key = RsaKeyOf(*n, *e);
  } else if (kind == "EC" && TextIn(member, "crv") == "P-256") {
    const auto x = BytesIn(member, "x"), y = BytesIn(member, "y");
    if (x && y) key.key = EcKeyOf(*x, *y);
  }
  if (key.key == nullptr) return std::nullopt;
  return key;
}

}  // namespace

KeySet::KeySet(std::unique_ptr<Keys> keys) : keys_(std::move(keys)) {}
KeySet::KeySet(KeySet&&) noexcept = default;
KeySet& KeySet::operator=(KeySet&&) noexcept = default;
KeySet::~KeySet() = default;

absl::StatusOr<KeySet> KeySet::Read(std::string_view text) {
  const OwnErrors errors;
  constexpr char kWanted[] = "a JSON Web Key Set (RFC 7517) of at most 256 KiB and 100 keys";
  if (text.size() > kLongestKeySet_bytes) return Refuse("keys", std::to_string(text.size()) + " bytes", kWanted);
  const std::optional<json> set = StrictJsonOf(text);
  if (!set || !set->is_object() || !set->contains("keys") || !set->at("keys").is_array() ||
      set->at("keys").size() > kMostKeys)
    return Refuse("keys", "something else", kWanted);
  auto keys = std::make_unique<Keys>();
  for (const json& member : set->at("keys"))
    if (std::optional<ProviderKey> key = ProviderKeyOf(member)) keys->keys.push_back(*std::move(key));
  if (keys->keys.empty()) return Refuse("keys", "none for a signature", "RSA of 2048 to 8192 bits, or EC P-256");
  return KeySet(std::move(keys));
}

}  // namespace sixpoint::identity
