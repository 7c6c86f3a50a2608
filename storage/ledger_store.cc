#include "storage/ledger_store.h"

#include <utility>

#include "storage/one_read.h"
#include "storage/one_write.h"

namespace sixpoint::storage {
namespace {

std::size_t ProofBytes(const EntryProof& proof) {
  std::size_t bytes = LeafText(proof.sealed.leaf).size() + proof.sealed.content.size() + proof.named.name.size() +
                      proof.named.text.size();
  for (const auto& [table, rows] : proof.row_texts)
    for (const std::string& row : rows) bytes += row.size();
  for (const ledger::Hash& hash : proof.audit_path) bytes += hash.size();
  return bytes;
}

absl::StatusOr<EntryProof> ProveEntry(Transaction& transaction, const LedgerColumns& columns, const SealedEntry& sealed,
                                      const ProofQuery& query) {
  absl::StatusOr<NameText> named = ReadNameText(transaction, columns, sealed.leaf.record_id);
  if (!named.ok()) return named.status();
  auto row_texts = ReadRowTexts(transaction, columns, sealed.leaf.record_id, query.most_row_bytes);
  if (!row_texts.ok()) return row_texts.status();
  absl::StatusOr<std::vector<ledger::Hash>> path = PathOf(transaction, sealed.leaf.index, query.tree_size);
  if (!path.ok()) return path.status();
  return EntryProof{sealed, *std::move(named), *std::move(row_texts), *std::move(path)};
}

absl::StatusOr<ProofPage> ReadProofPage(Transaction& transaction, const ProofQuery& query) {
  const absl::StatusOr<LedgerColumns> columns = ReadLedgerColumns(transaction);
  if (!columns.ok()) return columns.status();
  ProofPage page;
  if (query.after_sequence == 0) {
    const absl::StatusOr<std::int64_t> unsealed = CountUnsealedOfBlade(transaction, query.serial, query.tree_size);
    if (!unsealed.ok()) return unsealed.status();
    page.unsealed_count = *unsealed;
  }
  const absl::StatusOr<std::vector<SealedEntry>> entries =
      SealedOfBlade(transaction, query.serial, query.tree_size, query.after_sequence, query.most_entries);
  if (!entries.ok()) return entries.status();
  page.more = entries->size() == static_cast<std::size_t>(query.most_entries);
  std::size_t bytes = 0;
  for (const SealedEntry& entry : *entries) {
    if (bytes > query.most_bytes) {
      page.more = true;
      break;
    }
    absl::StatusOr<EntryProof> proof = ProveEntry(transaction, *columns, entry, query);
    if (!proof.ok()) return proof.status();
    bytes += ProofBytes(*proof);
    page.entries.push_back(*std::move(proof));
  }
  return page;
}

absl::StatusOr<CheckedLeaves> ReadChecked(Transaction& transaction, ledger::LeafSpan span,
                                          std::int64_t after_sequence) {
  absl::StatusOr<LedgerSlice> slice = CheckSlice(transaction, span, after_sequence);
  if (!slice.ok()) return slice.status();
  absl::StatusOr<std::vector<KeptHead>> heads = ReadHeads(transaction, span.begin, span.end);
  absl::StatusOr<std::vector<LedgerNode>> nodes = ReadNodes(transaction, span);
  if (!heads.ok()) return heads.status();
  if (!nodes.ok()) return nodes.status();
  return CheckedLeaves{*std::move(slice), *std::move(heads), *std::move(nodes)};
}

// The same work, begun as the ledger's.
template <typename Work>
auto OfLedger(const Work& work) {
  return [work](Transaction& transaction) -> decltype(work(transaction)) {
    if (absl::Status begun = BeginLedger(transaction); !begun.ok()) return begun;
    return work(transaction);
  };
}

class PostgresLedger final : public LedgerStore {
 public:
  explicit PostgresLedger(Database* database) : database_(database) {}
  explicit PostgresLedger(std::unique_ptr<Database> own) : own_(std::move(own)), database_(own_.get()) {}

  absl::StatusOr<int> SchemaVersion(Deadline deadline) const override { return database_->SchemaVersion(deadline); }
  absl::StatusOr<LedgerEnd> End(Deadline deadline) const override {
    return OneRead(*database_, deadline, OfLedger([](Transaction& t) { return ReadLedgerEnd(t); }));
  }
  absl::StatusOr<std::string> PlantId(Deadline deadline) const override {
    return OneRead(*database_, deadline, OfLedger([](Transaction& t) { return storage::PlantId(t); }));
  }
  absl::StatusOr<std::optional<KeptHead>> NewestHead(Deadline deadline) const override {
    return OneRead(*database_, deadline, OfLedger([](Transaction& t) { return storage::NewestHead(t); }));
  }
  absl::StatusOr<ledger::Hash> Root(std::int64_t size, Deadline deadline) const override {
    return OneRead(*database_, deadline, OfLedger([&](Transaction& t) { return RootOf(t, {0, size}); }));
  }
  absl::StatusOr<ProofPage> ProofOfBlade(const ProofQuery& query, Deadline deadline) const override {
    return OneRead(*database_, deadline, OfLedger([&](Transaction& t) { return ReadProofPage(t, query); }));
  }
  absl::StatusOr<CheckedLeaves> CheckLeaves(ledger::LeafSpan span, std::int64_t after_sequence,
                                            Deadline deadline) const override {
    return OneRead(*database_, deadline,
                   OfLedger([&](Transaction& t) { return ReadChecked(t, span, after_sequence); }));
  }
  absl::StatusOr<std::vector<LedgerDamage>> CheckTablesArePlain(Deadline deadline) const override {
    return OneRead(*database_, deadline, OfLedger([](Transaction& t) { return storage::CheckTablesArePlain(t); }));
  }
  absl::StatusOr<std::vector<LedgerDamage>> CheckOrphans(std::size_t table_index, Deadline deadline) const override {
    return OneRead(*database_, deadline,
                   OfLedger([&](Transaction& t) { return storage::CheckOrphans(t, table_index); }));
  }
  absl::StatusOr<std::int64_t> CountUnsealed(std::int64_t last_sequence, Deadline deadline) const override {
    return OneRead(*database_, deadline,
                   OfLedger([&](Transaction& t) { return storage::CountUnsealed(t, last_sequence); }));
  }
  absl::StatusOr<std::vector<LedgerDamage>> CheckBlobsAreThere(Deadline deadline) const override {
    return OneRead(*database_, deadline, OfLedger([](Transaction& t) { return storage::CheckBlobsAreThere(t); }));
  }
  absl::StatusOr<BlobSlice> CheckBlobSlice(const std::string& after_sha256, int limit,
                                           Deadline deadline) const override {
    return OneRead(*database_, deadline,
                   OfLedger([&](Transaction& t) { return storage::CheckBlobSlice(t, after_sha256, limit); }));
  }
  absl::StatusOr<Sealed> Seal(std::int64_t limit, Deadline deadline) override {
    return OneWrite(*database_, deadline, OfLedger([&](Transaction& t) { return SealEntries(t, limit); }));
  }
  absl::Status KeepHead(const KeptHead& head, Deadline deadline) override {
    return OneWrite(*database_, deadline, OfLedger([&](Transaction& t) { return storage::KeepHead(t, head); }));
  }

 private:
  const std::unique_ptr<Database> own_;
  Database* const database_;
};

}  // namespace

std::shared_ptr<LedgerStore> LedgerIn(Database* database) { return std::make_shared<PostgresLedger>(database); }
std::shared_ptr<LedgerStore> LedgerIn(std::unique_ptr<Database> database) {
  return std::make_shared<PostgresLedger>(std::move(database));
}

}  // namespace sixpoint::storage
