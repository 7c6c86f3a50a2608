// Whether the rows of now are those that were sealed: a slice of leaves at a time, then what no leaf tells of. Each function works in a
// transaction that BeginLedger was called in. Whether the leaves are those that were signed is told by their hashes and the heads
// (ledger/head.h), which whoever asks compares.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "ledger/tree.h"
#include "storage/database.h"

namespace sixpoint::storage {

enum class DamageKind { kChanged, kMissing, kExtra, kSwapped };

struct LedgerDamage {
  DamageKind kind = DamageKind::kChanged;
  std::string table;
  std::string name;  // of the entry; empty where that is gone, or nothing of the journal's
  std::string record_id;
  std::int64_t record_sequence = 0;  // as it was sealed; of an extra entry as it stands; 0: of none
  std::string detail;
};

struct LedgerSlice {
  std::vector<ledger::Hash> leaf_hashes;  // of the leaves as they are kept; of one that is gone 32 bytes of zero
  std::vector<LedgerDamage> damages;
  std::map<std::string, std::int64_t>
      not_here;  // entries by the month that was detached: their leaves stand, their rows are elsewhere
  std::int64_t last_sequence = 0;
};
// after_sequence: last_sequence of the slice before; kBeforeAll for the first: what was put before the first entry is found, too.
inline constexpr std::int64_t kBeforeAll = std::numeric_limits<std::int64_t>::min();
absl::StatusOr<LedgerSlice> CheckSlice(Transaction& transaction, ledger::LeafSpan span, std::int64_t after_sequence);

// Whether what the services read are the tables themselves, with no view, rule or policy before them.
absl::StatusOr<std::vector<LedgerDamage>> CheckTablesArePlain(Transaction& transaction);
// Rows of LedgerTables()[table_index] that belong to nothing recorded; some of them.
absl::StatusOr<std::vector<LedgerDamage>> CheckOrphans(Transaction& transaction, std::size_t table_index);
absl::StatusOr<std::int64_t> CountUnsealed(Transaction& transaction, std::int64_t last_sequence);

struct BlobSlice {
  std::vector<LedgerDamage> damages;
  std::string last_sha256;  // hexadecimal; empty: there was none behind
  std::int64_t count = 0;
};
// Bytes that PostgreSQL holds against their digests, and bytes that are gone while no deletion says so.
absl::StatusOr<BlobSlice> CheckBlobSlice(Transaction& transaction, const std::string& after_sha256, int limit);
// Digests in the record that the catalogue does not have; some of them.
absl::StatusOr<std::vector<LedgerDamage>> CheckBlobsAreThere(Transaction& transaction);

}  // namespace sixpoint::storage
