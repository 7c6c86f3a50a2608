// Credentials that wait for their holders (V0015).
#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "storage/database.h"
#include "storage/one_write.h"

namespace sixpoint::storage {

struct CredentialOffer {
  std::string pickup_sha256;  // lower-case hexadecimal
  std::string sealed, identity, offered_by;
  int valid_hours = 0;  // from now on, by the database's clock
};
// The same again changes nothing; when the one that is kept ends. Also forgets what is over. RESOURCE_EXHAUSTED: a thousand wait.
absl::StatusOr<Instant> KeepOffer(Transaction& transaction, const CredentialOffer& offer);
// Gone with the commit. None: nothing waits there, or no more.
absl::StatusOr<std::optional<CredentialOffer>> TakeOffer(Transaction& transaction, const std::string& pickup_sha256);

struct CertificateRenewal {
  std::string public_key_sha256;  // lower-case hexadecimal
  std::string serial, identity, certificate_pem;
  Instant not_after;
  std::string offered_by;
};
absl::Status KeepRenewal(Transaction& transaction, const CertificateRenewal& renewal);
// The ten that last longest, the longest first.
absl::StatusOr<std::vector<CertificateRenewal>> FindRenewals(Transaction& transaction,
                                                             const std::string& public_key_sha256);

// Credentials apart from where they wait, as the functions of these names, each all or nothing. PostgreSQL's and the tests' fake pass
// the same suite (tests/storage/credential_store_test.cc). Thread-safe. No call holds a connection after it returned.
class CredentialReader {
 public:
  virtual ~CredentialReader() = default;
  virtual absl::StatusOr<std::vector<CertificateRenewal>> FindRenewals(const std::string& public_key_sha256,
                                                                       Deadline deadline) const = 0;
};

class CredentialStore : public CredentialReader {
 public:
  virtual absl::StatusOr<Instant> KeepOffer(const CredentialOffer& offer, const StillWanted& still_wanted,
                                            Deadline deadline) = 0;
  // Of several at once one gets it; one that is wanted no more stays there.
  virtual absl::StatusOr<std::optional<CredentialOffer>> TakeOffer(const std::string& pickup_sha256,
                                                                   const StillWanted& still_wanted,
                                                                   Deadline deadline) = 0;
  // The same certificate again changes nothing.
  virtual absl::Status KeepRenewal(const CertificateRenewal& renewal, const StillWanted& still_wanted,
                                   Deadline deadline) = 0;
};

// In PostgreSQL; the database lives longer.
std::shared_ptr<CredentialStore> CredentialsIn(Database* database);

}  // namespace sixpoint::storage
