#include "tests/support/fake_credentials.h"

#include <algorithm>

namespace sixpoint::testing {
namespace {

constexpr std::size_t kMostWaiting = 1000, kMostRenewals = 10;

storage::Instant CredentialsClock() {
  return std::chrono::floor<std::chrono::microseconds>(std::chrono::system_clock::now());
}

}  // namespace

void FakeCredentials::LetPass(std::chrono::hours time) {
  const auto lock = commits.Lock();
  for (auto& [pickup_sha256, waiting] : offers_) waiting.ends -= time;
}

absl::StatusOr<std::vector<storage::CertificateRenewal>> FakeCredentials::FindRenewals(
    const std::string& public_key_sha256, storage::Deadline) const {
  const auto lock = commits.Lock();
  if (!commits.failure().ok()) return commits.failure();
  std::vector<storage::CertificateRenewal> found;  // by serial
  for (const auto& [key, renewal] : renewals_)
    if (key.first == public_key_sha256) found.push_back(renewal);
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& one, const auto& other) { return one.not_after > other.not_after; });
  if (found.size() > kMostRenewals) found.resize(kMostRenewals);
  return found;
}

absl::StatusOr<storage::Instant> FakeCredentials::KeepOffer(const storage::CredentialOffer& offer,
                                                            const storage::StillWanted& still_wanted,
                                                            storage::Deadline) {
  const auto lock = commits.Lock();
  if (!commits.failure().ok()) return commits.failure();
  const storage::Instant now = CredentialsClock();
  for (auto at = offers_.begin(); at != offers_.end();) at = at->second.ends <= now ? offers_.erase(at) : std::next(at);
  if (offers_.size() >= kMostWaiting)
    return absl::ResourceExhaustedError("credentials: " + std::to_string(kMostWaiting) +
                                        " wait to be taken, want fewer");
  if (absl::Status committed = commits.Commit(still_wanted); !committed.ok()) return committed;
  return offers_.insert({offer.pickup_sha256, {offer, now + std::chrono::hours(offer.valid_hours)}}).first->second.ends;
}

absl::StatusOr<std::optional<storage::CredentialOffer>> FakeCredentials::TakeOffer(
    const std::string& pickup_sha256, const storage::StillWanted& still_wanted, storage::Deadline) {
  const auto lock = commits.Lock();
  if (!commits.failure().ok()) return commits.failure();
  const auto waiting = offers_.find(pickup_sha256);
  if (waiting == offers_.end() || waiting->second.ends <= CredentialsClock()) return std::nullopt;
  if (absl::Status committed = commits.Commit(still_wanted); !committed.ok()) return committed;
  storage::CredentialOffer taken = waiting->second.offer;
  taken.valid_hours = 0;  // is not read back
  offers_.erase(waiting);
  return taken;
}

absl::Status FakeCredentials::KeepRenewal(const storage::CertificateRenewal& renewal,
                                          const storage::StillWanted& still_wanted, storage::Deadline) {
  const auto lock = commits.Lock();
  if (!commits.failure().ok()) return commits.failure();
  if (absl::Status committed = commits.Commit(still_wanted); !committed.ok()) return committed;
  renewals_.insert({{renewal.public_key_sha256, renewal.serial}, renewal});
  return absl::OkStatus();
}

}  // namespace sixpoint::testing
