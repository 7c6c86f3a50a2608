#include "identity/signatures.h"

#include <openssl/ec.h>
#include <openssl/ecdsa.h>
#include <openssl/rsa.h>

#include <array>
#include <cstring>
#include <memory>

namespace sixpoint::identity {
namespace {

using Digest = std::unique_ptr<EVP_MD_CTX, FreedBy<EVP_MD_CTX_free>>;
using Ecdsa = std::unique_ptr<ECDSA_SIG, FreedBy<ECDSA_SIG_free>>;

constexpr std::size_t kHalf_bytes = 32;
constexpr int kPssSalt_bytes = 32;
// The order of P-256 (SEC 2, 2.4.2).
constexpr char kOrder[] = "FFFFFFFF00000000FFFFFFFFFFFFFFFFBCE6FAADA7179E84F3B9CAC2FC632551";

const unsigned char* Bytes(std::string_view text) { return reinterpret_cast<const unsigned char*>(text.data()); }

BigNumber Order() {
  BIGNUM* order = nullptr;
  BN_hex2bn(&order, kOrder);
  return BigNumber(order);
}

// Whether s is in the upper half.
bool IsGreater(const BIGNUM* s, const BIGNUM* order) {
  const BigNumber half(BN_new());
  return half == nullptr || BN_rshift1(half.get(), order) != 1 || BN_cmp(s, half.get()) > 0;
}

}  // namespace

bool IsP256(const EVP_PKEY* key) {
  std::array<char, 64> group{};
  std::size_t size = 0;
  return EVP_PKEY_is_a(key, "EC") == 1 &&
         EVP_PKEY_get_group_name(const_cast<EVP_PKEY*>(key), group.data(), group.size(), &size) == 1 &&
         std::strcmp(group.data(), "prime256v1") == 0;
}

bool IsRsa(const EVP_PKEY* key) { return EVP_PKEY_is_a(key, "RSA") == 1; }

absl::StatusOr<std::string> SignEs256(EVP_PKEY* key, std::string_view text) {
  if (!IsP256(key)) return Misread("a key of another kind", "one of EC P-256");
  const Digest digest(EVP_MD_CTX_new());
  std::array<unsigned char, 128> der{};
  std::size_t size = der.size();
  if (digest == nullptr || EVP_DigestSignInit(digest.get(), nullptr, EVP_sha256(), nullptr, key) != 1 ||
      EVP_DigestSign(digest.get(), der.data(), &size, Bytes(text), text.size()) != 1)
    return OpenSslError("a signature");
  const unsigned char* at = der.data();
  const Ecdsa pair(d2i_ECDSA_SIG(nullptr, &at, static_cast<long>(size)));
  const BigNumber order = Order(), s(pair == nullptr ? nullptr : BN_dup(ECDSA_SIG_get0_s(pair.get())));
  std::string raw(2 * kHalf_bytes, '\0');
  auto* const out = reinterpret_cast<unsigned char*>(raw.data());
  if (order == nullptr || s == nullptr ||
      (IsGreater(s.get(), order.get()) && BN_sub(s.get(), order.get(), s.get()) != 1) ||
      BN_bn2binpad(ECDSA_SIG_get0_r(pair.get()), out, kHalf_bytes) < 0 ||
      BN_bn2binpad(s.get(), out + kHalf_bytes, kHalf_bytes) < 0)
    return OpenSslError("a signature");
  return raw;
}

bool VerifiesEs256(EVP_PKEY* key, std::string_view text, std::string_view signature, EitherS either) {
  if (!IsP256(key) || signature.size() != 2 * kHalf_bytes) return false;
  BigNumber r(BN_bin2bn(Bytes(signature), kHalf_bytes, nullptr));
  BigNumber s(BN_bin2bn(Bytes(signature) + kHalf_bytes, kHalf_bytes, nullptr));
  const BigNumber order = Order();
  const Ecdsa pair(ECDSA_SIG_new());
  if (r == nullptr || s == nullptr || order == nullptr || pair == nullptr) return false;
  if (either == EitherS::kLesserOnly && IsGreater(s.get(), order.get())) return false;
  if (ECDSA_SIG_set0(pair.get(), r.get(), s.get()) != 1) return false;
  r.release();  // the pair's own now
  s.release();
  unsigned char* der = nullptr;
  const int size = i2d_ECDSA_SIG(pair.get(), &der);
  if (size <= 0) return false;
  const Digest digest(EVP_MD_CTX_new());
  const bool holds = digest != nullptr &&
                     EVP_DigestVerifyInit(digest.get(), nullptr, EVP_sha256(), nullptr, key) == 1 &&
                     EVP_DigestVerify(digest.get(), der, static_cast<std::size_t>(size), Bytes(text), text.size()) == 1;
  OPENSSL_free(der);
  return holds;
}

bool VerifiesRsa(EVP_PKEY* key, RsaPadding padding, std::string_view text, std::string_view signature) {
  if (!IsRsa(key)) return false;
  const Digest digest(EVP_MD_CTX_new());
  EVP_PKEY_CTX* context = nullptr;  // the digest's
  if (digest == nullptr || EVP_DigestVerifyInit(digest.get(), &context, EVP_sha256(), nullptr, key) != 1) return false;
  const bool is_pss = padding == RsaPadding::kPss;
  if (EVP_PKEY_CTX_set_rsa_padding(context, is_pss ? RSA_PKCS1_PSS_PADDING : RSA_PKCS1_PADDING) != 1) return false;
  if (is_pss && (EVP_PKEY_CTX_set_rsa_pss_saltlen(context, kPssSalt_bytes) != 1 ||
                 EVP_PKEY_CTX_set_rsa_mgf1_md(context, EVP_sha256()) != 1))
    return false;
  return EVP_DigestVerify(digest.get(), Bytes(signature), signature.size(), Bytes(text), text.size()) == 1;
}

}  // namespace sixpoint::identity
