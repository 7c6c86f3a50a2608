// OpenSSL's objects as C++ owns them, its errors as ours, and its forms of text, time and number. Private to the room and
// to whoever uses OpenSSL beside it.
#pragma once

#include <absl/status/statusor.h>
#include <openssl/bio.h>
#include <openssl/bn.h>
#include <openssl/evp.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>

#include <chrono>
#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

namespace sixpoint::identity {

using TimePoint = std::chrono::system_clock::time_point;

template <auto Free>
struct FreedBy {
  template <typename Object>
  void operator()(Object* object) const {
    Free(object);
  }
};
using Key = std::unique_ptr<EVP_PKEY, FreedBy<EVP_PKEY_free>>;
using Certificate = std::unique_ptr<X509, FreedBy<X509_free>>;
using SignedList = std::unique_ptr<X509_CRL, FreedBy<X509_CRL_free>>;
using Bio = std::unique_ptr<BIO, FreedBy<BIO_free>>;
using BigNumber = std::unique_ptr<BIGNUM, FreedBy<BN_free>>;
using Integer = std::unique_ptr<ASN1_INTEGER, FreedBy<ASN1_INTEGER_free>>;
using Time = std::unique_ptr<ASN1_TIME, FreedBy<ASN1_TIME_free>>;
using Extension = std::unique_ptr<X509_EXTENSION, FreedBy<X509_EXTENSION_free>>;
using Names = std::unique_ptr<GENERAL_NAMES, FreedBy<GENERAL_NAMES_free>>;

// Leaves the thread's queue of errors as it was: gRPC takes what lies in it for its own connection's.
class OwnErrors {
 public:
  OwnErrors();
  ~OwnErrors();
  OwnErrors(const OwnErrors&) = delete;
  OwnErrors& operator=(const OwnErrors&) = delete;
};
// INTERNAL: what was tried, and what OpenSSL says of it.
absl::Status OpenSslError(const std::string& what);

absl::StatusOr<Key> NewKey();  // EC P-256
absl::StatusOr<std::string> PemOf(EVP_PKEY* key);
absl::StatusOr<std::string> PemOf(X509* certificate);
absl::StatusOr<std::string> PemOf(X509_CRL* list);
absl::StatusOr<std::string> DerOf(X509* certificate);
// Null of anything but one certificate's bytes.
Certificate CertificateOfDer(const std::string& der);

// What was read is not what it should be: a refusal without a field, which whoever knows where it stood gives it.
absl::Status Misread(const std::string& what, const std::string& wanted);

// Of a text that is bounded already.
// Nothing beside the key, or its certificate alone.
absl::StatusOr<Key> KeyOfPem(std::string_view pem, bool beside_certificate = false);
// Nothing beside the certificate, or its key alone.
absl::StatusOr<Certificate> CertificateOfPem(std::string_view pem, bool beside_key = false);
absl::StatusOr<SignedList> ListOfPem(std::string_view pem);

// 128 bits, the first of them one, so that all are as long in every tool.
absl::StatusOr<Integer> NewSerial();
// Lower-case hexadecimal, two digits a byte.
absl::StatusOr<std::string> HexOf(const ASN1_INTEGER* number);
std::string HexOf(std::string_view bytes);
absl::StatusOr<Integer> NumberOfHex(const std::string& hex);

absl::StatusOr<Time> TimeOf(TimePoint time);  // whole seconds
// The nearest that a TimePoint holds: certificates know the year 9999. Not OK of what is no time.
absl::StatusOr<TimePoint> TimePointOf(const ASN1_TIME* time);
// "2026-11-20T10:00:00Z"
std::string TimeText(TimePoint time);

}  // namespace sixpoint::identity
