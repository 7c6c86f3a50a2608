// The sealed bytes: version (1), nonce (12), ciphertext, tag (16). AES-256-GCM under a key made from the code by HKDF-SHA256; its
// additional data are kLabel and the version. The plain bytes: length (4, big-endian) and text of identity.pem, the same of
// authority.pem, and zeros up to a multiple of kStep_bytes, so that the size says nothing of whose they are.
#include "identity/sealed_credentials.h"

#include <openssl/core_names.h>
#include <openssl/kdf.h>
#include <openssl/params.h>
#include <openssl/rand.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>

#include "identity/authority_folder.h"
#include "identity/certificates.h"
#include "refusal/refusal.h"

namespace sixpoint::identity {
namespace {

constexpr char kSealVersion = 1;
constexpr std::string_view kLabel = "sixpoint sealed credentials";
// Each use its own, so that who knows the pickup id knows nothing of the key.
constexpr std::string_view kPickupUse = "sixpoint sealed credentials 1: pickup id",
                           kKeyUse = "sixpoint sealed credentials 1: key";
constexpr std::size_t kNonce_bytes = 12, kTag_bytes = 16, kLength_bytes = 4, kStep_bytes = 4096;
constexpr std::size_t kAround_bytes = 1 + kNonce_bytes + kTag_bytes;
constexpr std::size_t kMostIdentity_bytes = kMostKey_bytes + kMostCertificate_bytes;

constexpr std::size_t Padded(std::size_t size) { return (size + kStep_bytes - 1) / kStep_bytes * kStep_bytes; }
static_assert(kAround_bytes + Padded(2 * kLength_bytes + kMostIdentity_bytes + kMostCertificate_bytes) <=
              kGreatestSealed_bytes);

constexpr std::string_view kBase32Letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZ234567";
constexpr std::size_t kCode_letters = 26, kGroup_letters = 4, kLongestTyped = 256;
constexpr char kCodeField[] = "--code";
constexpr char kWantedCode[] = "the 26 letters and digits (A to Z, 2 to 7) of the code that was said";

// Bytes that are wiped when they go.
template <std::size_t kSize>
struct Secret {
  std::array<unsigned char, kSize> bytes{};
  Secret() = default;
  Secret(const Secret&) = default;
  Secret& operator=(const Secret&) = default;
  ~Secret() { OPENSSL_cleanse(bytes.data(), kSize); }
};
using Code = Secret<16>;
using Derived = Secret<32>;

// A text likewise; of a size that it keeps, for a longer one would leave a copy behind.
struct SecretText {
  explicit SecretText(std::size_t size) : text(size, '\0') {}
  SecretText(SecretText&& other) noexcept : text(std::exchange(other.text, {})) {}
  SecretText(const SecretText&) = delete;
  SecretText& operator=(const SecretText&) = delete;
  ~SecretText() { OPENSSL_cleanse(text.data(), text.size()); }
  std::string text;
};

using Kdf = std::unique_ptr<EVP_KDF, FreedBy<EVP_KDF_free>>;
using Derivation = std::unique_ptr<EVP_KDF_CTX, FreedBy<EVP_KDF_CTX_free>>;
using Cipher = std::unique_ptr<EVP_CIPHER_CTX, FreedBy<EVP_CIPHER_CTX_free>>;

unsigned char* Bytes(char* text) { return reinterpret_cast<unsigned char*>(text); }
const unsigned char* Bytes(const char* text) { return reinterpret_cast<const unsigned char*>(text); }

// 26 letters of 5 bits for 128: the last letter's lowest two are zero.
std::string CodeText(const Code& code) {
  std::string text;
  for (std::size_t letter = 0; letter < kCode_letters; ++letter) {
    std::size_t value = 0;
    for (std::size_t bit = 5 * letter; bit < 5 * letter + 5; ++bit) {
      const bool is_set = bit / 8 < code.bytes.size() && (code.bytes[bit / 8] >> (7 - bit % 8) & 1) != 0;
      value = value << 1 | (is_set ? 1 : 0);
    }
    if (letter > 0 && letter % kGroup_letters == 0) text += '-';
    text += kBase32Letters[value];
  }
  return text;
}

// How many bytes there stand for nothing: a space or a dash, or what a text processor makes of one.
std::size_t SeparatorAt(std::string_view text) {
  if (std::string_view(" \t\r\n-").find(text[0]) != std::string_view::npos) return 1;
  for (const std::string_view other : {"\xc2\xa0", "\xe2\x80\x90", "\xe2\x80\x91", "\xe2\x80\x92", "\xe2\x80\x93",
                                       "\xe2\x80\x94", "\xe2\x80\x95", "\xe2\x88\x92"})
    if (text.substr(0, other.size()) == other) return other.size();
  return 0;
}

std::optional<std::size_t> LetterValue(char letter) {
  if (letter >= 'a' && letter <= 'z') letter = static_cast<char>(letter - 'a' + 'A');
  for (const auto& [typed, meant] : {std::pair{'0', 'O'}, {'1', 'I'}, {'8', 'B'}})
    if (letter == typed) letter = meant;
  const std::size_t at = kBase32Letters.find(letter);
  return at == std::string_view::npos ? std::nullopt : std::optional(at);
}

absl::StatusOr<Code> CodeOf(std::string_view typed) {
  // What was typed is not shown again: it may be nearly right, and end in a log.
  if (typed.size() > kLongestTyped) return Refuse(kCodeField, "longer", kWantedCode);
  Code code;
  std::size_t letters = 0;
  bool fits = true;
  while (!typed.empty()) {
    if (const std::size_t skipped = SeparatorAt(typed); skipped > 0) {
      typed.remove_prefix(skipped);
      continue;
    }
    const std::optional<std::size_t> value = LetterValue(typed[0]);
    if (!value) return Refuse(kCodeField, "with a character that no code has", kWantedCode);
    for (std::size_t i = 0, bit = 5 * letters; i < 5 && letters < kCode_letters; ++i, ++bit) {
      if ((*value >> (4 - i) & 1) == 0) continue;
      if (bit / 8 < code.bytes.size())
        code.bytes[bit / 8] = static_cast<unsigned char>(code.bytes[bit / 8] | 0x80 >> bit % 8);
      else
        fits = false;
    }
    ++letters;
    typed.remove_prefix(1);
  }
  if (letters != kCode_letters) return Refuse(kCodeField, std::to_string(letters) + " of them", kWantedCode);
  // One code, one way to write it.
  if (!fits) return Refuse(kCodeField, "with a last letter that no code has", kWantedCode);
  return code;
}

// HKDF-SHA256 (RFC 5869) without a salt: the code is random throughout.
absl::StatusOr<Derived> Derive(const Code& code, std::string_view use) {
  const Kdf kdf(EVP_KDF_fetch(nullptr, OSSL_KDF_NAME_HKDF, nullptr));
  const Derivation derivation(kdf == nullptr ? nullptr : EVP_KDF_CTX_new(kdf.get()));
  Code key = code;
  std::string digest = "SHA256", info(use);
  const OSSL_PARAM parameters[] = {
      OSSL_PARAM_construct_utf8_string(OSSL_KDF_PARAM_DIGEST, digest.data(), 0),
      OSSL_PARAM_construct_octet_string(OSSL_KDF_PARAM_KEY, key.bytes.data(), key.bytes.size()),
      OSSL_PARAM_construct_octet_string(OSSL_KDF_PARAM_INFO, info.data(), info.size()), OSSL_PARAM_construct_end()};
  Derived derived;
  if (derivation == nullptr ||
      EVP_KDF_derive(derivation.get(), derived.bytes.data(), derived.bytes.size(), parameters) != 1)
    return OpenSslError("a key from a code");
  return derived;
}

absl::StatusOr<std::string> PickupIdOfCode(const Code& code) {
  const absl::StatusOr<Derived> id = Derive(code, kPickupUse);
  if (!id.ok()) return id.status();
  return HexOf(std::string_view(reinterpret_cast<const char*>(id->bytes.data()), id->bytes.size()));
}

// Key, nonce and additional data, for either direction.
absl::StatusOr<Cipher> Begun(const Derived& key, const char* nonce, bool encrypts) {
  Cipher cipher(EVP_CIPHER_CTX_new());
  const std::string additional = std::string(kLabel) + kSealVersion;
  int size = 0;
  if (cipher == nullptr ||
      EVP_CipherInit_ex2(cipher.get(), EVP_aes_256_gcm(), key.bytes.data(), Bytes(nonce), encrypts ? 1 : 0, nullptr) !=
          1 ||
      EVP_CipherUpdate(cipher.get(), nullptr, &size, Bytes(additional.data()), static_cast<int>(additional.size())) !=
          1)
    return OpenSslError("AES-256-GCM");
  return cipher;
}

absl::StatusOr<std::string> Encrypted(const Derived& key, const std::string& plain) {
  std::string sealed(kAround_bytes + plain.size(), kSealVersion);
  char* const nonce = sealed.data() + 1;
  char* const text = nonce + kNonce_bytes;
  char* const tag = text + plain.size();
  if (RAND_bytes(Bytes(nonce), kNonce_bytes) != 1) return OpenSslError("a nonce");
  const absl::StatusOr<Cipher> cipher = Begun(key, nonce, true);
  if (!cipher.ok()) return cipher.status();
  int size = 0, rest = 0;
  if (EVP_CipherUpdate(cipher->get(), Bytes(text), &size, Bytes(plain.data()), static_cast<int>(plain.size())) != 1 ||
      EVP_CipherFinal_ex(cipher->get(), Bytes(text) + size, &rest) != 1 ||
      EVP_CIPHER_CTX_ctrl(cipher->get(), EVP_CTRL_AEAD_GET_TAG, kTag_bytes, tag) != 1)
    return OpenSslError("AES-256-GCM");
  return sealed;
}

absl::Status CheckFrame(const std::string& sealed) {
  if (sealed.size() > kGreatestSealed_bytes) return Refuse("sealed", "longer", "at most 64 KiB");
  if (sealed.size() <= kAround_bytes) return Refuse("sealed", "cut off", "the bytes that were sealed, whole");
  if (sealed[0] != kSealVersion)
    return Refuse("sealed", "of version " + std::to_string(static_cast<unsigned char>(sealed[0])), "1");
  return absl::OkStatus();
}

// Of bytes that passed CheckFrame.
absl::StatusOr<SecretText> Decrypted(const Derived& key, const std::string& sealed) {
  const char* const nonce = sealed.data() + 1;
  const char* const text = nonce + kNonce_bytes;
  const std::size_t text_bytes = sealed.size() - kAround_bytes;
  std::string tag = sealed.substr(sealed.size() - kTag_bytes);
  const absl::StatusOr<Cipher> cipher = Begun(key, nonce, false);
  if (!cipher.ok()) return cipher.status();
  SecretText plain(text_bytes);
  int size = 0, rest = 0;
  // Whether the tag is right is known at the end only, and nothing is looked at before.
  if (EVP_CipherUpdate(cipher->get(), Bytes(plain.text.data()), &size, Bytes(text), static_cast<int>(text_bytes)) !=
          1 ||
      EVP_CIPHER_CTX_ctrl(cipher->get(), EVP_CTRL_AEAD_SET_TAG, kTag_bytes, tag.data()) != 1)
    return OpenSslError("AES-256-GCM");
  if (EVP_CipherFinal_ex(cipher->get(), Bytes(plain.text.data()) + size, &rest) != 1)
    return Refuse(kCodeField, "does not open these credentials", "the code that was said of them, and them unchanged");
  return plain;
}

void PutText(char** at, const std::string& text) {
  for (std::size_t i = 0; i < kLength_bytes; ++i)
    *(*at)++ = static_cast<char>(text.size() >> (8 * (kLength_bytes - 1 - i)) & 0xff);
  *at = std::copy(text.begin(), text.end(), *at);
}

std::optional<std::string> TakeText(std::string_view* from) {
  if (from->size() < kLength_bytes) return std::nullopt;
  std::size_t size = 0;
  for (std::size_t i = 0; i < kLength_bytes; ++i) size = size << 8 | static_cast<unsigned char>((*from)[i]);
  from->remove_prefix(kLength_bytes);
  if (size > from->size()) return std::nullopt;
  std::string text(from->substr(0, size));
  from->remove_prefix(size);
  return text;
}

// A key, its own certificate, and the authority that gave it: what whoever takes them can use.
absl::Status CheckCredentials(const Credentials& credentials) {
  if (credentials.identity_pem.size() > kMostIdentity_bytes) return Refuse(kIdentityFile, "longer", "at most 32 KiB");
  if (credentials.authority_pem.size() > kMostCertificate_bytes)
    return Refuse(kAuthorityFile, "longer", "at most 16 KiB");
  const absl::StatusOr<OwnKey> own = OwnKeyOf(credentials.identity_pem);
  if (!own.ok()) return InFile(kIdentityFile, own.status());
  X509* const certificate = own->certificate.get();
  if (const auto names = IssuedOf(certificate); !names.ok()) return InFile(kIdentityFile, names.status());
  const absl::StatusOr<Certificate> authority = CertificateOfPem(credentials.authority_pem);
  const absl::Status right = authority.ok() ? CheckAuthority(authority->get()) : authority.status();
  if (!right.ok()) return InFile(kAuthorityFile, right);
  return InFile(kIdentityFile, CheckGivenBy(certificate, authority->get()));
}

}  // namespace

absl::StatusOr<SealedCredentials> Seal(const Credentials& credentials) {
  const OwnErrors errors;
  if (absl::Status right = CheckCredentials(credentials); !right.ok()) return right;
  SecretText plain(Padded(2 * kLength_bytes + credentials.identity_pem.size() + credentials.authority_pem.size()));
  char* at = plain.text.data();
  PutText(&at, credentials.identity_pem);
  PutText(&at, credentials.authority_pem);
  Code code;
  if (RAND_priv_bytes(code.bytes.data(), static_cast<int>(code.bytes.size())) != 1) return OpenSslError("a code");
  const absl::StatusOr<Derived> key = Derive(code, kKeyUse);
  if (!key.ok()) return key.status();
  absl::StatusOr<std::string> pickup_id = PickupIdOfCode(code), sealed = Encrypted(*key, plain.text);
  if (!pickup_id.ok()) return pickup_id.status();
  if (!sealed.ok()) return sealed.status();
  return SealedCredentials{CodeText(code), *std::move(pickup_id), *std::move(sealed)};
}

absl::StatusOr<std::string> PickupIdOf(const std::string& code) {
  const OwnErrors errors;
  const absl::StatusOr<Code> read = CodeOf(code);
  if (!read.ok()) return read.status();
  return PickupIdOfCode(*read);
}

absl::StatusOr<Credentials> Unseal(const std::string& code, const std::string& sealed) {
  const OwnErrors errors;
  const absl::StatusOr<Code> read = CodeOf(code);
  if (!read.ok()) return read.status();
  if (absl::Status whole = CheckFrame(sealed); !whole.ok()) return whole;
  const absl::StatusOr<Derived> key = Derive(*read, kKeyUse);
  if (!key.ok()) return key.status();
  const absl::StatusOr<SecretText> plain = Decrypted(*key, sealed);
  if (!plain.ok()) return plain.status();
  std::string_view left = plain->text;
  std::optional<std::string> identity_pem = TakeText(&left), authority_pem = TakeText(&left);
  const bool is_whole = identity_pem && authority_pem && left.find_first_not_of('\0') == std::string_view::npos;
  if (!is_whole) return Refuse("sealed", "holds something else", "credentials");
  Credentials credentials{*std::move(identity_pem), *std::move(authority_pem)};
  if (absl::Status right = CheckCredentials(credentials); !right.ok()) return right;
  return credentials;
}

}  // namespace sixpoint::identity
