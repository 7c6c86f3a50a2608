#include "services/plant/ledger_service.h"

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "services/runtime/call.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/errors.h"
#include "services/runtime/log.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/server.h"
#include "services/runtime/time_proto.h"
#include "storage/ledger.h"
#include "storage/ledger_check.h"
#include "storage/plant_store.h"

namespace sixpoint::plant {
namespace {

using runtime::ToGrpc;

constexpr int kEntriesAtOnce = 50;
constexpr std::int64_t kLeavesAtOnce = 2000;
constexpr int kBlobsAtOnce = 100;
constexpr std::int64_t kMostRowBytes = 1 << 20;    // of one table of one entry
constexpr std::size_t kMostBytesAtOnce = 8 << 20;  // about so many of a proof are held before they are sent
constexpr std::chrono::hours kLongestCheck{24};

// Another schema may keep rows of an entry where this release does not look, and would tell them as damage.
absl::Status SchemaIsOurs(storage::Database* database, storage::Deadline deadline) {
  const absl::StatusOr<int> version = database->SchemaVersion(deadline);
  if (!version.ok()) return version.status();
  if (*version == runtime::NewestMigration()) return absl::OkStatus();
  return runtime::Failure(errors::v1::SERVICE_NOT_READY,
                          "ledger: the schema is of version " + std::to_string(*version) + ", want " +
                              std::to_string(runtime::NewestMigration()) + " to compare it");
}

// A read of the ledger's own, in a transaction that ends with it.
template <typename Work>
auto ReadLedger(storage::Database* database, storage::Deadline deadline, const Work& work)
    -> decltype(work(std::declval<storage::Transaction&>())) {
  absl::StatusOr<storage::Transaction> transaction = database->Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  if (absl::Status begun = storage::BeginLedger(*transaction); !begun.ok()) return begun;
  return work(*transaction);
}

// "2026-11-25T01:02:03Z", as it is signed.
std::chrono::system_clock::time_point MomentOf(const std::string& text) {
  std::tm utc{};
  if (strptime(text.c_str(), "%Y-%m-%dT%H:%M:%SZ", &utc) == nullptr) return {};
  return std::chrono::system_clock::from_time_t(timegm(&utc));
}

v1::LedgerHead HeadOf(const storage::KeptHead& kept) {
  v1::LedgerHead head;
  head.set_plant_id(kept.head.plant_id);
  head.set_tree_size(kept.head.tree_size);
  head.set_root_sha256(kept.head.root);
  head.set_record_sequence(kept.head.record_sequence);
  runtime::ToProto(MomentOf(kept.head.signed_at), head.mutable_signed_at());
  head.set_key_id(kept.head.key_id);
  head.set_signature(kept.head.signature);
  head.set_public_key(kept.public_key);
  return head;
}

v1::DamageKind DamageKindOf(storage::DamageKind kind) {
  switch (kind) {
    case storage::DamageKind::kChanged:
      return v1::DAMAGE_KIND_CHANGED;
    case storage::DamageKind::kMissing:
      return v1::DAMAGE_KIND_MISSING;
    case storage::DamageKind::kExtra:
      return v1::DAMAGE_KIND_EXTRA;
    case storage::DamageKind::kSwapped:
      return v1::DAMAGE_KIND_SWAPPED;
  }
  return v1::DAMAGE_KIND_UNSPECIFIED;
}

absl::StatusOr<storage::KeptHead> HeadNow(storage::Database* database, storage::Deadline deadline) {
  auto head = ReadLedger(database, deadline,
                         [](storage::Transaction& transaction) { return storage::NewestHead(transaction); });
  if (!head.ok()) return head.status();
  if (!head->has_value())
    return runtime::Failure(errors::v1::LEDGER_NOT_SEALED, "ledger: no head was signed yet, want one");
  return **std::move(head);
}

absl::StatusOr<v1::ProvenEntry> Prove(storage::Transaction& transaction, const storage::LedgerColumns& columns,
                                      const storage::SealedEntry& entry, std::int64_t size) {
  v1::ProvenEntry proven;
  proven.set_leaf_index(entry.leaf.index);
  proven.set_record_sequence(entry.leaf.record_sequence);
  proven.set_leaf(LeafText(entry.leaf));
  proven.set_content(entry.content);
  const auto named = storage::ReadNameText(transaction, columns, entry.leaf.record_id);
  if (!named.ok()) return named.status();
  proven.set_name(named->name);
  proven.set_name_row(named->text);
  const auto texts = storage::ReadRowTexts(transaction, columns, entry.leaf.record_id, kMostRowBytes);
  if (!texts.ok()) return texts.status();
  for (const auto& [table, rows] : storage::ContentOf(entry.content)) {
    v1::SealedRows* sealed = proven.add_tables();
    sealed->set_table(table);
    const auto found = texts->find(table);
    if (found != texts->end()) *sealed->mutable_rows() = {found->second.begin(), found->second.end()};
  }
  const absl::StatusOr<std::vector<ledger::Hash>> path = storage::PathOf(transaction, entry.leaf.index, size);
  if (!path.ok()) return path.status();
  for (const ledger::Hash& hash : *path) proven.add_audit_path(hash);
  return proven;
}

// One check from its first leaf to its last message.
class Check {
 public:
  Check(storage::Database* database, const storage::ClearanceReader& clearances, grpc::ServerContext* context,
        grpc::ServerWriter<v1::LedgerSlice>* writer)
      : database_(database),
        clearances_(clearances),
        reader_(runtime::ReaderOf(*context)),
        deadline_(runtime::DeadlineWithin(*context, kLongestCheck)),
        context_(context),
        writer_(writer) {}

  absl::Status Run(bool with_blobs) {
    if (absl::Status ours = SchemaIsOurs(database_, deadline_); !ours.ok()) return ours;
    const auto end = ReadLedger(database_, deadline_,
                                [](storage::Transaction& transaction) { return storage::ReadLedgerEnd(transaction); });
    if (!end.ok()) return end.status();
    size_ = end->size;
    absl::Status done = absl::OkStatus();
    for (std::int64_t begin = 0; done.ok() && begin < size_; begin += kLeavesAtOnce)
      done = SendLeaves({begin, std::min(begin + kLeavesAtOnce, size_)});
    if (done.ok()) done = SendPlain();
    for (std::size_t i = 0; done.ok() && i < storage::LedgerTables().size(); ++i) done = SendOrphans(i);
    if (done.ok() && with_blobs) done = SendBlobs();
    return done.ok() ? SendLast() : done;
  }

 private:
  absl::Status SendLeaves(ledger::LeafSpan span) {
    v1::LedgerSlice message;
    message.set_first_leaf_index(span.begin);
    std::vector<storage::LedgerNode> nodes;
    const auto slice = ReadLedger(database_, deadline_,
                                  [&](storage::Transaction& transaction) -> absl::StatusOr<storage::LedgerSlice> {
                                    auto checked = storage::CheckSlice(transaction, span, last_sequence_);
                                    auto heads = storage::ReadHeads(transaction, span.begin, span.end);
                                    auto kept = storage::ReadNodes(transaction, span);
                                    if (!heads.ok()) return heads.status();
                                    if (!kept.ok()) return kept.status();
                                    for (const storage::KeptHead& head : *heads) *message.add_heads() = HeadOf(head);
                                    nodes = *std::move(kept);
                                    return checked;
                                  });
    if (!slice.ok()) return slice.status();
    last_sequence_ = slice->last_sequence;
    for (const ledger::Hash& hash : slice->leaf_hashes) message.mutable_leaf_hashes()->append(hash);
    for (const auto& [month, count] : slice->not_here) {
      v1::DetachedEntries* detached = message.add_detached();
      detached->set_month(month);
      detached->set_entry_count(count);
    }
    std::vector<storage::LedgerDamage> damages = slice->damages;
    CheckNodes(slice->leaf_hashes, nodes, &damages);
    return Send(damages, &message);
  }

  // The kept subtrees follow from the leaves; proofs are made of them.
  void CheckNodes(const std::vector<ledger::Hash>& hashes, const std::vector<storage::LedgerNode>& kept,
                  std::vector<storage::LedgerDamage>* damages) {
    std::vector<storage::LedgerNode> wanted;
    for (const ledger::Hash& hash : hashes)
      range_.Append(hash, [&](int level, std::int64_t index, const ledger::Hash& node) {
        if (level >= storage::kLeastKeptLevel) wanted.push_back({level, index, node});
      });
    const auto same = [](const storage::LedgerNode& a, const storage::LedgerNode& b) {
      return a.level == b.level && a.index == b.index && a.hash == b.hash;
    };
    if (!std::equal(wanted.begin(), wanted.end(), kept.begin(), kept.end(), same))
      damages->push_back(
          {storage::DamageKind::kChanged, "ledger_nodes", "", "", 0, "subtrees that do not follow from the leaves"});
  }

  absl::Status SendPlain() {
    const auto damages = ReadLedger(database_, deadline_, [](storage::Transaction& transaction) {
      return storage::CheckTablesArePlain(transaction);
    });
    v1::LedgerSlice message;
    return damages.ok() ? Send(*damages, &message) : damages.status();
  }

  absl::Status SendOrphans(std::size_t table_index) {
    const auto damages = ReadLedger(database_, deadline_, [&](storage::Transaction& transaction) {
      return storage::CheckOrphans(transaction, table_index);
    });
    v1::LedgerSlice message;
    return damages.ok() ? Send(*damages, &message) : damages.status();
  }

  absl::Status SendBlobs() {
    const auto gone = ReadLedger(database_, deadline_, [](storage::Transaction& transaction) {
      return storage::CheckBlobsAreThere(transaction);
    });
    if (!gone.ok()) return gone.status();
    v1::LedgerSlice first;
    absl::Status done = Send(*gone, &first);
    for (std::string after; done.ok();) {
      const auto slice = ReadLedger(database_, deadline_, [&](storage::Transaction& transaction) {
        return storage::CheckBlobSlice(transaction, after, kBlobsAtOnce);
      });
      if (!slice.ok()) return slice.status();
      if (slice->count == 0) return absl::OkStatus();
      after = slice->last_sha256;
      checked_blob_count_ += slice->count;
      v1::LedgerSlice message;
      done = Send(slice->damages, &message);
    }
    return done;
  }

  absl::Status SendLast() {
    const auto unsealed = ReadLedger(database_, deadline_, [&](storage::Transaction& transaction) {
      return storage::CountUnsealed(transaction, last_sequence_);
    });
    if (!unsealed.ok()) return unsealed.status();
    v1::LedgerSlice message;
    message.set_unsealed_count(*unsealed);
    message.set_is_last(true);
    return Send({}, &message);
  }

  absl::Status Send(const std::vector<storage::LedgerDamage>& damages, v1::LedgerSlice* message) {
    for (const storage::LedgerDamage& damage : damages) {
      v1::LedgerDamage* told = message->add_damages();
      told->set_kind(DamageKindOf(damage.kind));
      told->set_table(damage.table);
      told->set_record_id(damage.record_id);
      told->set_record_sequence(damage.record_sequence);
      told->set_detail(damage.detail);
      if (damage.name.empty()) continue;
      const auto hidden = clearances_.FirstHidden(reader_, {damage.name}, storage::Unrecorded::kIsHidden, deadline_);
      if (hidden.ok() && !hidden->has_value()) told->set_name(damage.name);
    }
    if (!damages.empty())
      runtime::Log(runtime::LogLevel::kError, "ledger: not as it was sealed",
                   {{"damages", static_cast<long>(damages.size())},
                    {"first_table", damages.front().table},
                    {"first_record_id", damages.front().record_id}});
    message->set_tree_size(size_);
    message->set_last_record_sequence(std::max<std::int64_t>(0, last_sequence_));
    message->set_checked_blob_count(checked_blob_count_);
    return writer_->Write(*message) ? absl::OkStatus() : absl::CancelledError("ledger: the client went away");
  }

  storage::Database* const database_;
  const storage::ClearanceReader& clearances_;
  const storage::Reader reader_;
  const storage::Deadline deadline_;
  grpc::ServerContext* const context_;
  grpc::ServerWriter<v1::LedgerSlice>* const writer_;
  std::int64_t size_ = 0, last_sequence_ = storage::kBeforeAll, checked_blob_count_ = 0;
  ledger::CompactRange range_;
};

}  // namespace

grpc::Status LedgerService::GetLedgerHead(grpc::ServerContext* context, const v1::GetLedgerHeadRequest* /*request*/,
                                          v1::LedgerHead* response) {
  const absl::StatusOr<storage::KeptHead> head = HeadNow(database_, runtime::DeadlineOf(*context));
  if (!head.ok()) return ToGrpc(head.status());
  *response = HeadOf(*head);
  return grpc::Status::OK;
}

grpc::Status LedgerService::GetBladeProof(grpc::ServerContext* context, const v1::GetBladeProofRequest* request,
                                          grpc::ServerWriter<v1::ProvenEntry>* writer) {
  const absl::StatusOr<std::string> serial = runtime::IdOf("name", "blades", request->name());
  if (!serial.ok()) return ToGrpc(serial.status());
  const storage::Deadline deadline = runtime::DeadlineOf(*context);
  const auto blade = storage::PlantIn(database_).blades->Find(*serial, deadline);
  if (!blade.ok()) return ToGrpc(blade.status());
  if (!blade->has_value())
    return ToGrpc(runtime::Failure(errors::v1::BLADE_NOT_FOUND,
                                   "name: " + request->name() + ", want one that is registered",
                                   {{"resource", request->name()}}));
  const absl::StatusOr<storage::KeptHead> head = HeadNow(database_, deadline);
  if (!head.ok()) return ToGrpc(head.status());
  const std::int64_t size = head->head.tree_size;
  v1::ProvenEntry first;
  *first.mutable_head() = HeadOf(*head);
  for (std::int64_t after = 0;;) {
    std::vector<v1::ProvenEntry> messages;
    const auto proven = ReadLedger(database_, deadline, [&](storage::Transaction& transaction) -> absl::StatusOr<bool> {
      const auto columns = storage::ReadLedgerColumns(transaction);
      if (!columns.ok()) return columns.status();
      if (after == 0) {
        const auto unsealed = storage::CountUnsealedOfBlade(transaction, *serial, size);
        if (!unsealed.ok()) return unsealed.status();
        first.set_unsealed_count(*unsealed);
      }
      const auto entries = storage::SealedOfBlade(transaction, *serial, size, after, kEntriesAtOnce);
      if (!entries.ok()) return entries.status();
      std::size_t bytes = 0;
      for (const storage::SealedEntry& entry : *entries) {
        if (bytes > kMostBytesAtOnce) return true;
        absl::StatusOr<v1::ProvenEntry> one = Prove(transaction, *columns, entry, size);
        if (!one.ok()) return one.status();
        bytes += one->ByteSizeLong();
        messages.push_back(*std::move(one));
        after = entry.leaf.record_sequence;
      }
      return entries->size() == kEntriesAtOnce;
    });
    if (!proven.ok()) return ToGrpc(proven.status());
    for (v1::ProvenEntry& message : messages) {
      message.MergeFrom(first);
      first.Clear();
      if (!writer->Write(message)) return ToGrpc(absl::CancelledError("proof: the client went away"));
    }
    if (!*proven) break;
  }
  if (!first.has_head()) return grpc::Status::OK;
  return ToGrpc(
      runtime::Failure(errors::v1::LEDGER_NOT_SEALED, "ledger: nothing of " + request->name() + " is sealed yet"));
}

grpc::Status LedgerService::VerifyLedger(grpc::ServerContext* context, const v1::VerifyLedgerRequest* request,
                                         grpc::ServerWriter<v1::LedgerSlice>* writer) {
  const auto slot = checks_.Enter(runtime::DeadlineOf(*context), runtime::KeepGoing(*context));
  if (!slot.ok()) return ToGrpc(slot.status());
  return ToGrpc(Check(database_, *clearances_, context, writer).Run(request->with_blobs()));
}

}  // namespace sixpoint::plant
