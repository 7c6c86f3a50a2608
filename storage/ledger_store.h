// The ledger apart from where it is kept: what is read of it to prove and to check, and what its sealer writes. PostgreSQL's and the
// tests' fake pass the same suite (tests/storage/ledger_store_test.cc). Thread-safe. Each call is one transaction of the role that reads
// the whole record, and holds no connection after it returned: what is sealed never changes, so that who reads it page by page reads one
// ledger.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "storage/ledger.h"
#include "storage/ledger_check.h"

namespace sixpoint::storage {

// Which of a blade's sealed entries, and how many of them at once.
struct ProofQuery {
  std::string serial;
  std::int64_t tree_size = 0;       // what is among the first so many leaves, by paths to their root
  std::int64_t after_sequence = 0;  // of the journal; 0: from the first
  int most_entries = 0;
  std::int64_t most_row_bytes = 0;  // of a table of one entry that holds more no row is told
  std::size_t most_bytes = 0;       // no entry is added to so many
};

struct EntryProof {
  SealedEntry sealed;
  NameText named;
  std::map<std::string, std::vector<std::string>> row_texts;  // as ReadRowTexts
  std::vector<ledger::Hash> audit_path;
};

struct ProofPage {
  std::vector<EntryProof> entries;  // oldest first
  bool more = false;                // there may be
  std::int64_t unsealed_count = 0;  // of the first page: entries of the blade that are not among those leaves
};

// Some leaves, compared with the rows of now.
struct CheckedLeaves {
  LedgerSlice slice;
  std::vector<KeptHead> heads;    // of sizes within the span
  std::vector<LedgerNode> nodes;  // kept subtrees that end within it
};

class LedgerReader {
 public:
  virtual ~LedgerReader() = default;
  // As Database::SchemaVersion.
  virtual absl::StatusOr<int> SchemaVersion(Deadline deadline) const = 0;

  // As ReadLedgerEnd, PlantId and NewestHead.
  virtual absl::StatusOr<LedgerEnd> End(Deadline deadline) const = 0;
  virtual absl::StatusOr<std::string> PlantId(Deadline deadline) const = 0;
  virtual absl::StatusOr<std::optional<KeptHead>> NewestHead(Deadline deadline) const = 0;
  // Of the first `size` leaves; OUT_OF_RANGE where there are fewer.
  virtual absl::StatusOr<ledger::Hash> Root(std::int64_t size, Deadline deadline) const = 0;
  // NOT_FOUND where the name of a sealed entry is gone.
  virtual absl::StatusOr<ProofPage> ProofOfBlade(const ProofQuery& query, Deadline deadline) const = 0;

  // As CheckSlice, and what is kept of the same leaves.
  virtual absl::StatusOr<CheckedLeaves> CheckLeaves(ledger::LeafSpan span, std::int64_t after_sequence,
                                                    Deadline deadline) const = 0;
  // As the functions of these names in storage/ledger_check.h.
  virtual absl::StatusOr<std::vector<LedgerDamage>> CheckTablesArePlain(Deadline deadline) const = 0;
  virtual absl::StatusOr<std::vector<LedgerDamage>> CheckOrphans(std::size_t table_index, Deadline deadline) const = 0;
  virtual absl::StatusOr<std::int64_t> CountUnsealed(std::int64_t last_sequence, Deadline deadline) const = 0;
  virtual absl::StatusOr<std::vector<LedgerDamage>> CheckBlobsAreThere(Deadline deadline) const = 0;
  virtual absl::StatusOr<BlobSlice> CheckBlobSlice(const std::string& after_sha256, int limit,
                                                   Deadline deadline) const = 0;
};

class LedgerStore : public LedgerReader {
 public:
  // As SealEntries; kept once it returned OK.
  virtual absl::StatusOr<Sealed> Seal(std::int64_t limit, Deadline deadline) = 0;
  // One of that size stays as it is.
  virtual absl::Status KeepHead(const KeptHead& head, Deadline deadline) = 0;
};

// In PostgreSQL; the database lives longer.
std::shared_ptr<LedgerStore> LedgerIn(Database* database);
// The same by connections of its own.
std::shared_ptr<LedgerStore> LedgerIn(std::unique_ptr<Database> database);

}  // namespace sixpoint::storage
