#include "storage/observed.h"

#include <utility>

namespace sixpoint::storage {
namespace {

constexpr char kHead[] = "SELECT coalesce(max(record_sequence), 0) FROM record_names";
// A partition is called after its month: record_entries_2026_11.
constexpr char kMonths[] =
    "SELECT left(newest, 4)::integer * 12 + right(newest, 2)::integer - (extract(year FROM utc) * 12 + "
    "extract(month FROM utc))::integer FROM (SELECT min(newest) AS newest, now() AT TIME ZONE 'UTC' AS utc FROM "
    "(SELECT max(right(c.relname, 7)) AS newest FROM pg_inherits i JOIN pg_class c ON c.oid = i.inhrelid "
    "JOIN pg_partitioned_table p ON p.partrelid = i.inhparent GROUP BY i.inhparent) AS of_each) AS least";
constexpr char kDamages[] = "SELECT count(*) FROM blob_damages";
constexpr char kAges[] =
    "SELECT DISTINCT ON (machine_id, kind, axis) machine_id, kind, axis, extract(epoch FROM now() - "
    "valid_from)::float8, "
    "extract(epoch FROM valid_until - now())::float8 FROM calibration_forces WHERE valid_from <= now() "
    "ORDER BY machine_id, kind, axis, (valid_until IS NULL OR valid_until > now()) DESC, force_sequence DESC LIMIT $1";

absl::StatusOr<std::int64_t> Number(Transaction& transaction, const char* sql) {
  const absl::StatusOr<Rows> rows = transaction.Execute(sql);
  if (!rows.ok()) return rows.status();
  return rows->Checked(rows->Int(0, 0));
}

}  // namespace

absl::StatusOr<std::int64_t> RecordHead(Transaction& transaction) { return Number(transaction, kHead); }
absl::StatusOr<std::int64_t> CountDamages(Transaction& transaction) { return Number(transaction, kDamages); }

absl::StatusOr<std::optional<int>> MonthsAhead(Transaction& transaction) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kMonths);
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0 || rows->IsNull(0, 0)) return std::nullopt;
  return rows->Checked(std::optional<int>(static_cast<int>(rows->Int(0, 0))));
}

absl::StatusOr<std::vector<CalibrationAge>> CalibrationAges(Transaction& transaction, int limit) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kAges, Params().Int(limit));
  if (!rows.ok()) return rows.status();
  std::vector<CalibrationAge> ages;
  for (int row = 0; row < rows->count(); ++row) {
    CalibrationAge age{rows->Text(row, 0), rows->Text(row, 1), rows->Text(row, 2), rows->Real(row, 3), std::nullopt};
    if (!rows->IsNull(row, 4)) age.left_s = rows->Real(row, 4);
    ages.push_back(std::move(age));
  }
  return rows->Checked(std::move(ages));
}

}  // namespace sixpoint::storage
