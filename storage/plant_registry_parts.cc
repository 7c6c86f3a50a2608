// Parts and the surfaces that their CAD became.
#include <array>
#include <utility>

#include "storage/clearances.h"
#include "storage/each_row.h"
#include "storage/optional_reals.h"
#include "storage/plant_registry.h"
#include "storage/requests.h"
#include "storage/shape_region_columns.h"

namespace sixpoint::storage {
namespace {

constexpr char kInsertTessellation[] =
    "INSERT INTO tessellations (cad_sha256, method, surface_sha256, triangle_count, chordal_error_um, closed, "
    "minimum_mm, maximum_mm, software_version, degenerate_triangle_count, open_rim_count, open_rim_length_mm, "
    "healed_um, gap_um, gap_at_mm) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15) ON "
    "CONFLICT DO NOTHING";
constexpr char kSelectTessellation[] =
    "SELECT surface_sha256, triangle_count, chordal_error_um, closed, minimum_mm, maximum_mm, "
    "degenerate_triangle_count, open_rim_count, open_rim_length_mm, healed_um, gap_um, gap_at_mm FROM tessellations "
    "WHERE cad_sha256 = $1 AND method "
    "= $2";

constexpr char kInsertPartId[] = "INSERT INTO parts (part_id) VALUES ($1) ON CONFLICT DO NOTHING";
constexpr char kLockPartId[] = "SELECT pg_advisory_xact_lock(hashtextextended('parts/' || $1, 0))";
constexpr char kInsertPartRevision[] =
    "INSERT INTO part_revisions (part_id, revision, content_sha256, cad_format, cad_unit_mm, cad_sha256, "
    "tessellation_method, zero_from_part_nominal_rotation, zero_from_part_nominal_translation_mm, record_id, "
    "customer_id, thermal_expansion_um_per_m_k, thermal_expansion_standard_uncertainty_um_per_m_k, solid) "
    "VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14)";
constexpr char kInsertPartGroup[] =
    "INSERT INTO part_hole_groups (part_id, revision, group_index, hole_group, diameter_mm, depth_mm, a_nominal_deg, "
    "b_nominal_deg, axis_in_part, position_tolerance_mm, inclination_tolerance_deg, position_zone, "
    "gauge_pin_diameter_mm, gauge_pin_diameter_standard_uncertainty_um, gauge_pin_greatest_play_mm, "
    "gauge_pin_least_depth_mm, pin_clearance_standard_uncertainty_um, pin_tilt_standard_uncertainty_deg, "
    "gauge_pin_certificate_number, gauge_pin_calibrated_at, gauge_pin_expires_at) "
    "VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17, $18, $19, $20, $21)";
constexpr char kInsertPartHoles[] =
    "INSERT INTO part_holes (part_id, revision, group_index, hole_index, hole, start_in_part_mm, normal_in_part) "
    "SELECT $1::text, $2::integer, $3::integer, (position - 1)::integer, hole, ARRAY[x, y, z], ARRAY[nx, ny, nz] "
    "FROM unnest($4::text[], $5::double precision[], $6::double precision[], $7::double precision[], "
    "$8::double precision[], $9::double precision[], $10::double precision[]) WITH ORDINALITY "
    "AS hole (hole, x, y, z, nx, ny, nz, position)";
constexpr char kInsertPartDatum[] =
    "INSERT INTO part_datum_points (part_id, revision, datum_index, datum, point_in_part_mm, normal_in_part) "
    "VALUES ($1, $2, $3, $4, $5, $6)";
constexpr char kInsertStation[] =
    "INSERT INTO part_stations (part_id, revision, station_index, station, zero_from_part_nominal_rotation, "
    "zero_from_part_nominal_translation_mm, capture_mm) VALUES ($1, $2, $3, $4, $5, $6, $7)";
constexpr char kInsertShapeRegion[] =
    "INSERT INTO part_shape_regions (part_id, revision, region_index, region, minimum_in_part_mm, maximum_in_part_mm, "
    "facing_in_part, facing_within_deg, kind, allowance_mm, lower_mm, upper_mm) VALUES ($1, $2, $3, $4, $5, $6, $7, "
    "$8, $9, $10, $11, $12)";
constexpr char kSelectPartRevision[] =
    "SELECT revision, content_sha256, cad_format, cad_unit_mm, cad_sha256, tessellation_method, "
    "zero_from_part_nominal_rotation, zero_from_part_nominal_translation_mm, record_sequence, recorded_at, "
    "(SELECT r.customer_id FROM restricted_parts r WHERE r.part_id = $1), thermal_expansion_um_per_m_k, "
    "thermal_expansion_standard_uncertainty_um_per_m_k, solid FROM part_revisions JOIN record_names USING "
    "(record_id) WHERE part_id = $1 AND ($2::integer = 0 OR revision = $2) "
    "ORDER BY revision DESC LIMIT 1";
constexpr char kSelectPartGroups[] =
    "SELECT hole_group, diameter_mm, depth_mm, a_nominal_deg, b_nominal_deg, axis_in_part, position_tolerance_mm, "
    "inclination_tolerance_deg, position_zone, gauge_pin_diameter_mm, gauge_pin_diameter_standard_uncertainty_um, "
    "gauge_pin_greatest_play_mm, gauge_pin_least_depth_mm, pin_clearance_standard_uncertainty_um, "
    "pin_tilt_standard_uncertainty_deg, gauge_pin_certificate_number, gauge_pin_calibrated_at, gauge_pin_expires_at "
    "FROM part_hole_groups WHERE part_id = $1 AND revision = $2 "
    "ORDER BY group_index";
constexpr char kSelectPartHoles[] =
    "SELECT group_index, hole, start_in_part_mm, normal_in_part FROM part_holes WHERE part_id = $1 AND revision = $2 "
    "ORDER BY group_index, hole_index";
constexpr char kSelectPartDatums[] =
    "SELECT datum, point_in_part_mm, normal_in_part FROM part_datum_points WHERE part_id = $1 AND revision = $2 "
    "ORDER BY datum_index";
constexpr char kSelectStations[] =
    "SELECT station, zero_from_part_nominal_rotation, zero_from_part_nominal_translation_mm, capture_mm "
    "FROM part_stations WHERE part_id = $1 AND revision = $2 ORDER BY station_index";
constexpr char kSelectShapeRegions[] =
    "SELECT region, minimum_in_part_mm, maximum_in_part_mm, facing_in_part, facing_within_deg, kind, allowance_mm, "
    "lower_mm, upper_mm FROM part_shape_regions WHERE part_id = $1 AND revision = $2 ORDER BY region_index";

absl::Status InsertHoles(Transaction& transaction, const PartRow& part) {
  int group_index = 0;
  for (const HoleGroupRow& group : part.hole_groups) {
    Params row;
    row.Text(part.part_id).Int(part.revision).Int(group_index).Text(group.group).Real(group.diameter_mm);
    row.Real(group.depth_mm).Real(group.a_nominal_deg).Real(group.b_nominal_deg).Reals(group.axis_in_part);
    row.Real(group.position_tolerance_mm).Real(group.inclination_tolerance_deg).Text(group.position_zone);
    if (const auto& pin = group.gauge_pin) {
      row.Real(pin->diameter_mm).Real(pin->diameter_standard_uncertainty_um).Real(pin->greatest_play_mm);
      row.OptionalReal(pin->least_depth_mm);
    } else {
      row.Null().Null().Null().Null();
    }
    if (const auto& standing = group.pin_standing)
      row.Real(standing->clearance_standard_uncertainty_um).Real(standing->tilt_standard_uncertainty_deg);
    else
      row.Null().Null();
    Add(group.gauge_pin ? group.gauge_pin->certificate : std::nullopt, &row);
    if (const absl::StatusOr<Rows> inserted = transaction.Execute(kInsertPartGroup, row); !inserted.ok())
      return inserted.status();
    std::vector<std::string> names;
    std::array<std::vector<double>, 6> values;  // start and normal
    for (const HoleRow& hole : group.holes) {
      names.push_back(hole.hole);
      for (std::size_t k = 0; k < 3; ++k) {
        values[k].push_back(hole.start_in_part_mm.at(k));
        values[3 + k].push_back(hole.normal_in_part.at(k));
      }
    }
    Params holes;
    holes.Text(part.part_id).Int(part.revision).Int(group_index++).Texts(names);
    for (const std::vector<double>& column : values) holes.Reals(column);
    if (const absl::StatusOr<Rows> inserted = transaction.Execute(kInsertPartHoles, holes); !inserted.ok())
      return inserted.status();
  }
  return absl::OkStatus();
}

absl::Status InsertDatums(Transaction& transaction, const PartRow& part) {
  int index = 0;
  for (const DatumPointRow& datum : part.datum_points) {
    Params row;
    row.Text(part.part_id).Int(part.revision).Int(index++).Text(datum.datum);
    row.Reals(datum.point_in_part_mm).Reals(datum.normal_in_part);
    if (const absl::StatusOr<Rows> inserted = transaction.Execute(kInsertPartDatum, row); !inserted.ok())
      return inserted.status();
  }
  return absl::OkStatus();
}

absl::Status InsertStations(Transaction& transaction, const PartRow& part) {
  int index = 0;
  for (const StationRow& station : part.stations) {
    Params row;
    row.Text(part.part_id).Int(part.revision).Int(index++).Text(station.station);
    row.Reals(station.zero_from_part_nominal_rotation).Reals(station.zero_from_part_nominal_translation_mm);
    row.Real(station.capture_mm);
    if (const absl::StatusOr<Rows> inserted = transaction.Execute(kInsertStation, row); !inserted.ok())
      return inserted.status();
  }
  return absl::OkStatus();
}

absl::Status InsertShapeRegions(Transaction& transaction, const PartRow& part) {
  int index = 0;
  for (const ShapeRegionRow& region : part.shape_regions) {
    Params row;
    row.Text(part.part_id).Int(part.revision).Int(index++);
    AddShapeRegion(region, &row);
    if (const absl::StatusOr<Rows> inserted = transaction.Execute(kInsertShapeRegion, row); !inserted.ok())
      return inserted.status();
  }
  return absl::OkStatus();
}

HoleGroupRow ReadGroup(const Rows& rows, int row) {
  HoleGroupRow group;
  group.group = rows.Text(row, 0);
  group.diameter_mm = rows.Real(row, 1);
  group.depth_mm = rows.Real(row, 2);
  group.a_nominal_deg = rows.Real(row, 3);
  group.b_nominal_deg = rows.Real(row, 4);
  group.axis_in_part = rows.Reals(row, 5);
  group.position_tolerance_mm = rows.Real(row, 6);
  group.inclination_tolerance_deg = rows.Real(row, 7);
  group.position_zone = rows.Text(row, 8);
  if (!rows.IsNull(row, 13)) group.pin_standing = {rows.Real(row, 13), rows.Real(row, 14)};
  if (rows.IsNull(row, 9)) return group;
  group.gauge_pin = {rows.Real(row, 9), rows.Real(row, 10), rows.Real(row, 11)};
  group.gauge_pin->least_depth_mm = rows.OptionalReal(row, 12);
  group.gauge_pin->certificate = CertificateAt(rows, row, 15);
  return group;
}

absl::Status ReadHoles(Transaction& transaction, const Params& key, std::vector<HoleGroupRow>* groups) {
  absl::Status known;
  const absl::Status read = EachRow(transaction, kSelectPartHoles, key, [&](const Rows& rows, int row) {
    const auto group = static_cast<std::size_t>(rows.Int(row, 0));
    if (group < groups->size())
      (*groups)[group].holes.push_back({rows.Text(row, 1), rows.Reals(row, 2), rows.Reals(row, 3)});
    else
      known = absl::DataLossError("a stored hole of group " + std::to_string(group) + ", want one that there is");
  });
  return read.ok() ? known : read;
}

absl::Status ReadChildren(Transaction& transaction, PartRow* part) {
  const Params key = Params().Text(part->part_id).Int(part->revision);
  absl::Status read = EachRow(transaction, kSelectPartGroups, key,
                              [&](const Rows& rows, int row) { part->hole_groups.push_back(ReadGroup(rows, row)); });
  if (read.ok()) read = ReadHoles(transaction, key, &part->hole_groups);
  if (read.ok())
    read = EachRow(transaction, kSelectPartDatums, key, [&](const Rows& rows, int row) {
      part->datum_points.push_back({rows.Text(row, 0), rows.Reals(row, 1), rows.Reals(row, 2)});
    });
  if (read.ok())
    read = EachRow(transaction, kSelectStations, key, [&](const Rows& rows, int row) {
      part->stations.push_back({rows.Text(row, 0), rows.Reals(row, 1), rows.Reals(row, 2), rows.Real(row, 3)});
    });
  if (read.ok())
    read = EachRow(transaction, kSelectShapeRegions, key,
                   [&](const Rows& rows, int row) { part->shape_regions.push_back(ShapeRegionAt(rows, row, 0)); });
  return read;
}

}  // namespace

absl::Status InsertTessellation(Transaction& transaction, const TessellationRow& tessellation,
                                const std::string& software_version) {
  Params params;
  params.Digest(tessellation.cad_sha256).Text(tessellation.method).Digest(tessellation.surface_sha256);
  params.Int(tessellation.triangle_count).Real(tessellation.chordal_error_um).Bool(tessellation.closed);
  params.Reals(tessellation.minimum_mm).Reals(tessellation.maximum_mm).Text(software_version);
  if (tessellation.gaps)
    params.Int(tessellation.gaps->degenerate_triangle_count)
        .Int(tessellation.gaps->open_rim_count)
        .Real(tessellation.gaps->open_rim_length_mm);
  else
    params.Null().Null().Null();
  if (const auto& gaps = tessellation.edge_gaps) {
    params.Real(gaps->healed_um).Real(gaps->gap_um);
    if (gaps->gap_at_mm.empty())
      params.Null();
    else
      params.Reals(gaps->gap_at_mm);
  } else {
    params.Null().Null().Null();
  }
  return transaction.Execute(kInsertTessellation, params).status();
}

absl::StatusOr<std::optional<TessellationRow>> FindTessellation(Transaction& transaction, const std::string& cad_sha256,
                                                                const std::string& method) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectTessellation, Params().Digest(cad_sha256).Text(method));
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return std::nullopt;
  TessellationRow row{cad_sha256,       method,           rows->Digest(0, 0), rows->Int(0, 1),
                      rows->Real(0, 2), rows->Bool(0, 3), rows->Reals(0, 4),  rows->Reals(0, 5)};
  if (!rows->IsNull(0, 6)) row.gaps = {rows->Int(0, 6), rows->Int(0, 7), rows->Real(0, 8)};
  if (!rows->IsNull(0, 9)) {
    row.edge_gaps = {rows->Real(0, 9), rows->Real(0, 10)};
    if (!rows->IsNull(0, 11)) row.edge_gaps->gap_at_mm = rows->Reals(0, 11);
  }
  return rows->Checked(std::move(row));
}

absl::StatusOr<PartRow> InsertPart(Transaction& transaction, PartRow part, RecordEntry entry) {
  const std::string& id = part.part_id;
  for (const char* sql : {kLockPartId, kInsertPartId}) {
    if (const absl::StatusOr<Rows> done = transaction.Execute(sql, Params().Text(id)); !done.ok()) return done.status();
  }
  absl::StatusOr<std::optional<PartRow>> newest = FindPart(transaction, id, 0);
  if (!newest.ok()) return newest.status();
  if (absl::Status seen = CheckPartSeen(transaction, entry.reader, id, part.customer_id); !seen.ok()) return seen;
  // Once stated it stays until another is stated: who knows of no customers opens no part.
  if (*newest && part.customer_id.empty()) part.customer_id = (*newest)->customer_id;
  const bool known = *newest && (*newest)->content_sha256 == part.content_sha256;
  part.revision = (*newest ? (*newest)->revision : 0) + (known ? 0 : 1);
  entry.kind = "part";
  entry.name = "parts/" + id + "@" + std::to_string(part.revision);
  if (known) {
    if (absl::Status kept = KeepRequest(transaction, entry.request, entry.name); !kept.ok()) return kept;
    return **std::move(newest);
  }
  const std::string record_id = NewUuid();
  Params params;
  params.Text(id).Int(part.revision).Digest(part.content_sha256).Text(part.cad_format).Real(part.cad_unit_mm);
  params.Digest(part.tessellation.cad_sha256).Text(part.tessellation.method);
  params.Reals(part.zero_from_part_nominal_rotation).Reals(part.zero_from_part_nominal_translation_mm);
  params.Uuid(record_id);
  params.OptionalText(part.customer_id);
  Add(part.thermal_expansion, &params);
  params.OptionalText(part.solid);
  if (const absl::StatusOr<Rows> inserted = transaction.Execute(kInsertPartRevision, params); !inserted.ok())
    return inserted.status();
  if (const absl::Status holes = InsertHoles(transaction, part); !holes.ok()) return holes;
  if (const absl::Status datums = InsertDatums(transaction, part); !datums.ok()) return datums;
  if (const absl::Status stations = InsertStations(transaction, part); !stations.ok()) return stations;
  if (const absl::Status regions = InsertShapeRegions(transaction, part); !regions.ok()) return regions;
  const absl::StatusOr<Recorded> recorded = AppendRecord(transaction, record_id, entry);
  if (!recorded.ok()) return recorded.status();
  part.recorded = *recorded;
  return part;
}

absl::StatusOr<std::optional<PartRow>> FindPart(Transaction& transaction, const std::string& id, int revision) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectPartRevision, Params().Text(id).Int(revision));
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return std::nullopt;
  PartRow part;
  part.part_id = id;
  part.revision = static_cast<int>(rows->Int(0, 0));
  part.content_sha256 = rows->Digest(0, 1);
  part.cad_format = rows->Text(0, 2);
  part.cad_unit_mm = rows->Real(0, 3);
  part.zero_from_part_nominal_rotation = rows->Reals(0, 6);
  part.zero_from_part_nominal_translation_mm = rows->Reals(0, 7);
  part.recorded = {rows->Int(0, 8), rows->Time(0, 9)};
  part.customer_id = rows->OptionalText(0, 10);
  part.thermal_expansion = ExpansionAt(*rows, 0, 11);
  part.solid = rows->OptionalText(0, 13);
  absl::StatusOr<std::optional<TessellationRow>> tessellation =
      FindTessellation(transaction, rows->Digest(0, 4), rows->Text(0, 5));
  if (!tessellation.ok()) return tessellation.status();
  if (!*tessellation) return absl::DataLossError("part " + id + ": its tessellation is gone");
  part.tessellation = **std::move(tessellation);
  if (const absl::Status read = ReadChildren(transaction, &part); !read.ok()) return read;
  return rows->Checked(std::move(part));
}

}  // namespace sixpoint::storage
