// Blades: registered, found, searched.
#include <algorithm>
#include <utility>

#include "storage/clearances.h"
#include "storage/plant_registry.h"
#include "storage/reasons.h"
#include "storage/requests.h"
#include "storage/work_orders.h"

namespace sixpoint::storage {
namespace {

constexpr char kInsertBlade[] = "INSERT INTO blades (blade_serial, part_id, record_id) VALUES ($1, $2, $3)";
#define SIXPOINT_SELECT_BLADES                                                                                  \
  "SELECT blades.blade_serial, part_id, record_sequence, recorded_at, work_order, operation FROM blades "       \
  "JOIN record_names USING (record_id) LEFT JOIN LATERAL (SELECT o.work_order, o.operation FROM "               \
  "blade_work_orders o WHERE o.blade_serial = blades.blade_serial ORDER BY o.revision DESC LIMIT 1) w ON true " \
  "WHERE "
constexpr char kSelectBlade[] = SIXPOINT_SELECT_BLADES "blade_serial = $1";
constexpr char kSelectBlades[] = SIXPOINT_SELECT_BLADES
    "blade_serial > $1 AND ($2 = '' OR part_id = $2) AND ($3::timestamptz IS NULL OR "
    "recorded_at >= $3) AND ($4::timestamptz IS NULL OR recorded_at < $4) AND part_id <> ALL ($5::text[]) "
    "AND ($6::text[] IS NULL OR blade_serial = ANY ($6::text[])) AND ($7 = '' OR (work_order = $7 AND blade_serial IN "
    "(SELECT b.blade_serial FROM blade_work_orders b WHERE b.work_order = $7))) "
    // '~' comes after all that a serial number may have.
    "AND ($8 = '' OR (blades.blade_serial >= $8 AND blades.blade_serial < $8 || '~')) "
    "ORDER BY blades.blade_serial LIMIT $12";
// What takes a look into the journal is asked of so many blades at most: a page costs the same however rare what is wanted is. In each row
// how many were looked at, and the last of them; one row without a blade where there is none.
constexpr int kMostBladesLookedAt = 1000;
const std::string& SelectBlades() {
  static const auto* const sql = new std::string(
      std::string("WITH looked AS MATERIALIZED (") + kSelectBlades +
      "), found AS (SELECT * FROM looked l WHERE ($9 = '' OR EXISTS (SELECT 1 FROM record_entries e "
      "WHERE e.blade_serial = l.blade_serial AND e.machine_id = $9)) "
      "AND ($10 = '' OR $10 = (SELECT record_verdict(e.record_id, e.kind) FROM record_entries e "
      "WHERE e.blade_serial = l.blade_serial AND e.kind = 'inspection' ORDER BY e.record_sequence DESC LIMIT 1)) "
      "AND ($11 = '' OR $11 = (SELECT record_state(e.record_id, e.kind) FROM record_entries e "
      "WHERE e.blade_serial = l.blade_serial AND e.kind = 'correction' ORDER BY e.record_sequence DESC LIMIT 1)) "
      "ORDER BY l.blade_serial LIMIT $13) SELECT f.blade_serial, f.part_id, f.record_sequence, f.recorded_at, "
      "f.work_order, f.operation, s.looked_count, s.upto FROM (SELECT count(*) AS looked_count, max(blade_serial) AS "
      "upto "
      "FROM looked) s LEFT JOIN found f ON true ORDER BY f.blade_serial");
  return *sql;
}
#undef SIXPOINT_SELECT_BLADES

absl::Status HasOtherOrder(const BladeRow& known, const BladeRow& asked) {
  const auto text = [](const BladeRow& blade) {
    if (blade.work_order.empty()) return std::string("none");
    return blade.work_order + (blade.operation.empty() ? "" : " operation " + blade.operation);
  };
  return WithReason(
      absl::AlreadyExistsError("work_order: " + text(asked) + ", want " + text(known) + ", which blade " +
                               known.blade_serial + " already has: another is assigned by AssignWorkOrder"),
      kWorkOrderDiffers);
}

BladeRow ReadBlade(const Rows& rows, int row) {
  return {rows.Text(row, 0),
          rows.Text(row, 1),
          {rows.Int(row, 2), rows.Time(row, 3)},
          rows.OptionalText(row, 4),
          rows.OptionalText(row, 5)};
}

}  // namespace

absl::StatusOr<BladeRow> InsertBlade(Transaction& transaction, BladeRow blade, RecordEntry entry) {
  if (const absl::StatusOr<Rows> locked = transaction.Execute(kLockBlade, Params().Text(blade.blade_serial));
      !locked.ok())
    return locked.status();
  absl::StatusOr<std::optional<BladeRow>> known = FindBlade(transaction, blade.blade_serial);
  if (!known.ok()) return known.status();
  // An order that is not the blade's own is not dropped silently.
  const bool has_other_order = *known && !blade.work_order.empty() &&
                               (blade.work_order != (*known)->work_order ||
                                (!blade.operation.empty() && blade.operation != (*known)->operation));
  if (*known && (*known)->part_id == blade.part_id && !has_other_order) {
    // Nothing new: the request gives what was there.
    if (absl::Status kept = KeepRequest(transaction, entry.request, "blades/" + blade.blade_serial); !kept.ok())
      return kept;
    return **std::move(known);
  }
  if (*known) {
    const auto hidden = FirstHidden(transaction, entry.reader, {"blades/" + blade.blade_serial}, Unrecorded::kIsSeen);
    if (!hidden.ok()) return hidden.status();
    if (hidden->has_value()) return NotSeen("serial", blade.blade_serial, entry.reader);
    if ((*known)->part_id == blade.part_id) return HasOtherOrder(**known, blade);
    return WithReason(
        absl::AlreadyExistsError("blade.part: parts/" + blade.part_id + ", want parts/" + (*known)->part_id +
                                 ", which blade " + blade.blade_serial + " already is"),
        kOfAnotherPart);
  }
  entry.kind = "blade";
  entry.name = "blades/" + blade.blade_serial;
  entry.blade = blade.blade_serial;
  const std::string record_id = NewUuid();
  const absl::StatusOr<Rows> inserted =
      transaction.Execute(kInsertBlade, Params().Text(blade.blade_serial).Text(blade.part_id).Uuid(record_id));
  if (!inserted.ok()) return inserted.status();
  if (!blade.work_order.empty())
    if (const absl::Status assigned = InsertWorkOrder(transaction, blade, entry, record_id); !assigned.ok())
      return assigned;
  const absl::StatusOr<Recorded> recorded = AppendRecord(transaction, record_id, entry);
  if (!recorded.ok()) return recorded.status();
  blade.recorded = *recorded;
  return blade;
}

absl::StatusOr<std::optional<BladeRow>> FindBlade(Transaction& transaction, const std::string& serial) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectBlade, Params().Text(serial));
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return std::nullopt;
  return rows->Checked(ReadBlade(*rows, 0));
}

absl::StatusOr<BladePage> ListBlades(Transaction& transaction, const BladeFilter& filter, const std::string& after,
                                     int limit) {
  Params params;
  params.Text(after).Text(filter.part_id);
  AddSpan(filter.recorded, &params);
  const absl::StatusOr<Sight> sight = SightOf(transaction, filter.reader);
  if (!sight.ok()) return sight.status();
  AddSight(*sight, &params);
  params.Text(filter.work_order).Text(filter.serial_prefix).Text(filter.machine_id).Text(filter.verdict);
  const bool looks = !filter.machine_id.empty() || !filter.verdict.empty() || !filter.state.empty();
  const int most_looked_at = looks ? std::max(kMostBladesLookedAt, limit) : limit;
  const absl::StatusOr<Rows> rows =
      transaction.Execute(SelectBlades(), params.Text(filter.state).Int(most_looked_at).Int(limit));
  if (!rows.ok()) return rows.status();
  BladePage page;
  for (int row = 0; row < rows->count() && !rows->IsNull(row, 0); ++row) page.blades.push_back(ReadBlade(*rows, row));
  if (rows->Int(0, 6) == most_looked_at) page.looked_upto = rows->Text(0, 7);
  return rows->Checked(std::move(page));
}

}  // namespace sixpoint::storage
