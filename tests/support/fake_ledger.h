// A LedgerStore in memory, over a journal of its own: what handlers and the sealer are tested on without PostgreSQL. Held to the real one
// by tests/storage/ledger_store_test.cc. Of what may be done to a ledger it tells what Tamper and the like do; what was sealed of an
// entry's tables is never lost, and no row stands in another entry's month.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "storage/ledger_store.h"
#include "tests/support/fake_commits.h"

namespace sixpoint::testing {

class FakeLedger final : public storage::LedgerStore {
 public:
  // An entry of the journal as it stands now.
  struct Entry {
    std::string record_id, name, blade;  // blade: a serial, or empty
    std::int64_t sequence = 0;
    std::string recorded_at = "now";
    bool is_named = true;                                  // its row of record_names is there
    std::map<std::string, std::vector<std::string>> rows;  // by table, as their texts
  };
  using Meanwhile = std::function<void(const std::string& question)>;

  FakeCommits commits;
  std::atomic<int> schema_version{1};

  // What it holds by record_entries and record_roots, one row each. Its sequence.
  std::int64_t Record(const std::string& name, const std::string& blade = "",
                      const std::string& record_id = storage::NewUuid());
  // As a superuser: what is said of it becomes so.
  void Tamper(const std::string& name, const std::function<void(Entry& entry)>& change);
  void DropLeaf(std::int64_t index);
  void SpoilNodes();  // kept subtrees
  void MakeUnplain(const std::string& table);
  // Its rows that go with a month are elsewhere: 2026_03.
  void DetachMonth(const std::string& month);
  // Bytes that are kept; their SHA-256 in hexadecimal.
  std::string PutBlob(const std::string& bytes);
  void SpoilBlob(const std::string& sha256);
  // A row of that table names it, whether it is there or not.
  void NameBlob(const std::string& sha256, const std::string& table);
  // Happens at each question, which is told by its function's name, before it is answered: it may ask and change the ledger.
  void WhenAsked(Meanwhile meanwhile);
  // How often a question came, by its function's name.
  int AskedCount(const std::string& question) const;

  absl::StatusOr<int> SchemaVersion(storage::Deadline) const override;
  absl::StatusOr<storage::LedgerEnd> End(storage::Deadline) const override;
  absl::StatusOr<std::string> PlantId(storage::Deadline) const override;
  absl::StatusOr<std::optional<storage::KeptHead>> NewestHead(storage::Deadline) const override;
  absl::StatusOr<ledger::Hash> Root(std::int64_t size, storage::Deadline) const override;
  absl::StatusOr<storage::ProofPage> ProofOfBlade(const storage::ProofQuery& query, storage::Deadline) const override;
  absl::StatusOr<storage::CheckedLeaves> CheckLeaves(ledger::LeafSpan span, std::int64_t after_sequence,
                                                     storage::Deadline) const override;
  absl::StatusOr<std::vector<storage::LedgerDamage>> CheckTablesArePlain(storage::Deadline) const override;
  absl::StatusOr<std::vector<storage::LedgerDamage>> CheckOrphans(std::size_t table_index,
                                                                  storage::Deadline) const override;
  absl::StatusOr<std::int64_t> CountUnsealed(std::int64_t last_sequence, storage::Deadline) const override;
  absl::StatusOr<std::vector<storage::LedgerDamage>> CheckBlobsAreThere(storage::Deadline) const override;
  absl::StatusOr<storage::BlobSlice> CheckBlobSlice(const std::string& after_sha256, int limit,
                                                    storage::Deadline) const override;
  absl::StatusOr<storage::Sealed> Seal(std::int64_t limit, storage::Deadline) override;
  absl::Status KeepHead(const storage::KeptHead& head, storage::Deadline) override;

 private:
  absl::Status Asked(const char* question) const;
  const Entry& EntryOf(const ledger::Leaf& leaf) const { return entries_[place_of_.at(leaf.record_id)]; }
  bool IsSealed(const Entry& entry, std::int64_t size) const;
  absl::StatusOr<ledger::Hash> RootOf(ledger::LeafSpan span) const;
  absl::StatusOr<storage::EntryProof> Prove(const ledger::Leaf& leaf, const Entry& entry,
                                            const storage::ProofQuery& query) const;
  void CheckName(const ledger::Leaf& leaf, const Entry& entry, const std::set<std::int64_t>& sequences,
                 storage::LedgerSlice* slice) const;
  void CheckRows(const ledger::Leaf& leaf, const Entry& entry, storage::LedgerSlice* slice) const;

  std::map<std::string, std::size_t> place_of_;      // in entries_, by record_id
  std::map<std::string, std::int64_t> leaf_of_;      // indices, by record_id
  std::vector<Entry> entries_;                       // in the order in which they were recorded
  std::map<std::int64_t, ledger::Leaf> leaves_;      // by index
  std::map<std::string, std::string> contents_;      // as they were sealed, by record_id
  std::vector<storage::LedgerNode> nodes_;           // in the order in which they became complete
  std::map<std::int64_t, storage::KeptHead> heads_;  // by size
  ledger::CompactRange range_;                       // of the leaves as they were sealed
  std::set<std::string> unplain_, detached_months_;
  std::map<std::string, std::string> blobs_;                      // bytes by their digest
  std::vector<std::pair<std::string, std::string>> named_blobs_;  // table and digest
  Meanwhile meanwhile_;
  mutable std::map<std::string, int> asked_count_;
};

}  // namespace sixpoint::testing
