// A CredentialStore in memory: what handlers are tested on without PostgreSQL. Held to the real one by
// tests/storage/credential_store_test.cc.
#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "storage/credentials.h"
#include "tests/support/fake_commits.h"

namespace sixpoint::testing {

class FakeCredentials final : public storage::CredentialStore {
 public:
  FakeCommits commits;

  // As if the offers had waited so much longer.
  void LetPass(std::chrono::hours time);

  absl::StatusOr<std::vector<storage::CertificateRenewal>> FindRenewals(const std::string& public_key_sha256,
                                                                        storage::Deadline) const override;
  absl::StatusOr<storage::Instant> KeepOffer(const storage::CredentialOffer& offer,
                                             const storage::StillWanted& still_wanted, storage::Deadline) override;
  absl::StatusOr<std::optional<storage::CredentialOffer>> TakeOffer(const std::string& pickup_sha256,
                                                                    const storage::StillWanted& still_wanted,
                                                                    storage::Deadline) override;
  absl::Status KeepRenewal(const storage::CertificateRenewal& renewal, const storage::StillWanted& still_wanted,
                           storage::Deadline) override;

 private:
  struct WaitingOffer {
    storage::CredentialOffer offer;
    storage::Instant ends;
  };

  std::map<std::string, WaitingOffer> offers_;                                           // by pickup_sha256
  std::map<std::pair<std::string, std::string>, storage::CertificateRenewal> renewals_;  // by public key and serial
};

}  // namespace sixpoint::testing
