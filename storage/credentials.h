// Credentials that wait for their holders (V0015).
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>
#include <vector>

#include "storage/database.h"

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

}  // namespace sixpoint::storage
