// A plant's certificates, made and read: the authority's own, and those that it gives. Private to the room, but OwnKeyOf, for
// whoever serves by such a file.
#pragma once

#include <absl/status/statusor.h>

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "identity/credentials.h"
#include "identity/identity.h"
#include "identity/openssl_objects.h"

namespace sixpoint::identity {

inline constexpr std::size_t kMostCertificate_bytes = 16 * 1024, kMostKey_bytes = 16 * 1024;

struct Span {
  TimePoint not_before, not_after;
};

struct AuthorityKey {
  Key key;
  Certificate certificate;
};

// What an identity.pem holds: a key, and its own certificate.
struct OwnKey {
  Key key;
  Certificate certificate;
};
// Misread where it holds anything else, or a certificate of another key. Of a text that is bounded already.
absl::StatusOr<OwnKey> OwnKeyOf(std::string_view identity_pem);

// Signed by its own key; gives no authority to others.
absl::StatusOr<Certificate> NewAuthorityCertificate(EVP_PKEY* key, const std::string& plant, const Span& valid);
// Of what is valid: `identity` and `hosts` were checked.
absl::StatusOr<Certificate> NewCertificate(const AuthorityKey& authority, EVP_PKEY* key, const Identity& identity,
                                           const std::vector<std::string>& hosts, const Span& valid);

// A DNS name or an address, as a certificate can hold it.
bool IsHost(const std::string& host);

// Misread where it is not the certificate of an authority.
absl::Status CheckAuthority(X509* certificate);
// Misread where that authority did not sign it, whatever it is and whenever.
absl::Status CheckGivenBy(X509* certificate, X509* authority);
// The plant's name in its authority's certificate; empty where there is none.
std::string PlantOf(X509* authority);

absl::StatusOr<Span> ValidityOf(const X509* certificate);
absl::StatusOr<std::string> SerialOf(const X509* certificate);

struct AlternativeNames {
  std::vector<std::string> uris, hosts;  // byte by byte as they stand there; addresses as text
};
// None where there are none.
absl::StatusOr<AlternativeNames> AlternativeNamesOf(const X509* certificate);

// Misread where it names nobody. Whether it was taken back it does not know.
absl::StatusOr<IssuedCertificate> IssuedOf(const X509* certificate);

}  // namespace sixpoint::identity
