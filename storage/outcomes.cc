#include "storage/outcomes.h"

#include <algorithm>
#include <set>

#include "storage/clearances.h"
#include "storage/each_row.h"
#include "storage/one_read.h"
#include "storage/three.h"

namespace sixpoint::storage {
namespace {

// A blade is corrected a few times; beyond so many for each the list is cut off.
constexpr int kCorrectionsABlade = 5;

#define SIXPOINT_WITHDRAWN(id)                                                                                  \
  "EXISTS (SELECT 1 FROM record_roots x JOIN calibration_events e ON e.calibration_id = x.root_id AND e.event " \
  "= 'WITHDRAWN' WHERE x.record_id = " id ")"
// The machine's newest corrections by the journal's index, then their blades, then of each its newest inspection.
constexpr char kSelectOutcomeBlades[] =
    "WITH made AS MATERIALIZED (SELECT c.blade_serial, r.record_sequence FROM recorded r JOIN corrections c ON "
    "c.correction_id = r.record_id WHERE r.entry_kind = 'correction' AND r.entry_machine = $1 AND ($2 = '' OR "
    "c.part_id = $2) AND ($3::uuid IS NULL OR $3::uuid IN (c.sensor_calibration_id, c.rotation_calibration_id)) "
    "AND ($4::timestamptz IS NULL OR r.recorded_at >= $4) AND ($5::timestamptz IS NULL OR r.recorded_at < $5) "
    "AND c.part_id <> ALL ($6::text[]) AND ($7::text[] IS NULL OR r.entry_blade = ANY ($7::text[])) "
    "ORDER BY r.record_sequence DESC LIMIT $8), "
    "blades_of AS MATERIALIZED (SELECT blade_serial, max(record_sequence) AS newest FROM made GROUP BY blade_serial "
    "ORDER BY newest DESC LIMIT $9) "
    "SELECT b.blade_serial, n.inspection_id, (SELECT count(*) FROM recorded a WHERE a.entry_blade = b.blade_serial "
    "AND a.entry_kind = 'inspection'), " SIXPOINT_WITHDRAWN("n.inspection_id") ", coalesce(n.is_open, false), "
    "(SELECT count(*) FROM made) "
    "FROM blades_of b LEFT JOIN LATERAL (SELECT i.inspection_id, i.positioning_disagrees AND NOT "
    "i.positioning_covered AS is_open FROM recorded r JOIN inspections i ON i.inspection_id = r.record_id WHERE "
    "r.entry_blade = b.blade_serial AND r.entry_kind = 'inspection' ORDER BY r.record_sequence DESC LIMIT 1) n ON true "
    "ORDER BY b.newest DESC";
constexpr char kSelectOutcomeHoles[] =
    "WITH seen AS MATERIALIZED (SELECT i.inspection_id, i.blade_serial, i.budget_sources, (SELECT "
    "min(n.record_sequence) FROM inspection_scans s JOIN record_names n ON n.record_id = s.scan_key WHERE "
    "s.inspection_id = i.inspection_id) AS first_scan FROM inspections i WHERE i.inspection_id = ANY ($1::uuid[])), "
    "made AS MATERIALIZED (SELECT s.inspection_id, s.blade_serial, s.budget_sources, c.correction_id, "
    "c.registration_id, c.machine_id, c.machine_revision, c.part_id, c.part_revision, c.sensor_calibration_id, "
    "c.rotation_calibration_id, n.record_sequence, n.recorded_at, " SIXPOINT_WITHDRAWN("c.correction_id")
    " AS is_withdrawn, c.release = 'AUTOMATIC' OR EXISTS (SELECT 1 FROM correction_events e WHERE e.correction_id = "
    "c.correction_id AND e.event = 'RELEASED') AS was_let_go, EXISTS (SELECT 1 FROM correction_events e WHERE "
    "e.correction_id = c.correction_id AND e.event = 'REFUSED') AS was_refused "
    "FROM seen s JOIN corrections c ON c.blade_serial = s.blade_serial JOIN record_names n ON n.record_id = "
    "c.correction_id WHERE n.record_sequence < s.first_scan), "
    "cut AS MATERIALIZED (SELECT DISTINCT ON (m.inspection_id, h.group_name, h.hole_name) m.*, h.group_name, "
    "h.hole_name, coalesce(g.a_reached_deg, g.a_deg) AS a, coalesce(g.b_reached_deg, g.b_deg) AS b, k.correction_id "
    "IS NOT NULL AS is_reported FROM made m JOIN correction_groups g ON g.correction_id = m.correction_id JOIN "
    "correction_holes h ON h.correction_id = m.correction_id AND h.group_name = g.group_name LEFT JOIN "
    "correction_cuts k ON k.correction_id = m.correction_id AND k.group_name = h.group_name AND k.hole_name = "
    "h.hole_name WHERE k.correction_id IS NOT NULL OR (m.was_let_go AND NOT m.was_refused) "
    "ORDER BY m.inspection_id, h.group_name, h.hole_name, is_reported DESC, m.record_sequence DESC) "
    "SELECT c.blade_serial, c.inspection_id, c.correction_id, c.group_name, c.hole_name, c.sensor_calibration_id, "
    "c.rotation_calibration_id, c.machine_revision, c.recorded_at, c.is_reported, c.is_withdrawn, c.a, c.b, "
    "r.zero_from_part, p.start_in_part_mm, q.axis_in_part, o.start_in_part_mm, o.axis_in_part, "
    "o.position_expanded_uncertainty_um, o.inclination_expanded_uncertainty_deg, coalesce(c.budget_sources, '{}'), "
    "coalesce(o.budget_um, '{}')::double precision[] "
    "FROM cut c JOIN inspection_holes o ON o.inspection_id = c.inspection_id AND o.group_name = c.group_name AND "
    "o.hole_name = c.hole_name AND o.start_in_part_mm IS NOT NULL JOIN registrations r ON r.registration_id = "
    "c.registration_id AND cardinality(r.zero_from_part) = 12 JOIN part_hole_groups q ON q.part_id = c.part_id AND "
    "q.revision = c.part_revision AND q.hole_group = c.group_name JOIN part_holes p ON p.part_id = q.part_id AND "
    "p.revision = q.revision AND p.group_index = q.group_index AND p.hole = c.hole_name "
    "WHERE c.machine_id = $2 AND ($3 = '' OR c.part_id = $3) AND ($4::uuid IS NULL OR $4::uuid IN "
    "(c.sensor_calibration_id, c.rotation_calibration_id)) AND ($5::timestamptz IS NULL OR c.recorded_at >= $5) AND "
    "($6::timestamptz IS NULL OR c.recorded_at < $6) "
    "ORDER BY c.inspection_id DESC, o.position_index LIMIT $7";
constexpr char kSelectOutcomeCalibrations[] =
    "SELECT u.id, calibration_state(u.id, statement_timestamp()), coalesce(r.a_direction, '{}'), "
    "coalesce(r.a_point_mm, '{}'), coalesce(r.b_direction, '{}'), coalesce(r.b_point_mm, '{}') FROM "
    "unnest($1::uuid[]) AS u (id) LEFT JOIN rotation_calibrations r ON r.calibration_id = u.id";
constexpr char kIsRevised[] = "SELECT count(*) FROM record_names WHERE name = $1";
#undef SIXPOINT_WITHDRAWN

absl::StatusOr<std::vector<OutcomeBladeRow>> ReadBlades(Transaction& t, const OutcomeFilter& filter, int most_blades,
                                                        bool* is_cut_off) {
  const absl::StatusOr<Sight> sight = SightOf(t, filter.reader);
  if (!sight.ok()) return sight.status();
  const int most_corrections = kCorrectionsABlade * most_blades;
  Params params;
  params.Text(filter.machine_id).Text(filter.part_id).OptionalUuid(filter.calibration_id);
  AddSpan(filter.corrected, &params);
  AddSight(*sight, &params);
  const absl::StatusOr<Rows> rows = t.Execute(kSelectOutcomeBlades, params.Int(most_corrections).Int(most_blades + 1));
  if (!rows.ok()) return rows.status();
  std::vector<OutcomeBladeRow> blades;
  for (int row = 0; row < rows->count(); ++row) {
    *is_cut_off |= row == most_blades || rows->Int(row, 5) == most_corrections;
    if (row == most_blades) break;
    blades.push_back({rows->Text(row, 0), rows->OptionalText(row, 1), static_cast<int>(rows->Int(row, 2)),
                      rows->Bool(row, 3), rows->Bool(row, 4)});
  }
  return rows->Checked(std::move(blades));
}

OutcomeHoleRow ReadOutcomeHole(const Rows& rows, int row) {
  OutcomeHoleRow hole;
  hole.blade_serial = rows.Text(row, 0);
  hole.inspection_id = rows.Text(row, 1);
  hole.correction_id = rows.Text(row, 2);
  hole.group_name = rows.Text(row, 3);
  hole.hole_name = rows.Text(row, 4);
  hole.sensor_calibration_id = rows.Text(row, 5);
  hole.rotation_calibration_id = rows.Text(row, 6);
  hole.machine_revision = static_cast<int>(rows.Int(row, 7));
  hole.corrected_at = rows.Time(row, 8);
  hole.is_cut_reported = rows.Bool(row, 9);
  hole.is_withdrawn = rows.Bool(row, 10);
  hole.a_deg = rows.Real(row, 11);
  hole.b_deg = rows.Real(row, 12);
  hole.zero_from_part = rows.Reals(row, 13);
  hole.predicted_start_mm = ThreeOf(rows.Reals(row, 14));
  hole.predicted_axis = ThreeOf(rows.Reals(row, 15));
  hole.found_start_mm = ThreeOf(rows.Reals(row, 16));
  hole.found_axis = ThreeOf(rows.Reals(row, 17));
  hole.position_expanded_uncertainty_um = rows.Real(row, 18);
  hole.inclination_expanded_uncertainty_deg = rows.Real(row, 19);
  hole.budget_sources = rows.Texts(row, 20);
  hole.budget_um = rows.Reals(row, 21);
  return hole;
}

absl::Status ReadHoles(Transaction& t, const OutcomeFilter& filter, Outcomes* outcomes) {
  std::vector<std::string> inspections;
  for (const OutcomeBladeRow& blade : outcomes->blades)
    if (!blade.inspection_id.empty()) inspections.push_back(blade.inspection_id);
  if (inspections.empty()) return absl::OkStatus();
  Params params;
  params.Uuids(inspections).Text(filter.machine_id).Text(filter.part_id).OptionalUuid(filter.calibration_id);
  AddSpan(filter.corrected, &params);
  const absl::StatusOr<Rows> rows = t.Execute(kSelectOutcomeHoles, params.Int(kMostOutcomeHoles + 1));
  if (!rows.ok()) return rows.status();
  for (int row = 0; row < rows->count(); ++row) outcomes->holes.push_back(ReadOutcomeHole(*rows, row));
  if (rows->count() > kMostOutcomeHoles) {
    outcomes->is_cut_off = true;
    // Whole blades alone.
    const std::string last = outcomes->holes.back().inspection_id;
    while (!outcomes->holes.empty() && outcomes->holes.back().inspection_id == last) outcomes->holes.pop_back();
  }
  return rows->status();
}

absl::Status ReadCalibrations(Transaction& t, const std::string& machine_id, Outcomes* outcomes) {
  std::set<std::string> ids;
  for (const OutcomeHoleRow& hole : outcomes->holes) {
    ids.insert(hole.sensor_calibration_id);
    ids.insert(hole.rotation_calibration_id);
    outcomes->newest_machine_revision = std::max(outcomes->newest_machine_revision, hole.machine_revision);
  }
  if (ids.empty()) return absl::OkStatus();
  const absl::Status read =
      EachRow(t, kSelectOutcomeCalibrations, Params().Uuids({ids.begin(), ids.end()}), [&](const Rows& rows, int row) {
        outcomes->calibrations.push_back({rows.Text(row, 0), rows.OptionalText(row, 1), rows.Reals(row, 2),
                                          rows.Reals(row, 3), rows.Reals(row, 4), rows.Reals(row, 5)});
      });
  if (!read.ok()) return read;
  const std::string next = "machines/" + machine_id + "@" + std::to_string(outcomes->newest_machine_revision + 1);
  const absl::StatusOr<Rows> revised = t.Execute(kIsRevised, Params().Text(next));
  if (!revised.ok()) return revised.status();
  outcomes->newest_machine_revision += revised->Int(0, 0) > 0 ? 1 : 0;
  return revised->status();
}

class PostgresOutcomes final : public OutcomeReader {
 public:
  explicit PostgresOutcomes(Database* database) : database_(database) {}

  absl::StatusOr<Outcomes> Read(const OutcomeFilter& filter, int most_blades, Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) -> absl::StatusOr<Outcomes> {
      Outcomes outcomes;
      auto blades = ReadBlades(t, filter, most_blades, &outcomes.is_cut_off);
      if (!blades.ok()) return blades.status();
      outcomes.blades = *std::move(blades);
      if (absl::Status read = ReadHoles(t, filter, &outcomes); !read.ok()) return read;
      if (absl::Status read = ReadCalibrations(t, filter.machine_id, &outcomes); !read.ok()) return read;
      return outcomes;
    });
  }

 private:
  Database* const database_;
};

}  // namespace

std::shared_ptr<OutcomeReader> OutcomesIn(Database* database) { return std::make_shared<PostgresOutcomes>(database); }

}  // namespace sixpoint::storage
