// Recall and its opposite: what was made from a thing, and what a thing was made from.
#include <algorithm>
#include <iterator>
#include <limits>
#include <utility>

#include "storage/clearances.h"
#include "storage/entries.h"

namespace sixpoint::storage {
namespace {

// What was made from it, step by step by the index of the inputs, as far as the next root: from there on its roots say it.
constexpr char kSelectStart[] =
    "WITH RECURSIVE near (record_id, is_origin, root) AS ("
    "SELECT n.record_id, true, is_root(n.name) FROM record_names n WHERE " SIXPOINT_MEANT
    " UNION SELECT i.record_id, false, is_root(n.name) FROM near d JOIN record_inputs i ON i.input_id = d.record_id "
    "JOIN record_names n ON n.record_id = i.record_id WHERE NOT d.root) "
    "SELECT coalesce(array_agg(DISTINCT record_id) FILTER (WHERE NOT is_origin), '{}')::text[], "
    "(coalesce(array_agg(DISTINCT record_id) FILTER (WHERE root), '{}') || "
    "CASE WHEN $2 THEN ARRAY[root_of($1)] ELSE '{}' END)::text[] FROM near";
// No row: no entry is as late.
constexpr char kSelectFirstAt[] =
    "SELECT record_sequence FROM record_names WHERE recorded_at >= $1 ORDER BY recorded_at, record_sequence LIMIT 1";

// What a reader from whom the parts $4 are hidden may see, and the kinds $3 of it that are wanted.
#define SIXPOINT_ENTRY_SEEN                                                                                   \
  "(cardinality($4::text[]) = 0 OR CASE WHEN e.blade_serial IS NULL "                                         \
  "THEN coalesce(NOT parts_of_record(e.record_id) && $4::text[], false) ELSE EXISTS (SELECT 1 FROM blades b " \
  "WHERE b.blade_serial = e.blade_serial AND b.part_id <> ALL ($4::text[])) END)"
#define SIXPOINT_WANTED "(cardinality($3::text[]) = 0 OR e.kind = ANY ($3::text[])) AND " SIXPOINT_ENTRY_SEEN
// From $5 (past it) to $6 (before it): of $1, which are few, and of each root of $2 its next in order, of which the first are kept.
#define SIXPOINT_HITS                                                                                               \
  "SELECT e.record_id, e.record_sequence FROM unnest($1::uuid[]) near JOIN record_entries e ON e.record_id = near " \
  "WHERE e.record_sequence > $5 AND e.record_sequence < $6 AND " SIXPOINT_WANTED                                    \
  " UNION SELECT h.record_id, h.record_sequence FROM unnest($2::uuid[]) root CROSS JOIN LATERAL ("                  \
  "SELECT r.record_id, r.record_sequence FROM record_roots r JOIN record_entries e ON e.record_id = r.record_id "   \
  "WHERE r.root_id = root AND r.record_sequence > $5 AND r.record_sequence < $6 AND " SIXPOINT_WANTED               \
  " ORDER BY r.record_sequence LIMIT $7) h"
constexpr char kSelectHits[] = "WITH hits AS (" SIXPOINT_HITS " ORDER BY 2 LIMIT $7) " SIXPOINT_ENTRY_COLUMNS
                               "JOIN hits h ON h.record_id = e.record_id ORDER BY e.record_sequence";
constexpr char kSelectPageOfAll[] =
    "WITH hits AS (SELECT e.record_id, e.record_sequence FROM record_names n JOIN record_entries e "
    "ON e.record_id = n.record_id WHERE $1::uuid[] IS NOT NULL AND $2::uuid[] IS NOT NULL "
    "AND n.record_sequence > $5 AND n.record_sequence < $6 AND " SIXPOINT_WANTED
    " ORDER BY n.record_sequence LIMIT $7) " SIXPOINT_ENTRY_COLUMNS
    "JOIN hits h ON h.record_id = e.record_id ORDER BY e.record_sequence";
// What was made at $8 or later of what was made within the span ($9, $8).
#define SIXPOINT_LATER                                                                                              \
  "later (record_id) AS (SELECT i.record_id FROM within w JOIN record_inputs i ON i.input_id = w.record_id "        \
  "UNION SELECT i.record_id FROM later l JOIN record_inputs i ON i.input_id = l.record_id) " SIXPOINT_ENTRY_COLUMNS \
  "WHERE e.record_id IN (SELECT record_id FROM later) AND e.record_sequence >= $8 AND e.record_sequence > $5 "      \
  "AND e.record_sequence < $6 AND " SIXPOINT_WANTED " ORDER BY e.record_sequence LIMIT $7"
constexpr char kSelectLater[] =
    "WITH RECURSIVE within AS (SELECT near AS record_id FROM unnest($1::uuid[]) near JOIN record_names n "
    "ON n.record_id = near WHERE n.record_sequence > $9 AND n.record_sequence < $8 UNION "
    "SELECT r.record_id FROM record_roots r WHERE r.root_id = ANY ($2::uuid[]) "
    "AND r.record_sequence > $9 AND r.record_sequence < $8), " SIXPOINT_LATER;
constexpr char kSelectLaterOfAll[] =
    "WITH RECURSIVE within AS (SELECT n.record_id FROM record_names n WHERE $1::uuid[] IS NOT NULL "
    "AND $2::uuid[] IS NOT NULL AND n.record_sequence > $9 AND n.record_sequence < $8), " SIXPOINT_LATER;

// $1 the name, $2 a blade's serial or NULL, $3 past which, $4 hidden parts, $5 how many.
constexpr char kSelectMadeFrom[] =
    "WITH RECURSIVE of_blade AS (SELECT record_id FROM record_entries WHERE blade_serial = $2::text), "
    "up (record_id) AS (SELECT i.input_id FROM record_inputs i WHERE i.record_id IN "
    "(SELECT n.record_id FROM record_names n WHERE " SIXPOINT_MEANT
    ") OR i.record_id IN (SELECT record_id FROM of_blade) "
    "UNION SELECT i.input_id FROM up JOIN record_inputs i ON i.record_id = up.record_id) " SIXPOINT_ENTRY_COLUMNS
    "WHERE e.record_id IN (SELECT record_id FROM up UNION SELECT record_id FROM of_blade) AND e.record_sequence > $3 "
    "AND n.name <> $1 AND " SIXPOINT_ENTRY_SEEN " ORDER BY e.record_sequence LIMIT $5";

struct Start {
  std::vector<std::string> near, roots;
};
absl::StatusOr<Start> StartOf(Transaction& transaction, const std::string& name) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectStart, Params().Text(name).Bool(IsUnrecordedRoot(name)));
  if (!rows.ok()) return rows.status();
  return rows->Checked(Start{rows->Texts(0, 0), rows->Texts(0, 1)});
}

constexpr std::int64_t kPastAll = std::numeric_limits<std::int64_t>::max();

// The sequence of the first entry of that moment or later.
absl::StatusOr<std::int64_t> FirstAt(Transaction& transaction, Instant moment) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectFirstAt, Params().Time(moment));
  if (!rows.ok()) return rows.status();
  return rows->Checked(rows->count() == 0 ? kPastAll : rows->Int(0, 0));
}

}  // namespace

absl::StatusOr<std::vector<JournalEntry>> DerivedFrom(Transaction& transaction, const std::string& name,
                                                      const std::vector<std::string>& kinds, const JournalPage& page) {
  const absl::StatusOr<Sight> sight = SightOf(transaction, page.reader);
  if (!sight.ok()) return sight.status();
  const absl::StatusOr<Start> start = StartOf(transaction, name);
  if (!start.ok()) return start.status();
  std::int64_t before_span = 0, past_span = kPastAll;
  if (page.recorded.from) {
    const absl::StatusOr<std::int64_t> first = FirstAt(transaction, *page.recorded.from);
    if (!first.ok()) return first.status();
    before_span = *first - 1;
  }
  if (page.recorded.until) {
    const absl::StatusOr<std::int64_t> past = FirstAt(transaction, *page.recorded.until);
    if (!past.ok()) return past.status();
    past_span = *past;
  }
  const auto params = [&](std::int64_t after, std::int64_t before, std::int64_t limit) {
    Params made;
    made.Texts(start->near).Texts(start->roots).Texts(kinds).Texts(sight->hidden_parts);
    made.Int(after).Int(before).Int(limit);
    return made;
  };
  absl::StatusOr<std::vector<JournalEntry>> entries =
      ReadEntries(transaction, name.empty() ? kSelectPageOfAll : kSelectHits,
                  params(std::max(page.after_sequence, before_span), past_span, page.limit));
  if (!entries.ok() || past_span == kPastAll) return entries;
  const std::int64_t left = page.limit - static_cast<std::int64_t>(entries->size());
  if (left <= 0) return entries;
  absl::StatusOr<std::vector<JournalEntry>> later =
      ReadEntries(transaction, name.empty() ? kSelectLaterOfAll : kSelectLater,
                  params(page.after_sequence, kPastAll, left).Int(past_span).Int(before_span));
  if (!later.ok()) return later.status();
  entries->insert(entries->end(), std::make_move_iterator(later->begin()), std::make_move_iterator(later->end()));
  return entries;
}

absl::StatusOr<std::vector<JournalEntry>> MadeFrom(Transaction& transaction, const std::string& name,
                                                   const JournalPage& page) {
  const absl::StatusOr<Sight> sight = SightOf(transaction, page.reader);
  if (!sight.ok()) return sight.status();
  Params params;
  params.Text(name);
  name.rfind("blades/", 0) == 0 ? params.Text(IdOfName(name).id) : params.Null();
  params.Int(page.after_sequence).Texts(sight->hidden_parts).Int(page.limit);
  return ReadEntries(transaction, kSelectMadeFrom, params);
}

}  // namespace sixpoint::storage
