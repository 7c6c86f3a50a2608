#include "storage/ledger_check.h"

#include <algorithm>
#include <set>
#include <utility>

#include "storage/each_row.h"
#include "storage/ledger.h"
#include "storage/ledger_rows.h"

namespace sixpoint::storage {
namespace {

using ledger::Leaf;

constexpr int kSome = 20;
constexpr std::int64_t kMostExtraNames = 1000;  // of a slice
constexpr char kContents[] =
    "SELECT c.record_id, c.content FROM unnest($1::uuid[]) AS batch (id) JOIN public.ledger_contents c "
    "ON c.record_id = batch.id WHERE c.record_id BETWEEN $2 AND $3";
constexpr char kNameOf[] = "SELECT name, record_sequence FROM public.record_names WHERE record_id = $1";
constexpr char kHasLeaf[] = "SELECT 1 FROM public.ledger_leaves WHERE record_id = $1";
constexpr char kInputsOf[] = "SELECT input_id FROM public.record_inputs WHERE record_id = $1";
constexpr char kUnplain[] =
    "SELECT wanted.name, coalesce(c.relkind::text, '-'), coalesce(c.relrowsecurity, false), "
    "EXISTS (SELECT 1 FROM pg_rewrite r WHERE r.ev_class = c.oid) FROM unnest($1::text[]) AS wanted (name) "
    "LEFT JOIN pg_class c ON c.relname = wanted.name AND c.relnamespace = 'public'::regnamespace "
    "WHERE c.oid IS NULL OR c.relkind NOT IN ('r', 'p') OR c.relrowsecurity "
    "OR EXISTS (SELECT 1 FROM pg_rewrite r WHERE r.ev_class = c.oid)";
constexpr char kCountUnsealedAfter[] = "SELECT count(*) FROM public.record_names WHERE record_sequence > $1";
struct BlobReference {
  const char *table, *column;
};
constexpr BlobReference kBlobReferences[] = {{"scan_blocks", "blob_sha256"},
                                             {"scan_blocks", "evidence_sha256"},
                                             {"tessellations", "cad_sha256"},
                                             {"tessellations", "surface_sha256"},
                                             {"calibrations", "request_sha256"},
                                             {"studies", "request_sha256"},
                                             {"corrections", "nc_program_sha256"},
                                             {"corrections", "nc_template_sha256"},
                                             {"corrections", "nc_held_sha256"},
                                             {"program_fetches", "program_sha256"},
                                             {"machining_model_revisions", "nc_template_sha256"},
                                             {"deviation_cloud_blocks", "blob_sha256"},
                                             {"reconstructions", "lattice_sha256"}};

// Bytes may be gone where a deletion says so, and that is of scans alone.
std::string BlobsSql() {
  std::string named = "false";
  for (const BlobReference& reference : kBlobReferences) {
    named += std::string(" OR EXISTS (SELECT 1 FROM public.") + reference.table + " t WHERE t." + reference.column +
             " = b.sha256";
    if (std::string(reference.table) == "scan_blocks")
      named += " AND NOT EXISTS (SELECT 1 FROM public.scan_deletions d WHERE d.scan_key = t.scan_key)";
    named += ")";
  }
  return "SELECT b.sha256, CASE WHEN b.deleted_at IS NULL THEN b.store = 'postgresql' AND sha256(b.bytes) IS DISTINCT "
         "FROM b.sha256 END, b.deleted_at IS NOT NULL AND (" +
         named + ") FROM public.blobs b WHERE b.sha256 > $1 ORDER BY b.sha256 LIMIT $2";
}

// All that a slice is checked by.
struct SealedSlice {
  std::vector<Leaf> leaves;
  std::map<std::string, NamedRecord> names;  // by record_id
  std::map<std::string, Content> contents;   // of now
  std::map<std::string, std::string> kept;   // contents as they were sealed
  std::set<std::string> months;
};

absl::StatusOr<std::map<std::string, std::string>> ReadKept(Transaction& transaction,
                                                            const std::vector<std::string>& ids) {
  std::map<std::string, std::string> kept;
  if (ids.empty()) return kept;
  Params params;
  params.Uuids(ids).Uuid(*std::min_element(ids.begin(), ids.end())).Uuid(*std::max_element(ids.begin(), ids.end()));
  const absl::StatusOr<Rows> rows = transaction.Execute(kContents, params);
  if (!rows.ok()) return rows.status();
  for (int row = 0; row < rows->count(); ++row) kept[rows->Text(row, 0)] = rows->Text(row, 1);
  return rows->Checked(std::move(kept));
}

absl::StatusOr<SealedSlice> ReadSealed(Transaction& transaction, ledger::LeafSpan span, std::int64_t after_sequence) {
  SealedSlice sealed;
  absl::StatusOr<std::vector<Leaf>> leaves = ReadLeaves(transaction, span);
  if (!leaves.ok()) return leaves.status();
  sealed.leaves = *std::move(leaves);
  if (sealed.leaves.empty()) return sealed;
  const absl::StatusOr<LedgerColumns> columns = ReadLedgerColumns(transaction);
  if (!columns.ok()) return columns.status();
  std::int64_t last = 0;
  for (const Leaf& leaf : sealed.leaves) last = std::max(last, leaf.record_sequence);
  const auto names = ReadNames(transaction, *columns, after_sequence, last, span.end - span.begin + kMostExtraNames);
  if (!names.ok()) return names.status();
  for (const NamedRecord& name : *names) sealed.names[name.record_id] = name;
  std::vector<std::string> ids;
  for (const Leaf& leaf : sealed.leaves) ids.push_back(leaf.record_id);
  auto contents = ReadContents(transaction, *columns, ids);
  if (!contents.ok()) return contents.status();
  sealed.contents = *std::move(contents);
  auto kept = ReadKept(transaction, ids);
  if (!kept.ok()) return kept.status();
  sealed.kept = *std::move(kept);
  absl::StatusOr<std::set<std::string>> months = AttachedMonths(transaction);
  if (!months.ok()) return months.status();
  sealed.months = *std::move(months);
  return sealed;
}

class SliceCheck {
 public:
  SliceCheck(Transaction& transaction, const SealedSlice& sealed, LedgerSlice* slice)
      : transaction_(transaction), sealed_(sealed), slice_(*slice) {
    for (const Leaf& leaf : sealed.leaves) ids_.insert(leaf.record_id), sequences_.insert(leaf.record_sequence);
  }

  absl::Status Check(const Leaf& leaf) {
    if (absl::Status named = CheckName(leaf); !named.ok()) return named;
    if (leaf.format != kLedgerFormat) {
      Add(leaf, DamageKind::kChanged, "ledger_leaves",
          "of format " + std::to_string(leaf.format) + ", want " + std::to_string(kLedgerFormat));
      return absl::OkStatus();
    }
    const auto now = sealed_.contents.find(leaf.record_id);
    const Content rows = now == sealed_.contents.end() ? Content() : now->second;
    const std::string month = MonthOf(leaf.record_id);
    const bool is_here = sealed_.months.count(month) > 0 || HasRowsOfItsMonth(rows);
    if (!is_here) ++slice_.not_here[month];
    const auto kept = sealed_.kept.find(leaf.record_id);
    const bool is_kept = kept != sealed_.kept.end() && ledger::Sha256(kept->second) == leaf.content_sha256;
    if (!is_kept)
      Add(leaf, kept == sealed_.kept.end() ? DamageKind::kMissing : DamageKind::kChanged, "ledger_contents",
          "what was sealed of its tables");
    if (ledger::Sha256(ContentText(rows)) == leaf.content_sha256) return absl::OkStatus();
    if (is_kept) return Compare(leaf, ContentOf(kept->second), rows, is_here);
    if (!is_here) return absl::OkStatus();  // without what was sealed nothing says which rows stayed
    Add(leaf, DamageKind::kChanged, "ledger_leaves", "its leaf does not fit to its rows");
    return absl::OkStatus();
  }

  // Entries in between that were never sealed, though later ones were.
  absl::Status CheckExtra() {
    for (const auto& [id, name] : sealed_.names) {
      if (ids_.count(id) > 0) continue;
      const absl::StatusOr<Rows> leaf = transaction_.Execute(kHasLeaf, Params().Uuid(id));
      if (!leaf.ok()) return leaf.status();
      if (leaf->count() > 0) continue;  // told where its leaf is
      slice_.damages.push_back(
          {DamageKind::kExtra, "record_names", name.name, id, name.sequence, "entered before others that were sealed"});
    }
    return absl::OkStatus();
  }

 private:
  void Add(const Leaf& leaf, DamageKind kind, const std::string& table, const std::string& detail) {
    const auto name = sealed_.names.find(leaf.record_id);
    slice_.damages.push_back({kind, table, name == sealed_.names.end() ? "" : name->second.name, leaf.record_id,
                              leaf.record_sequence, detail});
  }

  // Rows of an entry are in its month or nowhere, but for those that stand with what the entry was made from.
  static bool HasRowsOfItsMonth(const Content& rows) {
    return std::any_of(rows.begin(), rows.end(), [](const auto& of_table) {
      const LedgerTable* const table = TableOf(of_table.first);
      return IsByMonths(of_table.first) && table != nullptr && !table->kept_by_another;
    });
  }

  static const LedgerTable* TableOf(const std::string& name) {
    const auto found = std::find_if(LedgerTables().begin(), LedgerTables().end(),
                                    [&](const LedgerTable& one) { return name == one.name; });
    return found == LedgerTables().end() ? nullptr : &*found;
  }

  absl::Status CheckName(const Leaf& leaf) {
    const auto found = sealed_.names.find(leaf.record_id);
    if (found != sealed_.names.end()) {
      if (found->second.row_sha256 == leaf.name_sha256) return absl::OkStatus();
      const std::int64_t stands = found->second.sequence;
      const bool is_swapped = stands != leaf.record_sequence && sequences_.count(stands) > 0;
      Add(leaf, is_swapped ? DamageKind::kSwapped : DamageKind::kChanged, "record_names",
          stands == leaf.record_sequence ? "name or time" : "stands as entry " + std::to_string(stands));
      return absl::OkStatus();
    }
    const absl::StatusOr<Rows> elsewhere = transaction_.Execute(kNameOf, Params().Uuid(leaf.record_id));
    if (!elsewhere.ok()) return elsewhere.status();
    if (elsewhere->count() == 0) {
      Add(leaf, DamageKind::kMissing, "record_names", "the entry");
    } else {
      slice_.damages.push_back({DamageKind::kSwapped, "record_names", elsewhere->Text(0, 0), leaf.record_id,
                                leaf.record_sequence, "stands as entry " + std::to_string(elsewhere->Int(0, 1))});
    }
    return elsewhere->status();
  }

  // is_here: its month; else the rows of months are elsewhere, and those of the other tables must have stayed.
  absl::Status Compare(const Leaf& leaf, const Content& sealed, const Content& now, bool is_here) {
    std::set<std::string> tables;
    for (const auto& [table, rows] : sealed) tables.insert(table);
    for (const auto& [table, rows] : now) tables.insert(table);
    for (const std::string& table : tables) {
      const auto was = sealed.find(table), is = now.find(table);
      const RowsDigest before = was == sealed.end() ? RowsDigest() : was->second;
      const RowsDigest after = is == now.end() ? RowsDigest() : is->second;
      if (before.count == after.count && before.sha256 == after.sha256) continue;
      if (!is_here && after.count == 0 && IsByMonths(table)) continue;
      if (after.count < before.count) {
        const absl::StatusOr<bool> elsewhere = IsKeptElsewhere(leaf, table);
        if (!elsewhere.ok()) return elsewhere.status();
        if (*elsewhere) continue;
      }
      const DamageKind kind = after.count < before.count   ? DamageKind::kMissing
                              : after.count > before.count ? DamageKind::kExtra
                                                           : DamageKind::kChanged;
      Add(leaf, kind, table, std::to_string(after.count) + " rows, sealed " + std::to_string(before.count));
    }
    return absl::OkStatus();
  }

  // Rows that stand in the month of what the entry was made from, and went with it.
  absl::StatusOr<bool> IsKeptElsewhere(const Leaf& leaf, const std::string& table) {
    const LedgerTable* const found = TableOf(table);
    if (found == nullptr || !found->kept_by_another) return false;
    const absl::StatusOr<Rows> inputs = transaction_.Execute(kInputsOf, Params().Uuid(leaf.record_id));
    if (!inputs.ok()) return inputs.status();
    for (int row = 0; row < inputs->count(); ++row) {
      const std::string month = MonthOf(inputs->Text(row, 0));
      if (sealed_.months.count(month) > 0) continue;
      ++slice_.not_here[month];
      return true;
    }
    return inputs->Checked(false);
  }

  Transaction& transaction_;
  const SealedSlice& sealed_;
  LedgerSlice& slice_;
  std::set<std::string> ids_;
  std::set<std::int64_t> sequences_;
};

absl::StatusOr<std::vector<LedgerDamage>> DamagesOf(const absl::StatusOr<Rows>& rows, DamageKind kind,
                                                    const std::string& table, const std::string& detail) {
  if (!rows.ok()) return rows.status();
  std::vector<LedgerDamage> damages;
  for (int row = 0; row < rows->count(); ++row)
    damages.push_back({kind, table, "", "", 0, rows->OptionalText(row, 0) + detail});
  return rows->Checked(std::move(damages));
}

}  // namespace

absl::StatusOr<LedgerSlice> CheckSlice(Transaction& transaction, ledger::LeafSpan span, std::int64_t after_sequence) {
  LedgerSlice slice;
  slice.last_sequence = after_sequence;
  const absl::StatusOr<SealedSlice> sealed = ReadSealed(transaction, span, after_sequence);
  if (!sealed.ok()) return sealed.status();
  SliceCheck check(transaction, *sealed, &slice);
  std::int64_t index = span.begin;
  for (const Leaf& leaf : sealed->leaves) {
    for (; index < leaf.index; ++index) {
      slice.leaf_hashes.emplace_back(32, '\0');
      slice.damages.push_back({DamageKind::kMissing, "ledger_leaves", "", "", 0, "leaf " + std::to_string(index)});
    }
    ++index;
    slice.leaf_hashes.push_back(ledger::LeafHash(LeafText(leaf)));
    slice.last_sequence = std::max(slice.last_sequence, leaf.record_sequence);
    if (absl::Status checked = check.Check(leaf); !checked.ok()) return checked;
  }
  if (absl::Status extra = check.CheckExtra(); !extra.ok()) return extra;
  return slice;
}

absl::StatusOr<std::vector<LedgerDamage>> CheckTablesArePlain(Transaction& transaction) {
  std::vector<std::string> names = {"record_names", "ledger_leaves", "ledger_contents", "ledger_heads", "blobs"};
  for (const LedgerTable& table : LedgerTables()) names.emplace_back(table.name);
  return AllRows(transaction, kUnplain, Params().Texts(names), [](const Rows& rows, int row) -> LedgerDamage {
    return {DamageKind::kChanged,
            rows.Text(row, 0),
            "",
            "",
            0,
            "not a plain table: kind " + rows.Text(row, 1) + ", want r or p, without rules and policies"};
  });
}

absl::StatusOr<std::vector<LedgerDamage>> CheckOrphans(Transaction& transaction, std::size_t table_index) {
  const LedgerTable& table = LedgerTables()[table_index];
  // A surface is kept before the part that it was made for, which may be refused.
  if (std::string(table.name) == "tessellations") return std::vector<LedgerDamage>();
  const std::string of = table.owner, from = std::string(" FROM public.") + table.name + " t ";
  const std::string sql = std::string(table.join).empty()
                              ? "SELECT " + of + from + "LEFT JOIN public.record_names n ON n.record_id = " + of +
                                    " WHERE n.record_id IS NULL"
                              : "SELECT NULL" + from + "LEFT " + table.join + " WHERE " + of + " IS NULL";
  return DamagesOf(transaction.Execute(sql + " LIMIT " + std::to_string(kSome)), DamageKind::kExtra, table.name,
                   ": belongs to nothing recorded");
}

absl::StatusOr<std::int64_t> CountUnsealed(Transaction& transaction, std::int64_t last_sequence) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kCountUnsealedAfter, Params().Int(last_sequence));
  if (!rows.ok()) return rows.status();
  return rows->Checked(rows->Int(0, 0));
}

absl::StatusOr<BlobSlice> CheckBlobSlice(Transaction& transaction, const std::string& after_sha256, int limit) {
  const absl::StatusOr<Rows> rows = transaction.Execute(BlobsSql(), Params().Digest(after_sha256).Int(limit));
  if (!rows.ok()) return rows.status();
  BlobSlice slice;
  slice.count = rows->count();
  for (int row = 0; row < rows->count(); ++row) {
    slice.last_sha256 = rows->Digest(row, 0);
    if (!rows->IsNull(row, 1) && rows->Bool(row, 1))
      slice.damages.push_back({DamageKind::kChanged, "blobs", "", "", 0, slice.last_sha256 + ": other bytes"});
    if (rows->Bool(row, 2))
      slice.damages.push_back(
          {DamageKind::kMissing, "blobs", "", "", 0, slice.last_sha256 + ": bytes gone, and no deletion says so"});
  }
  return rows->Checked(std::move(slice));
}

absl::StatusOr<std::vector<LedgerDamage>> CheckBlobsAreThere(Transaction& transaction) {
  std::vector<LedgerDamage> damages;
  for (const BlobReference& reference : kBlobReferences) {
    const std::string column = std::string("t.") + reference.column;
    const std::string sql = "SELECT encode(" + column + ", 'hex') FROM public." + reference.table +
                            " t LEFT JOIN public.blobs b ON b.sha256 = " + column + " WHERE " + column +
                            " IS NOT NULL AND b.sha256 IS NULL LIMIT " + std::to_string(kSome);
    const auto found = DamagesOf(transaction.Execute(sql), DamageKind::kMissing, "blobs",
                                 std::string(": named by ") + reference.table);
    if (!found.ok()) return found.status();
    damages.insert(damages.end(), found->begin(), found->end());
  }
  return damages;
}

}  // namespace sixpoint::storage
