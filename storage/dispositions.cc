#include "storage/dispositions.h"

#include <utility>

#include "storage/each_row.h"
#include "storage/requests.h"

namespace sixpoint::storage {
namespace {

constexpr char kInsertDisposition[] =
    "INSERT INTO dispositions (disposition_id, inspection_id, blade_serial, disposition, reason, reference, "
    "requested_by, software_version) VALUES ($1, $2, $3, $4, $5, $6, $7, $8)";
#define SIXPOINT_SELECT                                                                                     \
  "SELECT d.disposition_id, d.inspection_id, d.blade_serial, d.disposition, d.reason, d.reference, "        \
  "name_of(d.requested_by), d.software_version, n.record_sequence, n.recorded_at FROM dispositions d JOIN " \
  "record_names n ON n.record_id = d.disposition_id WHERE "
constexpr char kSelectDisposition[] = SIXPOINT_SELECT "d.disposition_id = $1";
constexpr char kSelectOf[] =
    SIXPOINT_SELECT "d.inspection_id = ANY ($1::uuid[]) ORDER BY d.inspection_id, n.record_sequence DESC";
#undef SIXPOINT_SELECT

absl::StatusOr<std::vector<DispositionRow>> ReadDispositions(Transaction& transaction, const char* sql,
                                                             const Params& params) {
  const absl::StatusOr<Rows> rows = transaction.Execute(sql, params);
  if (!rows.ok()) return rows.status();
  std::vector<DispositionRow> dispositions;
  for (int row = 0; row < rows->count(); ++row) {
    DispositionRow& read = dispositions.emplace_back();
    read.disposition_id = rows->Text(row, 0);
    read.inspection_id = rows->Text(row, 1);
    read.blade_serial = rows->Text(row, 2);
    read.disposition = rows->Text(row, 3);
    read.reason = rows->Text(row, 4);
    read.reference = rows->OptionalText(row, 5);
    read.requested_by = rows->Text(row, 6);
    read.software_version = rows->Text(row, 7);
    read.recorded = {rows->Int(row, 8), rows->Time(row, 9)};
  }
  return rows->Checked(std::move(dispositions));
}

absl::StatusOr<std::optional<DispositionRow>> Find(Transaction& transaction, const std::string& name) {
  return FirstOf(ReadDispositions(transaction, kSelectDisposition, Params().Uuid(IdOfName(name).id)));
}

class PostgresDispositions final : public ResultWriter<DispositionRow> {
 public:
  explicit PostgresDispositions(Database* database) : database_(database) {}

  absl::StatusOr<std::optional<DispositionRow>> FindRecorded(const RecordedRequest& request,
                                                             Deadline deadline) const override {
    return storage::FindRecorded<DispositionRow>(*database_, request, deadline, Find);
  }
  absl::StatusOr<DispositionRow> Record(const RecordedRequest& request, DispositionRow row, const RecordEntry& entry,
                                        Deadline deadline) override {
    RecordEntry kept = entry;
    kept.request = KeptRequestOf(request);
    const auto insert = [&](Transaction& t) { return InsertDisposition(t, row, kept); };
    return RecordOnce<DispositionRow>(*database_, request, deadline, Find, insert);
  }

 private:
  Database* const database_;
};

}  // namespace

std::shared_ptr<ResultWriter<DispositionRow>> DispositionsIn(Database* database) {
  return std::make_shared<PostgresDispositions>(database);
}

absl::StatusOr<DispositionRow> InsertDisposition(Transaction& transaction, DispositionRow row,
                                                 const RecordEntry& entry) {
  Params params;
  params.Uuid(row.disposition_id).Uuid(row.inspection_id).Text(row.blade_serial).Text(row.disposition);
  params.Text(row.reason).OptionalText(row.reference).Text(row.requested_by).Text(row.software_version);
  if (const auto inserted = transaction.Execute(kInsertDisposition, params); !inserted.ok()) return inserted.status();
  const absl::StatusOr<Recorded> recorded = AppendRecord(transaction, row.disposition_id, entry);
  if (!recorded.ok()) return recorded.status();
  row.recorded = *recorded;
  return row;
}

absl::StatusOr<std::vector<DispositionRow>> DispositionsOf(Transaction& transaction,
                                                           const std::vector<std::string>& inspection_ids) {
  if (inspection_ids.empty()) return std::vector<DispositionRow>();
  return ReadDispositions(transaction, kSelectOf, Params().Uuids(inspection_ids));
}

}  // namespace sixpoint::storage
