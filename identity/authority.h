// A plant's own certificate authority: a key in a folder that only its owner reads, the certificates that it gave, and those that
// it took back. X.509 v3 with EC P-256 keys, and a certificate revocation list (RFC 5280), so that any tool reads them.
#pragma once

#include <absl/status/statusor.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "identity/credentials.h"
#include "identity/identity.h"

namespace sixpoint::identity {

struct CertificateWish {
  Identity identity;
  // Of a service alone, 1 to 16: the names and addresses by which clients reach it.
  std::vector<std::string> hosts;
  std::chrono::hours valid_for{24 * 30};  // 1 hour to 397 days; never beyond the authority's own end
};

// Not thread-safe; two processes at once take turns (a lock of the folder).
class Authority {
 public:
  // Key, certificate (for forty years) and an empty revocation list. ALREADY_EXISTS where there is one: a new one would make every
  // certificate worthless. `plant`: its name in the certificate, 1 to 64 printable characters.
  static absl::Status Create(const std::filesystem::path& folder, const std::string& plant);
  // NOT_FOUND where there is none; PERMISSION_DENIED where others than its owner may read the key.
  static absl::StatusOr<Authority> Open(const std::filesystem::path& folder);

  absl::StatusOr<Credentials> Issue(const CertificateWish& wish);
  // A new certificate (in PEM, alone) of the same identity, hosts and public key as that one, which stays good until its own end: its
  // holder keeps his key and shows it to nobody. FAILED_PRECONDITION of one that was taken back or has expired, NOT_FOUND of a serial
  // that it never gave.
  absl::StatusOr<std::string> Renew(const std::string& serial, std::chrono::hours valid_for);
  // One that it gave, as it gave it. NOT_FOUND of a serial that it never gave.
  absl::StatusOr<std::string> CertificatePemOf(const std::string& serial) const;
  // Newest first, renewals among them: of one person's or machine's, all are to be taken back.
  absl::StatusOr<std::vector<IssuedCertificate>> Issued() const;
  // NOT_FOUND of a serial that it never gave. Once more: nothing changes.
  absl::Status Revoke(const std::string& serial);

  // Its certificate, and its signed revocation list, as they are now.
  absl::StatusOr<std::string> CertificatePem() const;
  absl::StatusOr<std::string> RevokedPem() const;

 private:
  explicit Authority(std::filesystem::path folder) : folder_(std::move(folder)) {}
  std::filesystem::path folder_;
};

}  // namespace sixpoint::identity
