#include "storage/fleet.h"

#include "storage/clearances.h"
#include "storage/each_row.h"
#include "storage/one_read.h"

namespace sixpoint::storage {
namespace {

// Asked of each only where something is hidden from the reader; what cannot be told of which part it is is hidden, too.
#define SIXPOINT_SEEN(id) "(cardinality($2::text[]) = 0 OR NOT coalesce(parts_of_record(" id ") && $2::text[], true))"

constexpr char kSelectMachines[] =
    "SELECT machine_id FROM machines WHERE ($1 = '' OR machine_id = $1) AND machine_id > $2 ORDER BY machine_id LIMIT "
    "$3";
constexpr char kSelectFleetActivity[] =
    "SELECT machine_id, measure, bucket, sum(entry_count)::bigint, sum(seconds) FROM machine_activity "
    "WHERE period = $1 AND machine_id = ANY ($2::text[]) AND begins_at >= $3 AND begins_at < $4 "
    "GROUP BY machine_id, measure, bucket";
constexpr char kSelectContacts[] =
    "SELECT c.machine_id, c.kind, CASE WHEN " SIXPOINT_SEEN("c.record_id") " THEN n.name END, c.recorded_at, c.detail, "
    "c.run_count, c.run_since FROM machine_contacts c JOIN record_names n ON n.record_id = c.record_id WHERE c.machine_id = ANY ($1::text[]) "
    "ORDER BY c.machine_id, c.record_sequence DESC";
constexpr char kSelectMachineCalibrations[] =
    "SELECT machine_id, calibration_id, kind, axis, recorded_at, valid_from, valid_until, is_in_force, earlier_id, "
    "parameter, change, ratio, flagged_parameters, standing_check_id, standing_check_at FROM machine_calibrations "
    "WHERE machine_id = ANY ($1::text[]) ORDER BY machine_id, kind, axis";
constexpr char kSelectWork[] =
    "SELECT machine_id, blade_count, awaiting_count, awaiting_since, CASE WHEN " SIXPOINT_SEEN(
        "first_awaiting_id") " THEN first_awaiting_id END FROM machine_work "
    "WHERE machine_id = ANY ($1::text[])";
constexpr char kSelectMachineDamages[] =
    "SELECT machine_id, blob_count, found_at FROM machine_damages WHERE machine_id = ANY ($1::text[])";
constexpr char kSelectUploads[] =
    "SELECT scan_id, header, next_block, point_count, stored_bytes, started_at, touched_at FROM scan_uploads "
    "ORDER BY touched_at DESC LIMIT $1";
constexpr char kSelectActivity[] =
    "SELECT begins_at, measure, bucket, entry_count, seconds FROM machine_activity WHERE period = $1 AND machine_id = "
    "$2 "
    "AND begins_at >= $3 AND begins_at < $4 ORDER BY begins_at, measure, bucket";

const char* TextOf(SummaryPeriod period) { return period == SummaryPeriod::kHour ? "hour" : "day"; }

ContactRow ReadContact(const Rows& rows, int row) {
  return {rows.Text(row, 0),         rows.Text(row, 1), rows.OptionalText(row, 2), rows.Time(row, 3),
          rows.OptionalText(row, 4), rows.Int(row, 5),  rows.Time(row, 6)};
}

MachineCalibrationRow ReadCalibration(const Rows& rows, int row) {
  MachineCalibrationRow read;
  read.machine_id = rows.Text(row, 0);
  read.calibration_id = rows.Text(row, 1);
  read.kind = rows.Text(row, 2);
  read.axis = rows.Text(row, 3);
  read.recorded_at = rows.Time(row, 4);
  read.valid_from = rows.Time(row, 5);
  read.valid_until = rows.Time(row, 6);
  read.in_force = rows.Bool(row, 7);
  if (!rows.IsNull(row, 8))
    read.drift =
        DriftRow{rows.Text(row, 8), rows.Text(row, 9), rows.Real(row, 10), rows.Real(row, 11), rows.Texts(row, 12)};
  if (!rows.IsNull(row, 13)) {
    read.standing_check_id = rows.Text(row, 13);
    read.standing_check_at = rows.Time(row, 14);
  }
  return read;
}

MachineWorkRow ReadWork(const Rows& rows, int row) {
  MachineWorkRow read;
  read.machine_id = rows.Text(row, 0);
  read.blade_count = rows.Int(row, 1);
  read.awaiting_count = rows.Int(row, 2);
  if (read.awaiting_count == 0) return read;
  read.awaiting_since = rows.Time(row, 3);
  read.first_awaiting_id = rows.OptionalText(row, 4);
  return read;
}

class PostgresFleet final : public FleetReader {
 public:
  explicit PostgresFleet(Database* database) : database_(database) {}

  absl::StatusOr<FleetRows> Fleet(const FleetFilter& filter, Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) { return Read(t, filter); });
  }
  absl::StatusOr<std::optional<std::vector<ActivityRow>>> Activity(const std::string& machine_id,
                                                                   const SummarySpan& span,
                                                                   Deadline deadline) const override {
    return OneRead(
        *database_, deadline, [&](Transaction& t) -> absl::StatusOr<std::optional<std::vector<ActivityRow>>> {
          std::vector<ActivityRow> activity;
          absl::Status read = EachRow(
              t, kSelectActivity, Params().Text(TextOf(span.period)).Text(machine_id).Time(span.from).Time(span.until),
              [&](const Rows& rows, int row) {
                activity.push_back({machine_id, rows.Time(row, 0), rows.Text(row, 1),
                                    static_cast<int>(rows.Int(row, 2)), rows.Int(row, 3), rows.Real(row, 4)});
              });
          bool is_known = !activity.empty();
          if (read.ok() && !is_known)
            read = EachRow(t, kSelectMachines, Params().Text(machine_id).Text("").Int(1),
                           [&](const Rows&, int) { is_known = true; });
          if (!read.ok()) return read;
          if (!is_known) return std::nullopt;
          return activity;
        });
  }

 private:
  static absl::StatusOr<FleetRows> Read(Transaction& t, const FleetFilter& filter) {
    const absl::StatusOr<Instant> now = NowOf(t);
    if (!now.ok()) return now.status();
    const absl::StatusOr<Sight> sight = SightOf(t, filter.reader);
    if (!sight.ok()) return sight.status();
    FleetRows fleet;
    fleet.now = *now;
    absl::Status read =
        EachRow(t, kSelectMachines, Params().Text(filter.machine_id).Text(filter.after).Int(filter.limit),
                [&](const Rows& rows, int row) { fleet.machine_ids.push_back(rows.Text(row, 0)); });
    const Params machines = Params().Texts(fleet.machine_ids);
    const Params seen = Params().Texts(fleet.machine_ids).Texts(sight->hidden_parts);
    const SummarySpan& span = filter.span;
    if (read.ok())
      read =
          EachRow(t, kSelectFleetActivity,
                  Params().Text(TextOf(span.period)).Texts(fleet.machine_ids).Time(span.from).Time(span.until),
                  [&](const Rows& rows, int row) {
                    fleet.activity.push_back({rows.Text(row, 0), span.from, rows.Text(row, 1),
                                              static_cast<int>(rows.Int(row, 2)), rows.Int(row, 3), rows.Real(row, 4)});
                  });
    if (read.ok())
      read = EachRow(t, kSelectContacts, seen,
                     [&](const Rows& rows, int row) { fleet.contacts.push_back(ReadContact(rows, row)); });
    if (read.ok())
      read = EachRow(t, kSelectMachineCalibrations, machines,
                     [&](const Rows& rows, int row) { fleet.calibrations.push_back(ReadCalibration(rows, row)); });
    if (read.ok())
      read =
          EachRow(t, kSelectWork, seen, [&](const Rows& rows, int row) { fleet.work.push_back(ReadWork(rows, row)); });
    if (read.ok())
      read = EachRow(t, kSelectMachineDamages, machines, [&](const Rows& rows, int row) {
        fleet.damages.push_back({rows.Text(row, 0), rows.Int(row, 1), rows.Time(row, 2)});
      });
    if (read.ok())
      read = EachRow(t, kSelectUploads, Params().Int(kMostUploads), [&](const Rows& rows, int row) {
        fleet.uploads.push_back({rows.Text(row, 0), rows.Bytes(row, 1), static_cast<int>(rows.Int(row, 2)),
                                 rows.Int(row, 3), rows.Int(row, 4), rows.Time(row, 5), rows.Time(row, 6)});
      });
    if (!read.ok()) return read;
    return fleet;
  }
  Database* const database_;
};

}  // namespace

std::shared_ptr<const FleetReader> FleetIn(Database* database) { return std::make_shared<PostgresFleet>(database); }

}  // namespace sixpoint::storage
