#include "storage/observed.h"

#include <utility>

namespace sixpoint::storage {
namespace {

constexpr char kHead[] = "SELECT coalesce(max(record_sequence), 0) FROM record_names";
// As `sixpoint doctor` asks (cli/doctor/gather_database.cc): by what there is, for the newest name says nothing of those before it.
// Of the catalogue, where the view partitioned_tables finds them too: that one is the owner's alone.
constexpr char kMonthsAhead[] =
    "WITH each_table AS MATERIALIZED (SELECT c.relname AS name FROM pg_partitioned_table p JOIN pg_class c ON c.oid = "
    "p.partrelid AND c.relnamespace = 'public'::regnamespace) "
    "SELECT (SELECT coalesce(min(m), 13) - 1 FROM generate_series(0, 12) AS m WHERE EXISTS (SELECT FROM each_table t "
    "WHERE to_regclass('public.' || partition_name(t.name, (date_trunc('month', clock_timestamp() AT TIME ZONE 'UTC') "
    "+ make_interval(months => m))::date)) IS NULL)) FROM (SELECT) AS once WHERE EXISTS (SELECT FROM each_table)";
constexpr char kDamages[] = "SELECT count(DISTINCT sha256) FROM blob_damages";
// As the view calibration_forces has it, which asks the journal for all that there ever was, and the journal grows with every blade:
// here it is asked for the sequence of those alone among which that decides. What ended a month ago counts while its machine scans.
constexpr char kAges[] =
    "WITH may AS (SELECT c.machine_id, c.kind, coalesce(c.axis, '') AS axis, c.valid_from, c.valid_until, "
    "CASE WHEN c.is_draft THEN r.record_id ELSE c.calibration_id END AS force_id, "
    "max(c.valid_until) OVER (PARTITION BY c.machine_id, c.kind, c.axis) AS last_end FROM calibrations c "
    "LEFT JOIN calibration_events r ON r.calibration_id = c.calibration_id AND r.event = 'RELEASED' "
    "WHERE c.valid_from <= now() AND (NOT c.is_draft OR r.record_id IS NOT NULL) AND NOT EXISTS (SELECT FROM "
    "calibration_events w WHERE w.calibration_id = c.calibration_id AND w.event = 'WITHDRAWN')), "
    "each AS (SELECT DISTINCT ON (machine_id, kind, axis) machine_id, kind, axis, valid_from, valid_until FROM may "
    "WHERE valid_until > now() OR valid_until = last_end ORDER BY machine_id, kind, axis, valid_until > now() DESC, "
    "(SELECT n.record_sequence FROM record_names n WHERE n.record_id = force_id) DESC) "
    "SELECT machine_id, kind, axis, extract(epoch FROM now() - valid_from)::float8, "
    "extract(epoch FROM valid_until - now())::float8 FROM each WHERE valid_until > now() - interval '30 days' "
    "OR EXISTS (SELECT FROM record_entries e WHERE e.machine_id = each.machine_id AND e.kind = 'scan' "
    "AND e.record_id >= least_uuid_of(each.valid_until)) ORDER BY machine_id, kind, axis LIMIT $1";

absl::StatusOr<std::int64_t> Number(Transaction& transaction, const char* sql) {
  const absl::StatusOr<Rows> rows = transaction.Execute(sql);
  if (!rows.ok()) return rows.status();
  return rows->Checked(rows->Int(0, 0));
}

}  // namespace

absl::StatusOr<std::int64_t> RecordHead(Transaction& transaction) { return Number(transaction, kHead); }
absl::StatusOr<std::int64_t> CountDamages(Transaction& transaction) { return Number(transaction, kDamages); }

absl::StatusOr<std::optional<int>> MonthsAhead(Transaction& transaction) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kMonthsAhead);
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
