#include "storage/ledger.h"

#include <ctime>
#include <utility>

#include "storage/each_row.h"

namespace sixpoint::storage {
namespace {

using ledger::Hash;
using ledger::HexOf;
using ledger::Leaf;
using ledger::LeafSpan;

// One sealer at a time, whatever processes run.
constexpr char kLockLedger[] = "SELECT pg_try_advisory_xact_lock(6021, 5)";
constexpr char kLedgerEnd[] =
    "SELECT leaf_index + 1, record_sequence FROM public.ledger_leaves ORDER BY leaf_index DESC LIMIT 1";
constexpr char kInsertLeaves[] =
    "INSERT INTO public.ledger_leaves (leaf_index, record_sequence, record_id, format, name_sha256, content_sha256) "
    "SELECT $1::bigint + place - 1, sequence, id, $2::smallint, name, content FROM unnest($3::bigint[], $4::uuid[], "
    "$5::bytea[], $6::bytea[]) WITH ORDINALITY AS leaf (sequence, id, name, content, place)";
constexpr char kInsertContents[] =
    "INSERT INTO public.ledger_contents (record_id, content) SELECT id, content FROM unnest($1::uuid[], $2::text[]) AS "
    "c (id, content)";
constexpr char kInsertNodes[] =
    "INSERT INTO public.ledger_nodes (level, node_index, hash) SELECT level, node, hash FROM unnest($1::smallint[], "
    "$2::bigint[], $3::bytea[]) AS n (level, node, hash)";
constexpr char kSelectLeaves[] =
    "SELECT leaf_index, record_sequence, record_id, format, name_sha256, content_sha256 FROM public.ledger_leaves "
    "WHERE leaf_index >= $1 AND leaf_index < $2 ORDER BY leaf_index";
constexpr char kSelectNode[] = "SELECT hash FROM public.ledger_nodes WHERE level = $1 AND node_index = $2";
constexpr char kSelectNodes[] =
    "SELECT n.level, n.node_index, n.hash FROM generate_series(8, 62) AS at (height) JOIN public.ledger_nodes n "
    "ON n.level = at.height AND n.node_index BETWEEN ($1::bigint >> at.height) - 1 AND $2::bigint >> at.height "
    "WHERE ((n.node_index + 1) << n.level) > $1 AND ((n.node_index + 1) << n.level) <= $2 "
    "ORDER BY (n.node_index + 1) << n.level, n.level";
constexpr char kPlantId[] = "SELECT plant_id FROM public.plant_identity";
constexpr char kInsertLedgerHead[] =
    "INSERT INTO public.ledger_heads (tree_size, root_sha256, record_sequence, signed_at, key_id, signature, "
    "public_key) VALUES ($1, $2, $3, $4::timestamptz, $5, $6, $7) ON CONFLICT (tree_size) DO NOTHING";
constexpr char kSelectHeads[] =
    "SELECT i.plant_id, h.tree_size, h.root_sha256, h.record_sequence, to_char(h.signed_at, "
    "'YYYY-MM-DD\"T\"HH24:MI:SS\"Z\"'), h.key_id, h.signature, h.public_key FROM public.ledger_heads h, "
    "public.plant_identity i WHERE h.tree_size > $1 AND h.tree_size <= $2 ORDER BY h.tree_size";
constexpr char kSelectNewestHead[] = "SELECT max(tree_size) FROM public.ledger_heads";
constexpr char kSelectOfBlade[] =
    "SELECT l.leaf_index, l.record_sequence, l.record_id, l.format, l.name_sha256, l.content_sha256, c.content "
    "FROM public.record_entries e JOIN public.ledger_leaves l ON l.record_id = e.record_id "
    "LEFT JOIN public.ledger_contents c ON c.record_id = e.record_id "
    "WHERE e.blade_serial = $1 AND l.leaf_index < $2 AND e.record_sequence > $3 ORDER BY e.record_sequence LIMIT $4";
constexpr char kCountUnsealedOfBlade[] =
    "SELECT count(*) FROM public.record_entries e LEFT JOIN public.ledger_leaves l ON l.record_id = e.record_id "
    "WHERE e.blade_serial = $1 AND (l.leaf_index IS NULL OR l.leaf_index >= $2)";

Leaf LeafOf(const Rows& rows, int row) {
  return {rows.Int(row, 0),   rows.Int(row, 1),  rows.Text(row, 2), static_cast<int>(rows.Int(row, 3)),
          rows.Bytes(row, 4), rows.Bytes(row, 5)};
}

// PostgreSQL's text of an array of numbers.
std::string NumbersText(const std::vector<std::int64_t>& numbers) {
  std::string text = "{";
  for (const std::int64_t number : numbers) text += (text.size() > 1 ? "," : "") + std::to_string(number);
  return text + "}";
}

absl::Status AppendSubtree(Transaction& transaction, int level, std::int64_t index, ledger::CompactRange* range) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectNode, Params().Int(level).Int(index));
  if (!rows.ok()) return rows.status();
  if (rows->count() != 1)
    return absl::DataLossError("ledger_nodes: none at level " + std::to_string(level) + ", index " +
                               std::to_string(index) + ", want each complete subtree");
  range->AppendSubtree(level, rows->Bytes(0, 0));
  return rows->status();
}

// The first leaves of a subtree that begins there: those of kept subtrees by these, the rest one by one.
absl::StatusOr<ledger::CompactRange> RangeOf(Transaction& transaction, LeafSpan span) {
  ledger::CompactRange range;
  std::int64_t at = span.begin;
  for (int level = 62; level >= kLeastKeptLevel; --level) {
    const std::int64_t count = std::int64_t{1} << level;
    if (span.end - at < count) continue;
    if (absl::Status added = AppendSubtree(transaction, level, at >> level, &range); !added.ok()) return added;
    at += count;
  }
  const absl::StatusOr<std::vector<Leaf>> leaves = ReadLeaves(transaction, {at, span.end});
  if (!leaves.ok()) return leaves.status();
  for (const Leaf& leaf : *leaves) range.Append(ledger::LeafHash(LeafText(leaf)));
  if (range.size() != span.end - span.begin)
    return absl::OutOfRangeError("ledger_leaves: fewer than " + std::to_string(span.end) + ", want all before it");
  return range;
}

struct NewLeaves {
  std::vector<std::int64_t> sequences;
  std::vector<std::string> ids, name_hex, content_hex;
  std::vector<std::string> contents;
  std::vector<std::int64_t> levels, nodes;
  std::vector<std::string> node_hex;
};

NewLeaves LeavesOf(const std::vector<NamedRecord>& names, const std::map<std::string, Content>& contents,
                   ledger::CompactRange range) {
  NewLeaves made;
  const auto on_node = [&](int level, std::int64_t index, const Hash& hash) {
    if (level < kLeastKeptLevel) return;
    made.levels.push_back(level);
    made.nodes.push_back(index);
    made.node_hex.push_back(HexOf(hash));
  };
  for (const NamedRecord& name : names) {
    const auto found = contents.find(name.record_id);
    const std::string content = found == contents.end() ? "" : ContentText(found->second);
    const Leaf leaf{range.size(),  name.sequence,   name.record_id,
                    kLedgerFormat, name.row_sha256, ledger::Sha256(content)};
    made.sequences.push_back(leaf.record_sequence);
    made.ids.push_back(leaf.record_id);
    made.name_hex.push_back(HexOf(leaf.name_sha256));
    made.content_hex.push_back(HexOf(leaf.content_sha256));
    made.contents.push_back(content);
    range.Append(ledger::LeafHash(LeafText(leaf)), on_node);
  }
  return made;
}

absl::Status Insert(Transaction& transaction, std::int64_t first, const NewLeaves& leaves) {
  Params params;
  params.Int(first).Int(kLedgerFormat).Text(NumbersText(leaves.sequences)).Uuids(leaves.ids);
  params.Digests(leaves.name_hex).Digests(leaves.content_hex);
  absl::Status done = transaction.Execute(kInsertLeaves, params).status();
  if (done.ok())
    done = transaction.Execute(kInsertContents, Params().Uuids(leaves.ids).Texts(leaves.contents)).status();
  if (!done.ok() || leaves.levels.empty()) return done;
  Params nodes;
  nodes.Text(NumbersText(leaves.levels)).Text(NumbersText(leaves.nodes)).Digests(leaves.node_hex);
  return transaction.Execute(kInsertNodes, nodes).status();
}

}  // namespace

absl::StatusOr<LedgerEnd> ReadLedgerEnd(Transaction& transaction) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kLedgerEnd);
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return LedgerEnd();
  return rows->Checked(LedgerEnd{rows->Int(0, 0), rows->Int(0, 1)});
}

absl::StatusOr<Sealed> SealEntries(Transaction& transaction, std::int64_t limit) {
  const absl::StatusOr<Rows> locked = transaction.Execute(kLockLedger);
  if (!locked.ok()) return locked.status();
  if (!locked->Bool(0, 0)) return Sealed();
  const absl::StatusOr<LedgerEnd> end = ReadLedgerEnd(transaction);
  if (!end.ok()) return end.status();
  const absl::StatusOr<LedgerColumns> columns = ReadLedgerColumns(transaction);
  if (!columns.ok()) return columns.status();
  const auto names =
      ReadNames(transaction, *columns, end->record_sequence, std::numeric_limits<std::int64_t>::max(), limit);
  if (!names.ok()) return names.status();
  if (names->empty()) return Sealed();
  std::vector<std::string> ids;
  for (const NamedRecord& name : *names) ids.push_back(name.record_id);
  const auto contents = ReadContents(transaction, *columns, ids);
  if (!contents.ok()) return contents.status();
  absl::StatusOr<ledger::CompactRange> range = RangeOf(transaction, {0, end->size});
  if (!range.ok()) return range.status();
  const NewLeaves leaves = LeavesOf(*names, *contents, *std::move(range));
  if (absl::Status inserted = Insert(transaction, end->size, leaves); !inserted.ok()) return inserted;
  const auto count = static_cast<std::int64_t>(names->size());
  return Sealed{count, count == limit};
}

absl::StatusOr<std::vector<Leaf>> ReadLeaves(Transaction& transaction, LeafSpan span) {
  return AllRows(transaction, kSelectLeaves, Params().Int(span.begin).Int(span.end), LeafOf);
}

absl::StatusOr<Hash> RootOf(Transaction& transaction, LeafSpan span) {
  const absl::StatusOr<ledger::CompactRange> range = RangeOf(transaction, span);
  if (!range.ok()) return range.status();
  return range->Root();
}

absl::StatusOr<std::vector<Hash>> PathOf(Transaction& transaction, std::int64_t index, std::int64_t size) {
  std::vector<Hash> path;
  for (const LeafSpan& span : ledger::PathSpans(index, size)) {
    absl::StatusOr<Hash> root = RootOf(transaction, span);
    if (!root.ok()) return root.status();
    path.push_back(*std::move(root));
  }
  return path;
}

absl::StatusOr<std::vector<LedgerNode>> ReadNodes(Transaction& transaction, LeafSpan span) {
  return AllRows(transaction, kSelectNodes, Params().Int(span.begin).Int(span.end),
                 [](const Rows& rows, int row) -> LedgerNode {
                   return {static_cast<int>(rows.Int(row, 0)), rows.Int(row, 1), rows.Bytes(row, 2)};
                 });
}

absl::StatusOr<std::string> PlantId(Transaction& transaction) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kPlantId);
  if (!rows.ok()) return rows.status();
  if (rows->count() != 1) return absl::DataLossError("plant_identity: no row, want one");
  return rows->Checked(rows->Text(0, 0));
}

absl::Status KeepHead(Transaction& transaction, const KeptHead& kept) {
  Params params;
  params.Int(kept.head.tree_size).Bytes(kept.head.root).Int(kept.head.record_sequence).Text(kept.head.signed_at);
  params.Text(kept.head.key_id).Bytes(kept.head.signature).Text(kept.public_key);
  return transaction.Execute(kInsertLedgerHead, params).status();
}

absl::StatusOr<std::vector<KeptHead>> ReadHeads(Transaction& transaction, std::int64_t after, std::int64_t until) {
  return AllRows(transaction, kSelectHeads, Params().Int(after).Int(until), [](const Rows& rows, int row) -> KeptHead {
    return {{rows.Text(row, 0), rows.Int(row, 1), rows.Bytes(row, 2), rows.Int(row, 3), rows.Text(row, 4),
             rows.Text(row, 5), rows.Bytes(row, 6)},
            rows.Text(row, 7)};
  });
}

absl::StatusOr<std::optional<KeptHead>> NewestHead(Transaction& transaction) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectNewestHead);
  if (!rows.ok()) return rows.status();
  if (rows->IsNull(0, 0)) return std::nullopt;
  const std::int64_t size = rows->Int(0, 0);
  absl::StatusOr<std::vector<KeptHead>> heads = ReadHeads(transaction, size - 1, size);
  if (!heads.ok()) return heads.status();
  if (heads->empty()) return std::nullopt;
  return heads->front();
}

absl::StatusOr<std::vector<SealedEntry>> SealedOfBlade(Transaction& transaction, const std::string& serial,
                                                       std::int64_t size, std::int64_t after_sequence, int limit) {
  return AllRows(transaction, kSelectOfBlade, Params().Text(serial).Int(size).Int(after_sequence).Int(limit),
                 [](const Rows& rows, int row) -> SealedEntry {
                   return {LeafOf(rows, row), rows.OptionalText(row, 6)};
                 });
}

absl::StatusOr<std::int64_t> CountUnsealedOfBlade(Transaction& transaction, const std::string& serial,
                                                  std::int64_t size) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kCountUnsealedOfBlade, Params().Text(serial).Int(size));
  if (!rows.ok()) return rows.status();
  return rows->Checked(rows->Int(0, 0));
}

}  // namespace sixpoint::storage
