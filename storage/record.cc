#include "storage/record.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "storage/clearances.h"
#include "storage/each_row.h"
#include "storage/entries.h"

namespace sixpoint::storage {
namespace {

// Takes the journal's lock (migrations/V0001).
constexpr char kAppend[] =
    "SELECT new_sequence, new_recorded_at, edge_count FROM append_record($1, $2, $3, $4, $5, $6, $7, $8, $9, "
    "$10::jsonb, $11::text[], $12, $13::uuid, $14::bytea, $15, $16, $17)";

constexpr char kSelectEntry[] = SIXPOINT_ENTRY_COLUMNS "WHERE n.name = $1";
// $1 to $5 of both statements that follow, as PageParams has them.
#define SIXPOINT_JOURNAL_PAGE                                                                                 \
  "e.record_sequence > $1 AND (cardinality($3::text[]) = 0 OR e.kind = ANY ($3::text[])) "                    \
  "AND ($4::timestamptz IS NULL OR e.recorded_at >= $4) AND ($5::timestamptz IS NULL OR e.recorded_at < $5) " \
  "AND "
#define SIXPOINT_PAGE_ORDER " ORDER BY e.record_sequence LIMIT $2"
constexpr char kSelectEntriesOfBlade[] =
    SIXPOINT_ENTRY_COLUMNS "WHERE " SIXPOINT_JOURNAL_PAGE "e.blade_serial = $6" SIXPOINT_PAGE_ORDER;
constexpr char kSelectOrder[] = SIXPOINT_ENTRY_COLUMNS
    "WHERE " SIXPOINT_JOURNAL_PAGE
    "e.work_order = $6 AND ($7 = '' OR e.operation = $7) "
    "AND (cardinality($8::text[]) = 0 OR NOT coalesce(parts_of_record(e.record_id) && $8::text[], "
    "true))" SIXPOINT_PAGE_ORDER;
constexpr char kSelectRecorded[] = "SELECT 1 FROM record_names n WHERE " SIXPOINT_MEANT " LIMIT 1";
// A sensor that a machine has and no scan was made with is known too.
constexpr char kSelectKnownRoot[] =
    "SELECT 1 WHERE EXISTS (SELECT 1 FROM record_roots WHERE root_id = root_of($1)) OR EXISTS "
    "(SELECT 1 FROM machine_revisions WHERE $1 IN ('sensors/' || sensor_serial_number, 'probes/' || "
    "touch_probe_serial_number))";

std::optional<std::string> TraceOf(const RecordEntry& entry) {
  if (entry.trace_id || !entry.request || entry.request->trace_id.empty()) return entry.trace_id;
  return entry.request->trace_id;
}

Params PageParams(const JournalPage& page, const std::vector<std::string>& kinds) {
  Params params;
  params.Int(page.after_sequence).Int(page.limit).Texts(kinds);
  AddSpan(page.recorded, &params);
  return params;
}

std::optional<std::string> OptionalText(const Rows& rows, int row, int column) {
  if (rows.IsNull(row, column)) return std::nullopt;
  return rows.Text(row, column);
}

}  // namespace

std::vector<JournalEntry> EntriesOf(const Rows& rows) {
  std::vector<JournalEntry> entries;
  for (int row = 0; row < rows.count(); ++row) {
    JournalEntry& read = entries.emplace_back();
    read.recorded = {rows.Int(row, 0), rows.Time(row, 1)};
    read.entry.kind = rows.Text(row, 2);
    read.entry.name = rows.Text(row, 3);
    read.entry.blade = OptionalText(rows, row, 4);
    read.entry.machine = OptionalText(rows, row, 5);
    read.entry.method = rows.Text(row, 6);
    read.entry.software_version = rows.Text(row, 7);
    read.entry.requested_by = rows.Text(row, 8);
    if (!rows.IsNull(row, 9)) read.entry.measured_at = rows.Time(row, 9);
    read.entry.summary_json = rows.Text(row, 10);
    read.entry.inputs = rows.Texts(row, 11);
    read.entry.trace_id = OptionalText(rows, row, 12);
    read.verdict = OptionalText(rows, row, 13).value_or("");
    read.state = OptionalText(rows, row, 14).value_or("");
    read.entry.work_order = rows.OptionalText(row, 15);
    read.entry.operation = rows.OptionalText(row, 16);
  }
  return entries;
}

absl::StatusOr<std::vector<JournalEntry>> ReadEntries(Transaction& transaction, const char* sql, const Params& params) {
  const absl::StatusOr<Rows> rows = transaction.Execute(sql, params);
  if (!rows.ok()) return rows.status();
  return rows->Checked(EntriesOf(*rows));
}

absl::StatusOr<Recorded> AppendRecord(Transaction& transaction, const std::string& record_id,
                                      const RecordEntry& entry) {
  std::vector<std::string> inputs;  // each once, in the order given
  for (const std::string& input : entry.inputs)
    if (std::find(inputs.begin(), inputs.end(), input) == inputs.end()) inputs.push_back(input);
  Params params;
  params.Uuid(record_id).Text(entry.name).Text(entry.kind);
  params.TextOrNull(entry.blade);
  params.TextOrNull(entry.machine);
  params.Text(entry.method).Text(entry.software_version).Text(entry.requested_by);
  params.OptionalTime(entry.measured_at);
  params.Json(entry.summary_json).Texts(inputs);
  if (entry.request && !entry.request->request_id.empty())
    params.Text(entry.request->call).Text(entry.request->request_id).Digest(entry.request->sha256);
  else
    params.Null().Null().Null();
  params.TextOrNull(TraceOf(entry));
  params.OptionalText(entry.work_order).OptionalText(entry.operation);
  const absl::StatusOr<Rows> rows = transaction.Execute(kAppend, params);
  if (!rows.ok()) return rows.status();
  const Recorded recorded{rows->Int(0, 0), rows->Time(0, 1)};
  const auto edge_count = static_cast<std::size_t>(rows->Int(0, 2));
  if (absl::Status read = rows->status(); !read.ok()) return read;
  if (edge_count != inputs.size())
    return absl::FailedPreconditionError("record of " + entry.name + ": " + std::to_string(inputs.size()) +
                                         " inputs, of which " + std::to_string(edge_count) +
                                         " are recorded, want all of them");
  return recorded;
}

bool IsUnrecordedRoot(const std::string& name) {
  return name.rfind("sensors/", 0) == 0 || name.rfind("probes/", 0) == 0 || name.rfind("software/", 0) == 0;
}

NamedId IdOfName(const std::string& name) {
  const std::string id = name.substr(name.find('/') + 1);
  const std::size_t at = id.find('@');
  if (at == std::string::npos) return {id, 0};
  return {id.substr(0, at), std::atoi(id.c_str() + at + 1)};
}

absl::StatusOr<std::optional<JournalEntry>> FindEntry(Transaction& transaction, const std::string& name) {
  return FirstOf(ReadEntries(transaction, kSelectEntry, Params().Text(name)));
}

absl::StatusOr<bool> IsRecorded(Transaction& transaction, const std::string& name) {
  const absl::StatusOr<Rows> rows =
      transaction.Execute(IsUnrecordedRoot(name) ? kSelectKnownRoot : kSelectRecorded, Params().Text(name));
  if (!rows.ok()) return rows.status();
  return rows->count() > 0;
}

absl::StatusOr<std::vector<JournalEntry>> EntriesOfOrder(Transaction& transaction, const std::string& work_order,
                                                         const std::string& operation,
                                                         const std::vector<std::string>& kinds,
                                                         const JournalPage& page) {
  const absl::StatusOr<Sight> sight = SightOf(transaction, page.reader);
  if (!sight.ok()) return sight.status();
  return ReadEntries(transaction, kSelectOrder,
                     PageParams(page, kinds).Text(work_order).Text(operation).Texts(sight->hidden_parts));
}

absl::StatusOr<std::vector<JournalEntry>> RecordOfBlade(Transaction& transaction, const std::string& serial,
                                                        const std::vector<std::string>& kinds,
                                                        const JournalPage& page) {
  return ReadEntries(transaction, kSelectEntriesOfBlade, PageParams(page, kinds).Text(serial));
}

}  // namespace sixpoint::storage
