// How a machine or a program that has a certificate, and reaches the plant by HTTP alone, says who it is: a JSON Web Token (RFC 7519)
// that it signs with the certificate's own key, so that whatever makes such tokens makes these.
//   header   {"alg": "ES256", "typ": "JWT", "x5c": ["base64 of the certificate's DER"]}        (RFC 7515, 4.1.6)
//   claims   {"aud": "sixpoint", "iat": seconds since 1970, "exp": the same, at most 15 minutes after iat}
// The gateway sends it on as it does a person's session (session.h), and each service judges the certificate in it as if it had been shown:
// one that was taken back counts no more at the next call, and the gateway can be nobody by itself.
#pragma once

#include <absl/status/statusor.h>

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "identity/credentials.h"

namespace sixpoint::identity {

struct CertificateToken {
  std::string certificate_pem;
  TimePoint since, until;  // iat and exp
};

// By the key of such a file (credentials.h); whole seconds are kept. INVALID_ARGUMENT of more than 15 minutes.
absl::StatusOr<std::string> SignCertificateToken(const std::filesystem::path& identity_file, TimePoint since,
                                                 TimePoint until);

// What begins as a JSON Web Token does.
bool IsCertificateToken(std::string_view token);
// None of a text that is no such token, or that another key signed. Whether certificate and times count is not asked.
std::optional<CertificateToken> ReadCertificateToken(std::string_view token);

}  // namespace sixpoint::identity
