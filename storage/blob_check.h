// Reads every kept blob again and holds it against its size and digest, slowly enough not to be felt.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "storage/database.h"
#include "storage/object_store.h"

namespace sixpoint::storage {

struct BlobDamage {
  std::string sha256;
  std::string store;
  std::string what;  // missing, size, digest, unreadable
  std::string detail;
  Instant found_at;
};
struct CheckProgress {
  std::string after_sha256;  // all up to this one are checked; empty: none yet
  std::int64_t checked_count = 0;
  std::int64_t checked_bytes = 0;
  std::int64_t damaged_count = 0;
};
struct CheckOptions {
  double rate_mb_s = 0;  // 0: as fast as it goes
  std::function<bool()> keep_going = [] { return true; };
  // After each blob.
  std::function<void(const CheckProgress&)> on_progress = [](const CheckProgress&) {};
  // Each time it is found; table blob_damages has it once.
  std::function<void(const BlobDamage&)> on_damage = [](const BlobDamage&) {};
};

// Goes on from `from` to the end, or until keep_going says no. No connection is held while it waits. An error means that
// the check cannot go on (a store is away): progress says how far it came, and it can go on from there.
absl::Status CheckBlobs(Database* database, ObjectStore* objects, const CheckOptions& options, CheckProgress from,
                        Deadline deadline);

// How far the continuous check has come.
struct CheckState {
  CheckProgress progress;
  Instant begun_at;
  std::optional<Instant> finished_at;  // end of the last whole pass
};
absl::StatusOr<CheckState> ReadCheckState(Transaction& transaction);
absl::Status KeepCheckProgress(Transaction& transaction, const CheckProgress& progress);
// The next pass begins at the beginning.
absl::Status KeepCheckFinished(Transaction& transaction);

struct StoreUse {
  std::string store;
  std::int64_t kept_count = 0;
  std::int64_t kept_bytes = 0;
  std::int64_t deleted_count = 0;
  std::int64_t deleted_bytes = 0;
};
// From sums that the catalogue's changes leave behind them, not from the catalogue.
absl::StatusOr<std::vector<StoreUse>> ReadStoreUse(Transaction& transaction);
// One row a store of what the changes left: now and then, so that there is little to sum.
absl::Status AddUpStoreUse(Transaction& transaction);
// Newest first.
absl::StatusOr<std::vector<BlobDamage>> ListDamages(Transaction& transaction, int limit);

}  // namespace sixpoint::storage
