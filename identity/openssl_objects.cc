#include "identity/openssl_objects.h"

#include <openssl/ec.h>
#include <openssl/err.h>
#include <openssl/pem.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <utility>
#include <vector>

#include "refusal/refusal.h"

namespace sixpoint::identity {
namespace {

constexpr int kSerialBits = 128;

struct FreeText {
  void operator()(char* text) const { OPENSSL_free(text); }
};

// One block of a PEM text: "CERTIFICATE" and its bytes, wiped when they go: some are a key's.
class PemBlock {
 public:
  PemBlock() = default;
  ~PemBlock() {
    OPENSSL_free(name_);
    OPENSSL_free(header_);
    OPENSSL_clear_free(bytes_, static_cast<std::size_t>(size_));
  }
  PemBlock(const PemBlock&) = delete;
  PemBlock& operator=(const PemBlock&) = delete;

  enum class Found { kBlock, kEnd, kGarbage };
  Found Read(BIO* from) {
    if (PEM_read_bio(from, &name_, &header_, &bytes_, &size_) == 1) return Found::kBlock;
    return ERR_GET_REASON(ERR_peek_last_error()) == PEM_R_NO_START_LINE ? Found::kEnd : Found::kGarbage;
  }
  bool Is(const char* name) const { return std::string_view(name_) == name; }
  bool IsKey() const { return Is(PEM_STRING_PKCS8INF) || Is(PEM_STRING_ECPRIVATEKEY) || Is(PEM_STRING_RSA); }
  bool IsCertificate() const { return Is(PEM_STRING_X509); }
  bool plain() const { return *header_ == '\0'; }
  const unsigned char* bytes() const { return bytes_; }
  long size() const { return size_; }

 private:
  char* name_ = nullptr;
  char* header_ = nullptr;
  unsigned char* bytes_ = nullptr;
  long size_ = 0;
};

absl::StatusOr<Bio> Reading(std::string_view text) {
  Bio bio(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
  if (bio == nullptr) return OpenSslError("a text to read");
  return bio;
}

using BlockKind = bool (PemBlock::*)() const;

// The one object of that name in the text. `read`: d2i_X509 and the like. `beside`: what may stand there, too, once; nothing of null.
template <typename Owner, typename Read>
absl::StatusOr<Owner> OnlyOf(std::string_view pem, const char* name, const std::string& want, BlockKind beside,
                             Read read) {
  absl::StatusOr<Bio> bio = Reading(pem);
  if (!bio.ok()) return bio.status();
  Owner found;
  for (bool had_other = false;;) {
    PemBlock block;
    const PemBlock::Found next = block.Read(bio->get());
    if (next == PemBlock::Found::kEnd) break;
    if (next == PemBlock::Found::kGarbage || !block.plain()) return Misread("no PEM that can be read", want);
    if (beside != nullptr && (block.*beside)() && !std::exchange(had_other, true)) continue;
    if (!block.Is(name)) return Misread("holds something else", want);
    if (found != nullptr) return Misread("holds several", want);
    const unsigned char* at = block.bytes();
    found.reset(read(nullptr, &at, block.size()));
    if (found == nullptr || at != block.bytes() + block.size()) return Misread("cannot be read", want);
  }
  if (found == nullptr) return Misread("holds none", want);
  return found;
}

absl::StatusOr<std::string> TextOf(BIO* bio, bool written) {
  char* text = nullptr;
  const long size = written ? BIO_get_mem_data(bio, &text) : 0;
  if (size <= 0) return OpenSslError("a PEM text");
  return std::string(text, static_cast<std::size_t>(size));
}

}  // namespace

OwnErrors::OwnErrors() { ERR_set_mark(); }
OwnErrors::~OwnErrors() { ERR_pop_to_mark(); }

absl::Status OpenSslError(const std::string& what) {
  char text[256] = "no reason given";
  if (const unsigned long error = ERR_peek_last_error(); error != 0) ERR_error_string_n(error, text, sizeof text);
  return absl::InternalError(what + ": " + text);
}

absl::Status Misread(const std::string& what, const std::string& wanted) { return Refuse("", what, wanted); }

absl::StatusOr<Key> NewKey() {
  Key key(EVP_EC_gen("P-256"));
  if (key == nullptr) return OpenSslError("a new key");
  return key;
}

absl::StatusOr<std::string> PemOf(EVP_PKEY* key) {
  const Bio bio(BIO_new(BIO_s_secmem()));  // wiped when it goes
  return TextOf(bio.get(),
                bio != nullptr && PEM_write_bio_PrivateKey(bio.get(), key, nullptr, nullptr, 0, nullptr, nullptr) == 1);
}

absl::StatusOr<std::string> PemOf(X509* certificate) {
  const Bio bio(BIO_new(BIO_s_mem()));
  return TextOf(bio.get(), bio != nullptr && PEM_write_bio_X509(bio.get(), certificate) == 1);
}

absl::StatusOr<std::string> PemOf(X509_CRL* list) {
  const Bio bio(BIO_new(BIO_s_mem()));
  return TextOf(bio.get(), bio != nullptr && PEM_write_bio_X509_CRL(bio.get(), list) == 1);
}

absl::StatusOr<Key> KeyOfPem(std::string_view pem, bool beside_certificate) {
  return OnlyOf<Key>(
      pem, PEM_STRING_PKCS8INF, "one private key", beside_certificate ? &PemBlock::IsCertificate : nullptr,
      [](EVP_PKEY**, const unsigned char** at, long size) { return d2i_AutoPrivateKey(nullptr, at, size); });
}

absl::StatusOr<Certificate> CertificateOfPem(std::string_view pem, bool beside_key) {
  return OnlyOf<Certificate>(pem, PEM_STRING_X509, "one certificate", beside_key ? &PemBlock::IsKey : nullptr,
                             d2i_X509);
}

absl::StatusOr<SignedList> ListOfPem(std::string_view pem) {
  return OnlyOf<SignedList>(pem, PEM_STRING_X509_CRL, "one revocation list", nullptr, d2i_X509_CRL);
}

absl::StatusOr<Integer> NewSerial() {
  const BigNumber number(BN_new());
  if (number == nullptr || BN_rand(number.get(), kSerialBits, BN_RAND_TOP_ONE, BN_RAND_BOTTOM_ANY) != 1)
    return OpenSslError("a serial");
  Integer serial(BN_to_ASN1_INTEGER(number.get(), nullptr));
  if (serial == nullptr) return OpenSslError("a serial");
  return serial;
}

absl::StatusOr<std::string> HexOf(const ASN1_INTEGER* number) {
  const BigNumber value(ASN1_INTEGER_to_BN(number, nullptr));
  const std::unique_ptr<char, FreeText> text(value == nullptr ? nullptr : BN_bn2hex(value.get()));
  if (text == nullptr) return OpenSslError("a number");
  std::string hex = text.get();
  std::transform(hex.begin(), hex.end(), hex.begin(),
                 [](char c) { return c >= 'A' && c <= 'F' ? static_cast<char>(c - 'A' + 'a') : c; });
  return hex;
}

std::string HexOf(std::string_view bytes) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string hex;
  for (const char byte : bytes) {
    const auto value = static_cast<unsigned char>(byte);
    hex += {kDigits[value >> 4], kDigits[value & 0xf]};
  }
  return hex;
}

absl::StatusOr<Integer> NumberOfHex(const std::string& hex) {
  BIGNUM* number = nullptr;
  const int read = BN_hex2bn(&number, hex.c_str());
  const BigNumber value(number);
  Integer integer(read == static_cast<int>(hex.size()) && read > 0 ? BN_to_ASN1_INTEGER(number, nullptr) : nullptr);
  if (integer == nullptr) return OpenSslError("the number " + hex);
  return integer;
}

absl::StatusOr<Time> TimeOf(TimePoint time) {
  Time made(ASN1_TIME_set(nullptr, std::chrono::system_clock::to_time_t(time)));
  if (made == nullptr) return OpenSslError("a time");
  return made;
}

absl::StatusOr<TimePoint> TimePointOf(const ASN1_TIME* time) {
  std::tm utc{};
  if (time == nullptr || ASN1_TIME_to_tm(time, &utc) != 1) return Misread("no time", "one");
  using std::chrono::seconds;
  constexpr auto kGreatest = std::chrono::duration_cast<seconds>(TimePoint::max().time_since_epoch());
  constexpr auto kLeast = std::chrono::duration_cast<seconds>(TimePoint::min().time_since_epoch());
  return TimePoint(std::clamp(seconds(timegm(&utc)), kLeast, kGreatest));
}

std::string TimeText(TimePoint time) {
  const std::time_t seconds = std::chrono::duration_cast<std::chrono::seconds>(
                                  std::chrono::floor<std::chrono::seconds>(time).time_since_epoch())
                                  .count();
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  char text[80];
  std::snprintf(text, sizeof text, "%04d-%02d-%02dT%02d:%02d:%02dZ", utc.tm_year + 1900, utc.tm_mon + 1, utc.tm_mday,
                utc.tm_hour, utc.tm_min, utc.tm_sec);
  return text;
}

Certificate CertificateOfDer(const std::string& der) {
  const auto* at = reinterpret_cast<const unsigned char*>(der.data());
  const unsigned char* const end = at + der.size();
  Certificate certificate(d2i_X509(nullptr, &at, static_cast<long>(der.size())));
  return at == end ? std::move(certificate) : nullptr;
}

absl::StatusOr<std::string> DerOf(X509* certificate) {
  unsigned char* der = nullptr;
  const int size = i2d_X509(certificate, &der);
  if (size <= 0) return OpenSslError("a certificate");
  std::string bytes(reinterpret_cast<const char*>(der), static_cast<std::size_t>(size));
  OPENSSL_free(der);
  return bytes;
}

}  // namespace sixpoint::identity
