#include "tests/support/fake_ledger.h"

#include <algorithm>

#include "tests/support/some_uuid.h"

namespace sixpoint::testing {
namespace {

using storage::DamageKind;
using storage::Deadline;
using storage::LedgerDamage;

std::string NameRowOf(const FakeLedger::Entry& entry) {
  return "{\"name\":\"" + entry.name + "\",\"record_id\":\"" + entry.record_id + "\",\"record_sequence\":\"" +
         std::to_string(entry.sequence) + "\",\"recorded_at\":\"" + entry.recorded_at + "\"}";
}

std::vector<std::string> InTheirOrder(std::vector<std::string> rows) {
  std::sort(rows.begin(), rows.end(), [](const std::string& one, const std::string& other) {
    return ledger::Sha256(one) < ledger::Sha256(other);
  });
  return rows;
}

storage::Content ContentNow(const FakeLedger::Entry& entry) {
  storage::Content content;
  for (const auto& [table, rows] : entry.rows) {
    if (rows.empty()) continue;
    std::string digests;
    for (const std::string& row : InTheirOrder(rows)) digests += ledger::Sha256(row);
    content[table] = {static_cast<std::int64_t>(rows.size()), ledger::HexOf(ledger::Sha256(digests))};
  }
  return content;
}

std::size_t RowBytesOf(const std::vector<std::string>& rows) {
  std::size_t bytes = 0;
  for (const std::string& row : rows) bytes += row.size();
  return bytes;
}

// What concerns a blade is told by its row of the journal.
bool IsOfBlade(const FakeLedger::Entry& entry, const std::string& serial) {
  const auto journal = entry.rows.find("record_entries");
  return entry.blade == serial && journal != entry.rows.end() && !journal->second.empty();
}

LedgerDamage DamageOf(const ledger::Leaf& leaf, const FakeLedger::Entry& entry, DamageKind kind,
                      const std::string& table, const std::string& detail) {
  return {kind, table, entry.is_named ? entry.name : "", leaf.record_id, leaf.record_sequence, detail};
}

}  // namespace

std::int64_t FakeLedger::Record(const std::string& name, const std::string& blade, const std::string& record_id) {
  const auto lock = commits.Lock();
  Entry entry;
  entry.record_id = record_id;
  entry.name = name;
  entry.blade = blade;
  entry.sequence = static_cast<std::int64_t>(entries_.size()) + 1;
  entry.rows["record_entries"] = {"{\"blade_serial\":\"" + blade + "\",\"record_id\":\"" + record_id + "\"}"};
  entry.rows["record_roots"] = {"{\"record_id\":\"" + record_id + "\",\"root_id\":\"software\"}"};
  place_of_[record_id] = entries_.size();
  entries_.push_back(entry);
  return entry.sequence;
}

void FakeLedger::Tamper(const std::string& name, const std::function<void(Entry& entry)>& change) {
  const auto lock = commits.Lock();
  for (Entry& entry : entries_)
    if (entry.name == name) change(entry);
}

void FakeLedger::DropLeaf(std::int64_t index) {
  const auto lock = commits.Lock();
  leaf_of_.erase(leaves_.at(index).record_id);
  leaves_.erase(index);
}

void FakeLedger::SpoilNodes() {
  const auto lock = commits.Lock();
  for (storage::LedgerNode& node : nodes_) node.hash = ledger::Sha256("");
}

void FakeLedger::MakeUnplain(const std::string& table) {
  const auto lock = commits.Lock();
  unplain_.insert(table);
}

void FakeLedger::DetachMonth(const std::string& month) {
  const auto lock = commits.Lock();
  detached_months_.insert(month);
  for (Entry& entry : entries_) {
    if (storage::MonthOf(entry.record_id) != month) continue;
    for (auto& [table, rows] : entry.rows)
      if (storage::IsByMonths(table)) rows.clear();
  }
}

std::string FakeLedger::PutBlob(const std::string& bytes) {
  const auto lock = commits.Lock();
  const std::string sha256 = ledger::HexOf(ledger::Sha256(bytes));
  blobs_[sha256] = bytes;
  return sha256;
}

void FakeLedger::SpoilBlob(const std::string& sha256) {
  const auto lock = commits.Lock();
  blobs_[sha256] += "spoilt";
}

void FakeLedger::NameBlob(const std::string& sha256, const std::string& table) {
  const auto lock = commits.Lock();
  named_blobs_.emplace_back(table, sha256);
}

void FakeLedger::WhenAsked(Meanwhile meanwhile) {
  const auto lock = commits.Lock();
  meanwhile_ = std::move(meanwhile);
}

int FakeLedger::AskedCount(const std::string& question) const {
  const auto lock = commits.Lock();
  const auto asked = asked_count_.find(question);
  return asked == asked_count_.end() ? 0 : asked->second;
}

absl::Status FakeLedger::Asked(const char* question) const {
  Meanwhile meanwhile;
  {
    const auto lock = commits.Lock();
    ++asked_count_[question];
    meanwhile = meanwhile_;
  }
  if (meanwhile) meanwhile(question);
  const auto lock = commits.Lock();
  return commits.failure();
}

bool FakeLedger::IsSealed(const Entry& entry, std::int64_t size) const {
  const auto leaf = leaf_of_.find(entry.record_id);
  return leaf != leaf_of_.end() && leaf->second < size;
}

absl::StatusOr<ledger::Hash> FakeLedger::RootOf(ledger::LeafSpan span) const {
  ledger::CompactRange range;
  for (auto leaf = leaves_.lower_bound(span.begin); leaf != leaves_.lower_bound(span.end); ++leaf)
    range.Append(ledger::LeafHash(LeafText(leaf->second)));
  if (range.size() != span.end - span.begin)
    return absl::OutOfRangeError("ledger_leaves: fewer than " + std::to_string(span.end) + ", want all before it");
  return range.Root();
}

absl::StatusOr<int> FakeLedger::SchemaVersion(Deadline) const {
  if (absl::Status asked = Asked("SchemaVersion"); !asked.ok()) return asked;
  return schema_version.load();
}

absl::StatusOr<storage::LedgerEnd> FakeLedger::End(Deadline) const {
  if (absl::Status asked = Asked("End"); !asked.ok()) return asked;
  const auto lock = commits.Lock();
  if (leaves_.empty()) return storage::LedgerEnd();
  const ledger::Leaf& last = leaves_.rbegin()->second;
  return storage::LedgerEnd{last.index + 1, last.record_sequence};
}

absl::StatusOr<std::string> FakeLedger::PlantId(Deadline) const {
  if (absl::Status asked = Asked("PlantId"); !asked.ok()) return asked;
  return kSomeUuid;
}

absl::StatusOr<std::optional<storage::KeptHead>> FakeLedger::NewestHead(Deadline) const {
  if (absl::Status asked = Asked("NewestHead"); !asked.ok()) return asked;
  const auto lock = commits.Lock();
  if (heads_.empty()) return std::nullopt;
  return heads_.rbegin()->second;
}

absl::StatusOr<ledger::Hash> FakeLedger::Root(std::int64_t size, Deadline) const {
  if (absl::Status asked = Asked("Root"); !asked.ok()) return asked;
  const auto lock = commits.Lock();
  return RootOf({0, size});
}

absl::StatusOr<storage::EntryProof> FakeLedger::Prove(const ledger::Leaf& leaf, const Entry& entry,
                                                      const storage::ProofQuery& query) const {
  if (!entry.is_named) return absl::NotFoundError("record_names: " + leaf.record_id + ", want its row");
  storage::EntryProof proof{{leaf, contents_.at(leaf.record_id)}, {entry.name, NameRowOf(entry)}, {}, {}};
  for (const auto& [table, rows] : entry.rows)
    if (!rows.empty() && static_cast<std::int64_t>(RowBytesOf(rows)) <= query.most_row_bytes)
      proof.row_texts[table] = InTheirOrder(rows);
  for (const ledger::LeafSpan& span : ledger::PathSpans(leaf.index, query.tree_size)) {
    const absl::StatusOr<ledger::Hash> root = RootOf(span);
    if (!root.ok()) return root.status();
    proof.audit_path.push_back(*root);
  }
  return proof;
}

absl::StatusOr<storage::ProofPage> FakeLedger::ProofOfBlade(const storage::ProofQuery& query, Deadline) const {
  if (absl::Status asked = Asked("ProofOfBlade"); !asked.ok()) return asked;
  const auto lock = commits.Lock();
  storage::ProofPage page;
  if (query.after_sequence == 0)
    page.unsealed_count = std::count_if(entries_.begin(), entries_.end(), [&](const Entry& entry) {
      return IsOfBlade(entry, query.serial) && !IsSealed(entry, query.tree_size);
    });
  std::size_t bytes = 0;
  for (auto leaf = leaves_.begin(); leaf != leaves_.lower_bound(query.tree_size); ++leaf) {
    const Entry& entry = EntryOf(leaf->second);
    if (leaf->second.record_sequence <= query.after_sequence || !IsOfBlade(entry, query.serial)) continue;
    page.more = static_cast<int>(page.entries.size()) == query.most_entries || bytes > query.most_bytes;
    if (page.more) break;
    const absl::StatusOr<storage::EntryProof> proof = Prove(leaf->second, entry, query);
    if (!proof.ok()) return proof.status();
    for (const auto& [table, rows] : proof->row_texts) bytes += RowBytesOf(rows);
    page.entries.push_back(*proof);
  }
  return page;
}

void FakeLedger::CheckName(const ledger::Leaf& leaf, const Entry& entry, const std::set<std::int64_t>& sequences,
                           storage::LedgerSlice* slice) const {
  if (!entry.is_named) {
    slice->damages.push_back(DamageOf(leaf, entry, DamageKind::kMissing, "record_names", "the entry"));
  } else if (ledger::Sha256(NameRowOf(entry)) != leaf.name_sha256) {
    const bool is_moved = entry.sequence != leaf.record_sequence;
    slice->damages.push_back(DamageOf(
        leaf, entry, is_moved && sequences.count(entry.sequence) > 0 ? DamageKind::kSwapped : DamageKind::kChanged,
        "record_names", is_moved ? "stands as entry " + std::to_string(entry.sequence) : "name or time"));
  }
}

void FakeLedger::CheckRows(const ledger::Leaf& leaf, const Entry& entry, storage::LedgerSlice* slice) const {
  storage::Content sealed = storage::ContentOf(contents_.at(leaf.record_id)), now = ContentNow(entry);
  const std::string month = storage::MonthOf(leaf.record_id);
  const bool is_here = detached_months_.count(month) == 0;
  if (!is_here) ++slice->not_here[month];
  std::set<std::string> tables;
  for (const auto& [table, rows] : sealed) tables.insert(table);
  for (const auto& [table, rows] : now) tables.insert(table);
  for (const std::string& table : tables) {
    const storage::RowsDigest &before = sealed[table], &after = now[table];
    if (before.count == after.count && before.sha256 == after.sha256) continue;
    if (!is_here && after.count == 0 && storage::IsByMonths(table)) continue;
    const DamageKind kind = after.count < before.count   ? DamageKind::kMissing
                            : after.count > before.count ? DamageKind::kExtra
                                                         : DamageKind::kChanged;
    slice->damages.push_back(DamageOf(leaf, entry, kind, table,
                                      std::to_string(after.count) + " rows, sealed " + std::to_string(before.count)));
  }
}

absl::StatusOr<storage::CheckedLeaves> FakeLedger::CheckLeaves(ledger::LeafSpan span, std::int64_t after_sequence,
                                                               Deadline) const {
  if (absl::Status asked = Asked("CheckLeaves"); !asked.ok()) return asked;
  const auto lock = commits.Lock();
  storage::CheckedLeaves checked;
  storage::LedgerSlice& slice = checked.slice;
  slice.last_sequence = after_sequence;
  const auto begin = leaves_.lower_bound(span.begin), end = leaves_.lower_bound(span.end);
  std::set<std::int64_t> sequences;
  for (auto leaf = begin; leaf != end; ++leaf) sequences.insert(leaf->second.record_sequence);
  std::int64_t index = span.begin;
  for (auto at = begin; at != end; ++at, ++index) {
    const ledger::Leaf& leaf = at->second;
    for (; index < leaf.index; ++index) {
      slice.leaf_hashes.emplace_back(32, '\0');
      slice.damages.push_back({DamageKind::kMissing, "ledger_leaves", "", "", 0, "leaf " + std::to_string(index)});
    }
    slice.leaf_hashes.push_back(ledger::LeafHash(LeafText(leaf)));
    slice.last_sequence = std::max(slice.last_sequence, leaf.record_sequence);
    CheckName(leaf, EntryOf(leaf), sequences, &slice);
    CheckRows(leaf, EntryOf(leaf), &slice);
  }
  const std::int64_t size = leaves_.empty() ? 0 : leaves_.rbegin()->first + 1;
  for (const Entry& entry : entries_)
    if (entry.is_named && entry.sequence > after_sequence && entry.sequence <= slice.last_sequence &&
        !IsSealed(entry, size))
      slice.damages.push_back({DamageKind::kExtra, "record_names", entry.name, entry.record_id, entry.sequence,
                               "entered before others that were sealed"});
  for (auto head = heads_.upper_bound(span.begin); head != heads_.upper_bound(span.end); ++head)
    checked.heads.push_back(head->second);
  for (const storage::LedgerNode& node : nodes_) {
    const std::int64_t node_end = (node.index + 1) << node.level;
    if (node_end > span.begin && node_end <= span.end) checked.nodes.push_back(node);
  }
  return checked;
}

absl::StatusOr<std::vector<LedgerDamage>> FakeLedger::CheckTablesArePlain(Deadline) const {
  if (absl::Status asked = Asked("CheckTablesArePlain"); !asked.ok()) return asked;
  const auto lock = commits.Lock();
  std::vector<LedgerDamage> damages;
  for (const std::string& table : unplain_)
    damages.push_back(
        {DamageKind::kChanged, table, "", "", 0, "not a plain table: kind r, want r or p, without rules and policies"});
  return damages;
}

absl::StatusOr<std::vector<LedgerDamage>> FakeLedger::CheckOrphans(std::size_t table_index, Deadline) const {
  if (absl::Status asked = Asked("CheckOrphans"); !asked.ok()) return asked;
  const auto lock = commits.Lock();
  const std::string table = storage::LedgerTables().at(table_index).name;
  std::vector<LedgerDamage> damages;
  for (const Entry& entry : entries_) {
    const auto rows = entry.rows.find(table);
    if (entry.is_named || rows == entry.rows.end()) continue;
    damages.insert(damages.end(), rows->second.size(),
                   {DamageKind::kExtra, table, "", "", 0, entry.record_id + ": belongs to nothing recorded"});
  }
  return damages;
}

absl::StatusOr<std::int64_t> FakeLedger::CountUnsealed(std::int64_t last_sequence, Deadline) const {
  if (absl::Status asked = Asked("CountUnsealed"); !asked.ok()) return asked;
  const auto lock = commits.Lock();
  return std::count_if(entries_.begin(), entries_.end(),
                       [&](const Entry& entry) { return entry.is_named && entry.sequence > last_sequence; });
}

absl::StatusOr<std::vector<LedgerDamage>> FakeLedger::CheckBlobsAreThere(Deadline) const {
  if (absl::Status asked = Asked("CheckBlobsAreThere"); !asked.ok()) return asked;
  const auto lock = commits.Lock();
  std::vector<LedgerDamage> damages;
  for (const auto& [table, sha256] : named_blobs_)
    if (blobs_.count(sha256) == 0)
      damages.push_back({DamageKind::kMissing, "blobs", "", "", 0, sha256 + ": named by " + table});
  return damages;
}

absl::StatusOr<storage::BlobSlice> FakeLedger::CheckBlobSlice(const std::string& after_sha256, int limit,
                                                              Deadline) const {
  if (absl::Status asked = Asked("CheckBlobSlice"); !asked.ok()) return asked;
  const auto lock = commits.Lock();
  storage::BlobSlice slice;
  for (auto blob = blobs_.upper_bound(after_sha256); blob != blobs_.end() && slice.count < limit; ++blob) {
    ++slice.count;
    slice.last_sha256 = blob->first;
    if (ledger::HexOf(ledger::Sha256(blob->second)) != blob->first)
      slice.damages.push_back({DamageKind::kChanged, "blobs", "", "", 0, blob->first + ": other bytes"});
  }
  return slice;
}

absl::StatusOr<storage::Sealed> FakeLedger::Seal(std::int64_t limit, Deadline) {
  if (absl::Status asked = Asked("Seal"); !asked.ok()) return asked;
  const auto lock = commits.Lock();
  const std::int64_t last = leaves_.empty() ? 0 : leaves_.rbegin()->second.record_sequence;
  storage::Sealed sealed;
  for (const Entry& entry : entries_) {
    if (!entry.is_named || entry.sequence <= last) continue;
    if (sealed.count == limit) break;
    const std::string content = storage::ContentText(ContentNow(entry));
    const ledger::Leaf leaf{range_.size(),
                            entry.sequence,
                            entry.record_id,
                            storage::kLedgerFormat,
                            ledger::Sha256(NameRowOf(entry)),
                            ledger::Sha256(content)};
    contents_[entry.record_id] = content;
    leaves_[leaf.index] = leaf;
    leaf_of_[entry.record_id] = leaf.index;
    range_.Append(ledger::LeafHash(LeafText(leaf)), [&](int level, std::int64_t index, const ledger::Hash& hash) {
      if (level >= storage::kLeastKeptLevel) nodes_.push_back({level, index, hash});
    });
    ++sealed.count;
  }
  sealed.more = sealed.count == limit;
  return sealed;
}

absl::Status FakeLedger::KeepHead(const storage::KeptHead& head, Deadline) {
  if (absl::Status asked = Asked("KeepHead"); !asked.ok()) return asked;
  const auto lock = commits.Lock();
  const auto kept = heads_.insert({head.head.tree_size, head}).first;
  kept->second.head.plant_id = kSomeUuid;  // a plant's own, whatever is said
  return absl::OkStatus();
}

}  // namespace sixpoint::testing
