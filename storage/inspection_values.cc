#include "storage/inspection_values.h"

#include "storage/clearances.h"
#include "storage/each_row.h"
#include "storage/one_read.h"
#include "storage/result_filter.h"

namespace sixpoint::storage {
namespace {

// $1 to $12 of both statements. A prefix is a span of the serial numbers' order, which is that of bytes.
#define SIXPOINT_VALUE_FILTER                                                                                       \
  "entry_kind = 'inspection' AND ($1::bigint = 0 OR record_sequence < $1::bigint) "                                 \
  "AND ($2 = '' OR entry_blade = $2) AND ($3 = '' OR (entry_blade >= $3 AND starts_with(entry_blade, $3))) "        \
  "AND ($4 = '' OR part_id = $4) AND ($5 = '' OR entry_machine = $5) "                                              \
  "AND ($6::timestamptz IS NULL OR recorded_at >= $6) AND ($7::timestamptz IS NULL OR recorded_at < $7) "           \
  "AND ($8 = '' OR i.verdict = $8) AND (NOT $9::boolean OR NOT EXISTS (SELECT 1 FROM record_entries later WHERE "   \
  "later.blade_serial = entry_blade AND later.kind = 'inspection' AND later.record_sequence > r.record_sequence)) " \
  "AND part_id <> ALL ($10::text[]) AND ($11::text[] IS NULL OR entry_blade = ANY ($11::text[])) "                  \
  "AND " SIXPOINT_RESTS_ON("$12", "i")
#define SIXPOINT_INSPECTION_VALUES                                                                         \
  "record_sequence, recorded_at, i.inspection_id, i.blade_serial, machine_id, machine_revision, part_id, " \
  "part_revision, method"
#define SIXPOINT_HOLE_VALUES                                                                      \
  ", h.group_name, h.hole_name, h.position_verdict, h.inclination_verdict, h.position_error_mm, " \
  "h.inclination_error_deg, h.position_expanded_uncertainty_um, "                                 \
  "h.inclination_expanded_uncertainty_deg, h.position_tolerance_mm, h.inclination_tolerance_deg "
// The page's inspections are found first, by the journal's order; their holes are then read by key.
constexpr char kSelectInspectionValues[] =
    "WITH page AS MATERIALIZED (SELECT " SIXPOINT_INSPECTION_VALUES
    " FROM recorded r JOIN inspections i ON i.inspection_id = r.record_id WHERE " SIXPOINT_VALUE_FILTER
    "ORDER BY record_sequence DESC LIMIT $13) SELECT p.*" SIXPOINT_HOLE_VALUES
    "FROM page p JOIN inspection_holes h ON h.inspection_id = p.inspection_id "
    "ORDER BY p.record_sequence DESC, h.position_index";
// Of one hole an inspection has one row or none: found and read at once.
constexpr char kSelectOfHole[] =
    "SELECT " SIXPOINT_INSPECTION_VALUES SIXPOINT_HOLE_VALUES
    "FROM recorded r JOIN inspections i ON i.inspection_id = r.record_id "
    "JOIN inspection_holes h ON h.inspection_id = i.inspection_id AND h.group_name = $14 AND h.hole_name = $15 "
    "WHERE " SIXPOINT_VALUE_FILTER "ORDER BY record_sequence DESC LIMIT $13";

HoleValuesRow ReadValues(const Rows& rows, int row) {
  HoleValuesRow read;
  int column = 0;
  read.sequence = rows.Int(row, column++);
  read.recorded_at = rows.Time(row, column++);
  read.inspection_id = rows.Text(row, column++);
  read.blade_serial = rows.Text(row, column++);
  read.machine_id = rows.Text(row, column++);
  read.machine_revision = static_cast<int>(rows.Int(row, column++));
  read.part_id = rows.Text(row, column++);
  read.part_revision = static_cast<int>(rows.Int(row, column++));
  read.method = rows.Text(row, column++);
  read.group_name = rows.Text(row, column++);
  read.hole_name = rows.Text(row, column++);
  read.position_verdict = rows.Text(row, column++);
  read.inclination_verdict = rows.Text(row, column++);
  read.position_error_mm = rows.OptionalReal(row, column++);
  read.inclination_error_deg = rows.OptionalReal(row, column++);
  read.position_expanded_uncertainty_um = rows.OptionalReal(row, column++);
  read.inclination_expanded_uncertainty_deg = rows.OptionalReal(row, column++);
  read.position_tolerance_mm = rows.Real(row, column++);
  read.inclination_tolerance_deg = rows.Real(row, column++);
  return read;
}

class PostgresValues final : public ValueReader {
 public:
  explicit PostgresValues(Database* database) : database_(database) {}

  absl::StatusOr<std::vector<HoleValuesRow>> Values(const ValueFilter& filter, std::int64_t before_sequence,
                                                    int inspection_limit, Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) -> absl::StatusOr<std::vector<HoleValuesRow>> {
      const absl::StatusOr<Sight> sight = SightOf(t, filter.reader);
      if (!sight.ok()) return sight.status();
      Params params;
      params.Int(before_sequence).Text(filter.blade_serial).Text(filter.serial_prefix).Text(filter.part_id);
      params.Text(filter.machine_id);
      AddSpan(filter.recorded, &params);
      params.Text(filter.verdict).Bool(filter.only_newest);
      AddSight(*sight, &params);
      params.OptionalUuid(filter.calibration_id).Int(inspection_limit);
      if (!filter.group_name.empty()) params.Text(filter.group_name).Text(filter.hole_name);
      return AllRows(t, filter.group_name.empty() ? kSelectInspectionValues : kSelectOfHole, params, ReadValues);
    });
  }

 private:
  Database* const database_;
};

}  // namespace

std::shared_ptr<ValueReader> ValuesIn(Database* database) { return std::make_shared<PostgresValues>(database); }

}  // namespace sixpoint::storage
