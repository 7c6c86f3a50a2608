// The ledger in the database (migrations/V0026): leaves are added behind the journal, heads are kept, roots and paths are told of what is
// stored. Each function works in a transaction that BeginLedger was called in.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "ledger/head.h"
#include "ledger/leaf.h"
#include "ledger/tree.h"
#include "storage/database.h"
#include "storage/ledger_rows.h"

namespace sixpoint::storage {

struct LedgerEnd {
  std::int64_t size = 0;             // leaves
  std::int64_t record_sequence = 0;  // of the last one
};
absl::StatusOr<LedgerEnd> ReadLedgerEnd(Transaction& transaction);

struct Sealed {
  std::int64_t count = 0;
  bool more = false;  // there may be
};
// Leaves of the entries behind the last one, at most `limit`, to be committed by the caller. None where another process does it just now.
// The journal's lock is not asked for: who wrote is done, and its row is read like any other.
absl::StatusOr<Sealed> SealEntries(Transaction& transaction, std::int64_t limit);

absl::StatusOr<std::vector<ledger::Leaf>> ReadLeaves(Transaction& transaction, ledger::LeafSpan span);
// Of leaves that stand in the tree as a subtree, or of the first so many. OUT_OF_RANGE where there are fewer.
absl::StatusOr<ledger::Hash> RootOf(Transaction& transaction, ledger::LeafSpan span);
absl::StatusOr<std::vector<ledger::Hash>> PathOf(Transaction& transaction, std::int64_t index, std::int64_t size);
// Kept subtrees, by the place of their last leaf in [begin, end); in order of that, the smaller first.
struct LedgerNode {
  int level = 0;
  std::int64_t index = 0;
  ledger::Hash hash;
};
absl::StatusOr<std::vector<LedgerNode>> ReadNodes(Transaction& transaction, ledger::LeafSpan span);
// From this level on subtrees are kept.
inline constexpr int kLeastKeptLevel = 8;

struct KeptHead {
  ledger::Head head;
  std::string public_key;  // PEM
};
absl::StatusOr<std::string> PlantId(Transaction& transaction);
// One of that size stays as it is.
absl::Status KeepHead(Transaction& transaction, const KeptHead& head);
absl::StatusOr<std::optional<KeptHead>> NewestHead(Transaction& transaction);
// Of sizes after one and up to another.
absl::StatusOr<std::vector<KeptHead>> ReadHeads(Transaction& transaction, std::int64_t after, std::int64_t until);

// An entry that concerns a blade, with what proves it.
struct SealedEntry {
  ledger::Leaf leaf;
  std::string content;  // empty: nothing belonged to it, or it was taken away
};
// Those among the first `size` leaves, oldest first; from after a sequence.
absl::StatusOr<std::vector<SealedEntry>> SealedOfBlade(Transaction& transaction, const std::string& serial,
                                                       std::int64_t size, std::int64_t after_sequence, int limit);
// How many entries concern it and are not among those.
absl::StatusOr<std::int64_t> CountUnsealedOfBlade(Transaction& transaction, const std::string& serial,
                                                  std::int64_t size);

}  // namespace sixpoint::storage
