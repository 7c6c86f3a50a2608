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
absl::Status SchemaIsOurs(const storage::LedgerReader& ledger, storage::Deadline deadline) {
  const absl::StatusOr<int> version = ledger.SchemaVersion(deadline);
  if (!version.ok()) return version.status();
  if (*version == runtime::NewestMigration()) return absl::OkStatus();
  return runtime::Failure(errors::v1::SERVICE_NOT_READY,
                          "ledger: the schema is of version " + std::to_string(*version) + ", want " +
                              std::to_string(runtime::NewestMigration()) + " to compare it");
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

absl::StatusOr<storage::KeptHead> HeadNow(const storage::LedgerReader& ledger, storage::Deadline deadline) {
  absl::StatusOr<std::optional<storage::KeptHead>> head = ledger.NewestHead(deadline);
  if (!head.ok()) return head.status();
  if (!head->has_value())
    return runtime::Failure(errors::v1::LEDGER_NOT_SEALED, "ledger: no head was signed yet, want one");
  return **std::move(head);
}

v1::ProvenEntry ProvenOf(const storage::EntryProof& proof) {
  v1::ProvenEntry proven;
  proven.set_leaf_index(proof.sealed.leaf.index);
  proven.set_record_sequence(proof.sealed.leaf.record_sequence);
  proven.set_leaf(LeafText(proof.sealed.leaf));
  proven.set_content(proof.sealed.content);
  proven.set_name(proof.named.name);
  proven.set_name_row(proof.named.text);
  for (const auto& [table, rows] : storage::ContentOf(proof.sealed.content)) {
    v1::SealedRows* sealed = proven.add_tables();
    sealed->set_table(table);
    const auto found = proof.row_texts.find(table);
    if (found != proof.row_texts.end()) *sealed->mutable_rows() = {found->second.begin(), found->second.end()};
  }
  for (const ledger::Hash& hash : proof.audit_path) proven.add_audit_path(hash);
  return proven;
}

// One check from its first leaf to its last message.
class Check {
 public:
  Check(const storage::LedgerReader& ledger, const storage::ClearanceReader& clearances, grpc::ServerContext* context,
        grpc::ServerWriter<v1::LedgerSlice>* writer)
      : ledger_(ledger),
        clearances_(clearances),
        reader_(runtime::ReaderOf(*context)),
        deadline_(runtime::DeadlineWithin(*context, kLongestCheck)),
        writer_(writer) {}

  absl::Status Run(bool with_blobs) {
    if (absl::Status ours = SchemaIsOurs(ledger_, deadline_); !ours.ok()) return ours;
    const absl::StatusOr<storage::LedgerEnd> end = ledger_.End(deadline_);
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
    const absl::StatusOr<storage::CheckedLeaves> checked = ledger_.CheckLeaves(span, last_sequence_, deadline_);
    if (!checked.ok()) return checked.status();
    const storage::LedgerSlice& slice = checked->slice;
    last_sequence_ = slice.last_sequence;
    v1::LedgerSlice message;
    message.set_first_leaf_index(span.begin);
    for (const storage::KeptHead& head : checked->heads) *message.add_heads() = HeadOf(head);
    for (const ledger::Hash& hash : slice.leaf_hashes) message.mutable_leaf_hashes()->append(hash);
    for (const auto& [month, count] : slice.not_here) {
      v1::DetachedEntries* detached = message.add_detached();
      detached->set_month(month);
      detached->set_entry_count(count);
    }
    std::vector<storage::LedgerDamage> damages = slice.damages;
    CheckNodes(slice.leaf_hashes, checked->nodes, &damages);
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

  absl::Status SendPlain() { return SendDamages(ledger_.CheckTablesArePlain(deadline_)); }
  absl::Status SendOrphans(std::size_t table_index) {
    return SendDamages(ledger_.CheckOrphans(table_index, deadline_));
  }

  absl::Status SendBlobs() {
    absl::Status done = SendDamages(ledger_.CheckBlobsAreThere(deadline_));
    for (std::string after; done.ok();) {
      const absl::StatusOr<storage::BlobSlice> slice = ledger_.CheckBlobSlice(after, kBlobsAtOnce, deadline_);
      if (!slice.ok()) return slice.status();
      if (slice->count == 0) return absl::OkStatus();
      after = slice->last_sha256;
      checked_blob_count_ += slice->count;
      done = SendDamages(slice->damages);
    }
    return done;
  }

  absl::Status SendLast() {
    const absl::StatusOr<std::int64_t> unsealed = ledger_.CountUnsealed(last_sequence_, deadline_);
    if (!unsealed.ok()) return unsealed.status();
    v1::LedgerSlice message;
    message.set_unsealed_count(*unsealed);
    message.set_is_last(true);
    return Send({}, &message);
  }

  absl::Status SendDamages(const absl::StatusOr<std::vector<storage::LedgerDamage>>& damages) {
    if (!damages.ok()) return damages.status();
    v1::LedgerSlice message;
    return Send(*damages, &message);
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

  const storage::LedgerReader& ledger_;
  const storage::ClearanceReader& clearances_;
  const storage::Reader reader_;
  const storage::Deadline deadline_;
  grpc::ServerWriter<v1::LedgerSlice>* const writer_;
  std::int64_t size_ = 0, last_sequence_ = storage::kBeforeAll, checked_blob_count_ = 0;
  ledger::CompactRange range_;
};

}  // namespace

grpc::Status LedgerService::GetLedgerHead(grpc::ServerContext* context, const v1::GetLedgerHeadRequest* /*request*/,
                                          v1::LedgerHead* response) {
  const absl::StatusOr<storage::KeptHead> head = HeadNow(*ledger_, runtime::DeadlineOf(*context));
  if (!head.ok()) return ToGrpc(head.status());
  *response = HeadOf(*head);
  return grpc::Status::OK;
}

grpc::Status LedgerService::GetBladeProof(grpc::ServerContext* context, const v1::GetBladeProofRequest* request,
                                          grpc::ServerWriter<v1::ProvenEntry>* writer) {
  const absl::StatusOr<std::string> serial = runtime::IdOf("name", "blades", request->name());
  if (!serial.ok()) return ToGrpc(serial.status());
  const storage::Deadline deadline = runtime::DeadlineOf(*context);
  const auto blade = blades_->Find(*serial, deadline);
  if (!blade.ok()) return ToGrpc(blade.status());
  if (!blade->has_value())
    return ToGrpc(runtime::Failure(errors::v1::BLADE_NOT_FOUND,
                                   "name: " + request->name() + ", want one that is registered",
                                   {{"resource", request->name()}}));
  const absl::StatusOr<storage::KeptHead> head = HeadNow(*ledger_, deadline);
  if (!head.ok()) return ToGrpc(head.status());
  v1::ProvenEntry first;
  *first.mutable_head() = HeadOf(*head);
  storage::ProofQuery query{*serial, head->head.tree_size, 0, kEntriesAtOnce, kMostRowBytes, kMostBytesAtOnce};
  for (bool more = true; more;) {
    const absl::StatusOr<storage::ProofPage> page = ledger_->ProofOfBlade(query, deadline);
    if (!page.ok()) return ToGrpc(page.status());
    if (query.after_sequence == 0) first.set_unsealed_count(page->unsealed_count);
    for (const storage::EntryProof& proof : page->entries) {
      v1::ProvenEntry message = ProvenOf(proof);
      message.MergeFrom(first);
      first.Clear();
      if (!writer->Write(message)) return ToGrpc(absl::CancelledError("proof: the client went away"));
      query.after_sequence = proof.sealed.leaf.record_sequence;
    }
    more = page->more;
  }
  if (!first.has_head()) return grpc::Status::OK;
  return ToGrpc(
      runtime::Failure(errors::v1::LEDGER_NOT_SEALED, "ledger: nothing of " + request->name() + " is sealed yet"));
}

grpc::Status LedgerService::VerifyLedger(grpc::ServerContext* context, const v1::VerifyLedgerRequest* request,
                                         grpc::ServerWriter<v1::LedgerSlice>* writer) {
  const auto slot = checks_.Enter(runtime::DeadlineOf(*context), runtime::KeepGoing(*context));
  if (!slot.ok()) return ToGrpc(slot.status());
  return ToGrpc(Check(*ledger_, *clearances_, context, writer).Run(request->with_blobs()));
}

}  // namespace sixpoint::plant
