#include "storage/events.h"

#include <algorithm>
#include <utility>

#include "storage/clearances.h"
#include "storage/entries.h"
#include "storage/one_read.h"

namespace sixpoint::storage {
namespace {

// Of the next $9 entries those that are to be told, with ReadEntries' columns before three more; in each row how many entries were
// looked at, and the last of them: whoever sees that sees those before it, for numbers are drawn and committed in one order (V0001). One
// row without an event where there is none.
constexpr char kSelectEvents[] =
    "SELECT b.record_sequence, b.recorded_at, b.kind, b.name, b.blade_serial, b.machine_id, b.method, "
    "b.software_version, b.requested_by, b.measured_at, b.summary, b.inputs, b.trace_id, b.verdict, b.state, "
    "b.work_order, b.operation, "
    "b.valid_until, b.parts, b.is_restricted, l.looked_count, l.upto FROM (SELECT count(*) AS looked_count, "
    "coalesce(max(w.record_sequence), $1) AS upto FROM (SELECT record_sequence FROM record_names "
    "WHERE record_sequence > $1 ORDER BY record_sequence LIMIT $9) w) l "
    "LEFT JOIN LATERAL events_between($1, l.upto, $2, $3::text[], $4::text[], $5, $6, $7, $8::text[]) b ON true "
    "ORDER BY b.record_sequence";
constexpr int kMostEventsLookedAt = 2000;
constexpr int kLookedCount = 20, kLookedUpTo = 21;

constexpr char kSelectNow[] =
    "SELECT coalesce((SELECT record_sequence FROM record_names ORDER BY record_sequence DESC LIMIT 1), 0), "
    "record_kinds(), (SELECT plant_id::text FROM plant_identity)";

constexpr int kEntryColumnCount = 17;

bool Holds(const std::vector<std::string>& texts, const std::string& text) {
  return std::find(texts.begin(), texts.end(), text) != texts.end();
}

class PostgresEvents final : public EventReader {
 public:
  explicit PostgresEvents(std::unique_ptr<Database> database) : database_(std::move(database)) {}
  absl::StatusOr<EventPage> Events(const EventQuery& query, Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) { return ReadEvents(t, query); });
  }
  absl::StatusOr<JournalNow> Now(Deadline deadline) const override {
    return OneRead(*database_, deadline, [](Transaction& t) { return ReadJournalNow(t); });
  }
  absl::StatusOr<std::vector<std::string>> HiddenParts(const Reader& reader, Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) -> absl::StatusOr<std::vector<std::string>> {
      absl::StatusOr<Sight> sight = SightOf(t, reader);
      if (!sight.ok()) return sight.status();
      return std::move(sight->hidden_parts);
    });
  }

 private:
  const std::unique_ptr<Database> database_;
};

}  // namespace

absl::StatusOr<EventPage> ReadEvents(Transaction& transaction, const EventQuery& query) {
  const absl::StatusOr<Sight> sight = SightOf(transaction, query.reader);
  if (!sight.ok()) return sight.status();
  const EventFilter& filter = query.filter;
  Params params;
  params.Int(query.after_sequence).Int(query.limit).Texts(sight->hidden_parts).Texts(filter.kinds);
  params.Text(filter.machine_id).Text(filter.blade_serial).Text(filter.part_id).Texts(filter.verdicts);
  params.Int(kMostEventsLookedAt);
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectEvents, params);
  if (!rows.ok()) return rows.status();
  EventPage page{{}, rows->Int(0, kLookedUpTo), rows->Int(0, kLookedCount) < kMostEventsLookedAt};
  if (rows->IsNull(0, 0)) return rows->Checked(std::move(page));
  std::vector<JournalEntry> entries = EntriesOf(*rows);
  for (int row = 0; row < rows->count(); ++row) {
    EventRow& read = page.rows.emplace_back();
    read.entry = std::move(entries[static_cast<std::size_t>(row)]);
    if (!rows->IsNull(row, kEntryColumnCount)) read.valid_until = rows->Time(row, kEntryColumnCount);
    if (!rows->IsNull(row, kEntryColumnCount + 1)) read.parts = rows->Texts(row, kEntryColumnCount + 1);
    read.is_restricted = rows->Bool(row, kEntryColumnCount + 2);
  }
  if (static_cast<int>(page.rows.size()) == query.limit) {
    const std::int64_t last = page.rows.back().entry.recorded.sequence;
    page.is_newest = page.is_newest && page.looked_at_sequence == last;
    page.looked_at_sequence = last;
  }
  return rows->Checked(std::move(page));
}

bool LetsThrough(const EventFilter& filter, const EventRow& row) {
  const RecordEntry& entry = row.entry.entry;
  return (filter.kinds.empty() || Holds(filter.kinds, entry.kind)) &&
         (filter.machine_id.empty() || entry.machine == filter.machine_id) &&
         (filter.blade_serial.empty() || entry.blade == filter.blade_serial) &&
         (filter.part_id.empty() || (row.parts && Holds(*row.parts, filter.part_id))) &&
         (filter.verdicts.empty() || Holds(filter.verdicts, row.entry.verdict));
}

bool IsSeen(const EventRow& row, const std::vector<std::string>& hidden_parts) {
  if (hidden_parts.empty()) return true;
  if (!row.parts) return false;
  return std::none_of(row.parts->begin(), row.parts->end(),
                      [&](const std::string& part) { return Holds(hidden_parts, part); });
}

absl::StatusOr<JournalNow> ReadJournalNow(Transaction& transaction) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectNow);
  if (!rows.ok()) return rows.status();
  return rows->Checked(JournalNow{rows->Int(0, 0), rows->Texts(0, 1), rows->Text(0, 2)});
}

std::shared_ptr<const EventReader> EventsIn(std::unique_ptr<Database> database) {
  return std::make_shared<PostgresEvents>(std::move(database));
}

}  // namespace sixpoint::storage
