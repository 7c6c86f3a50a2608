#include "storage/record.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "storage/clearances.h"

namespace sixpoint::storage {
namespace {

// Takes the journal's lock (migrations/V0001).
constexpr char kAppend[] =
    "SELECT new_sequence, new_recorded_at, edge_count FROM append_record($1, $2, $3, $4, $5, $6, $7, $8, $9, "
    "$10::jsonb, $11::text[], $12, $13::uuid, $14::bytea, $15)";

#define SIXPOINT_ENTRY_COLUMNS                                                                                        \
  "SELECT e.record_sequence, e.recorded_at, e.kind, n.name, e.blade_serial, e.machine_id, e.method, "                 \
  "e.software_version, name_of(e.requested_by), e.measured_at, e.summary::text, "                                     \
  "ARRAY(SELECT m.name FROM record_inputs i JOIN record_names m ON m.record_id = i.input_id "                         \
  "WHERE i.record_id = e.record_id ORDER BY i.position_index), e.trace_id FROM record_entries e JOIN record_names n " \
  "ON n.record_id = e.record_id "
constexpr char kSelectEntry[] = SIXPOINT_ENTRY_COLUMNS "WHERE n.name = $1";
constexpr char kSelectBlade[] =
    SIXPOINT_ENTRY_COLUMNS "WHERE e.blade_serial = $1 AND e.record_sequence > $2 ORDER BY e.record_sequence LIMIT $3";
// The thing itself or, for a name without @revision, any of its revisions ('A' follows '@').
#define SIXPOINT_MEANT "(n.name = $1 OR (n.name >= $1 || '@' AND n.name < $1 || 'A'))"
constexpr char kSelectRecorded[] = "SELECT 1 FROM record_names n WHERE " SIXPOINT_MEANT " LIMIT 1";
// What was made from it, then what was made from that: each step is found by the index of the inputs.
constexpr char kSelectDerived[] =
    "WITH RECURSIVE derived (record_id) AS ("
    "SELECT i.record_id FROM record_inputs i JOIN record_names n ON n.record_id = i.input_id WHERE " SIXPOINT_MEANT
    " UNION SELECT i.record_id FROM derived d JOIN record_inputs i ON i.input_id = d.record_id) " SIXPOINT_ENTRY_COLUMNS
    "JOIN derived d ON d.record_id = e.record_id "
    "WHERE (cardinality($2::text[]) = 0 OR e.kind = ANY ($2::text[])) AND e.record_sequence > $3 "
    "AND (cardinality($4::text[]) = 0 OR CASE WHEN e.blade_serial IS NULL "
    "THEN coalesce(NOT parts_of_record(e.record_id) && $4::text[], false) ELSE EXISTS (SELECT 1 FROM blades b "
    "WHERE b.blade_serial = e.blade_serial AND b.part_id <> ALL ($4::text[])) END) "
    "ORDER BY e.record_sequence LIMIT $5";
#undef SIXPOINT_ENTRY_COLUMNS
#undef SIXPOINT_MEANT

void AddOptional(Params& params, const std::optional<std::string>& value) {
  value ? params.Text(*value) : params.Null();
}

std::optional<std::string> OptionalText(const Rows& rows, int row, int column) {
  if (rows.IsNull(row, column)) return std::nullopt;
  return rows.Text(row, column);
}

std::optional<std::string> TraceOf(const RecordEntry& entry) {
  if (entry.trace_id || !entry.request || entry.request->trace_id.empty()) return entry.trace_id;
  return entry.request->trace_id;
}

absl::StatusOr<std::vector<JournalEntry>> ReadEntries(Transaction& transaction, const char* sql, const Params& params) {
  const absl::StatusOr<Rows> rows = transaction.Execute(sql, params);
  if (!rows.ok()) return rows.status();
  std::vector<JournalEntry> entries;
  for (int row = 0; row < rows->count(); ++row) {
    JournalEntry& read = entries.emplace_back();
    read.recorded = {rows->Int(row, 0), rows->Time(row, 1)};
    read.entry.kind = rows->Text(row, 2);
    read.entry.name = rows->Text(row, 3);
    read.entry.blade = OptionalText(*rows, row, 4);
    read.entry.machine = OptionalText(*rows, row, 5);
    read.entry.method = rows->Text(row, 6);
    read.entry.software_version = rows->Text(row, 7);
    read.entry.requested_by = rows->Text(row, 8);
    if (!rows->IsNull(row, 9)) read.entry.measured_at = rows->Time(row, 9);
    read.entry.summary_json = rows->Text(row, 10);
    read.entry.inputs = rows->Texts(row, 11);
    read.entry.trace_id = OptionalText(*rows, row, 12);
  }
  return rows->Checked(std::move(entries));
}

}  // namespace

absl::StatusOr<Recorded> AppendRecord(Transaction& transaction, const std::string& record_id,
                                      const RecordEntry& entry) {
  std::vector<std::string> inputs;  // each once, in the order given
  for (const std::string& input : entry.inputs)
    if (std::find(inputs.begin(), inputs.end(), input) == inputs.end()) inputs.push_back(input);
  Params params;
  params.Uuid(record_id).Text(entry.name).Text(entry.kind);
  AddOptional(params, entry.blade);
  AddOptional(params, entry.machine);
  params.Text(entry.method).Text(entry.software_version).Text(entry.requested_by);
  entry.measured_at ? params.Time(*entry.measured_at) : params.Null();
  params.Json(entry.summary_json).Texts(inputs);
  if (entry.request && !entry.request->request_id.empty())
    params.Text(entry.request->call).Text(entry.request->request_id).Digest(entry.request->sha256);
  else
    params.Null().Null().Null();
  AddOptional(params, TraceOf(entry));
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

NamedId IdOfName(const std::string& name) {
  const std::string id = name.substr(name.find('/') + 1);
  const std::size_t at = id.find('@');
  if (at == std::string::npos) return {id, 0};
  return {id.substr(0, at), std::atoi(id.c_str() + at + 1)};
}

absl::StatusOr<std::optional<JournalEntry>> FindEntry(Transaction& transaction, const std::string& name) {
  absl::StatusOr<std::vector<JournalEntry>> found = ReadEntries(transaction, kSelectEntry, Params().Text(name));
  if (!found.ok()) return found.status();
  if (found->empty()) return std::nullopt;
  return std::move(found->front());
}

absl::StatusOr<bool> IsRecorded(Transaction& transaction, const std::string& name) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectRecorded, Params().Text(name));
  if (!rows.ok()) return rows.status();
  return rows->count() > 0;
}

absl::StatusOr<std::vector<JournalEntry>> RecordOfBlade(Transaction& transaction, const std::string& serial,
                                                        const JournalPage& page) {
  return ReadEntries(transaction, kSelectBlade, Params().Text(serial).Int(page.after_sequence).Int(page.limit));
}

absl::StatusOr<std::vector<JournalEntry>> DerivedFrom(Transaction& transaction, const std::string& name,
                                                      const std::vector<std::string>& kinds, const JournalPage& page) {
  const absl::StatusOr<Sight> sight = SightOf(transaction, page.reader);
  if (!sight.ok()) return sight.status();
  Params params;
  params.Text(name).Texts(kinds).Int(page.after_sequence).Texts(sight->hidden_parts).Int(page.limit);
  return ReadEntries(transaction, kSelectDerived, params);
}

}  // namespace sixpoint::storage
