// What somebody needs to be known by the plant, and to know it: a folder with two files.
//   identity.pem   key and certificate in one file, so that whoever reads it finds the two that belong together; 0600
//   authority.pem  the authority's certificate
#pragma once

#include <absl/status/statusor.h>

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "identity/identity.h"

namespace sixpoint::identity {

using TimePoint = std::chrono::system_clock::time_point;

inline constexpr char kIdentityFile[] = "identity.pem";
inline constexpr char kAuthorityFile[] = "authority.pem";
struct Credentials {
  std::string identity_pem, authority_pem;
};

struct IssuedCertificate {
  std::string serial;  // lower-case hexadecimal, as openssl prints it
  Identity identity;
  std::vector<std::string> hosts;
  TimePoint not_before, not_after;
  std::optional<TimePoint> revoked_at;
  std::string
      public_key_sha256;  // of SubjectPublicKeyInfo, in lower-case hexadecimal: a renewal's is that of the one before
};

// The folder is made where it is missing (0700); each file is replaced whole.
absl::Status WriteCredentials(const std::filesystem::path& folder, const Credentials& credentials);

// Whose a certificate is, and until when; whether it counts is Trust's to say. INVALID_ARGUMENT of what is none, or names nobody.
absl::StatusOr<IssuedCertificate> CertificateOf(const std::string& pem);

// Of a credentials folder's own certificate: whose it is, and until when. NOT_FOUND where there is none.
absl::StatusOr<IssuedCertificate> ReadCertificate(const std::filesystem::path& identity_file);

// Whose the texts of such a folder's two files are: INVALID_ARGUMENT where the key is another certificate's, or the authority did not
// give it. Of time and revocation it says nothing.
absl::StatusOr<IssuedCertificate> CheckBelongTogether(const Credentials& credentials);

// Puts a renewed certificate in the place of the one there, beside the key that stays. The file is replaced whole, 0600, and remains
// its owner's; it is no link. INVALID_ARGUMENT of a certificate of another key or identity, of one that ends earlier than the one
// there, and of one that the authority.pem of the same folder, where there is one, did not sign; NOT_FOUND where no file is.
absl::Status ReplaceCertificate(const std::filesystem::path& identity_file, const std::string& certificate_pem);

}  // namespace sixpoint::identity
