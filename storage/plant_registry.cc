#include "storage/plant_registry.h"

#include <utility>

#include "storage/clearances.h"
#include "storage/each_row.h"
#include "storage/requests.h"

namespace sixpoint::storage {
namespace {

constexpr char kInsertMachine[] = "INSERT INTO machines (machine_id) VALUES ($1) ON CONFLICT DO NOTHING";
constexpr char kLockMachine[] = "SELECT pg_advisory_xact_lock(hashtextextended('machines/' || $1, 0))";
#define SIXPOINT_MACHINE_ERRORS                                                                                       \
  "approach, touch_offset_um, scanner_field_um, tool_offset_um, linear_scale_um_per_m, squareness_um_per_m, "         \
  "temperature_k, temperature_half_range_k, encoder_latency_um, interim_check_limit_um, scale_expansion_um_per_m_k, " \
  "scale_expansion_standard_uncertainty_um_per_m_k, sensor_serial_number, sensor_kind, touch_probe_serial_number, "   \
  "touch_probe_certificate_number, touch_probe_calibrated_at, touch_probe_expires_at"
constexpr char kInsertMachineRevision[] =
    "INSERT INTO machine_revisions (machine_id, revision, content_sha256, sensor_model, sensor_noise_um, "
    "sensor_column_count, sensor_mid_range_mm, sensor_range_mm, sensor_line_angle_deg, nominal_centre_mm, "
    "safety_translation_mm, safety_rotation_deg, safety_uncertainty_share, safety_registration_age_h, "
    "safety_keep_out_mm, " SIXPOINT_MACHINE_ERRORS
    ", record_id) "
    "VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17, $18, $19, $20, $21, $22, $23, "
    "$24, $25, $26, $27, $28, $29, $30, $31, $32, $33, $34)";
constexpr char kInsertJoint[] =
    "INSERT INTO machine_joints (machine_id, revision, side, position_index, axis, kind, direction, point_mm, sign, "
    "minimum, maximum, positioning_standard_uncertainty_deg) "
    "VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12)";
constexpr char kSelectMachine[] =
    "SELECT revision, content_sha256, sensor_model, sensor_noise_um, sensor_column_count, sensor_mid_range_mm, "
    "sensor_range_mm, sensor_line_angle_deg, nominal_centre_mm, safety_translation_mm, safety_rotation_deg, "
    "safety_uncertainty_share, safety_registration_age_h, safety_keep_out_mm, record_sequence, "
    "recorded_at, " SIXPOINT_MACHINE_ERRORS
    " FROM machine_revisions JOIN record_names USING (record_id) WHERE machine_id = $1 AND "
    "($2::integer = 0 OR revision = $2) "
    "ORDER BY revision DESC LIMIT 1";
#undef SIXPOINT_MACHINE_ERRORS
constexpr char kSelectJoints[] =
    "SELECT side, axis, kind, direction, point_mm, sign, minimum, maximum, positioning_standard_uncertainty_deg "
    "FROM machine_joints "
    "WHERE machine_id = $1 AND revision = $2 ORDER BY side, position_index";

constexpr char kInsertArtefact[] = "INSERT INTO artefacts (artefact_id) VALUES ($1) ON CONFLICT DO NOTHING";
constexpr char kLockArtefact[] = "SELECT pg_advisory_xact_lock(hashtextextended('artefacts/' || $1, 0))";
constexpr char kInsertArtefactRevision[] =
    "INSERT INTO artefact_revisions (artefact_id, revision, content_sha256, side_mm, cone_half_angle_deg, "
    "cone_top_radius_mm, cone_bottom_radius_mm, slot_width_mm, slot_depth_mm, record_id, serial_number, "
    "certificate_number, certificate_calibrated_at, certificate_expires_at, centre_standard_uncertainty_um, "
    "flatness_standard_uncertainty_um) "
    "VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16)";
constexpr char kInsertFeatures[] =
    "INSERT INTO artefact_features (artefact_id, revision, kind, position_index, feature, x_mm, y_mm) "
    "SELECT $1::text, $2::integer, kind, (position - 1)::integer, feature, x_mm, y_mm "
    "FROM unnest($3::text[], $4::text[], $5::double precision[], $6::double precision[]) WITH ORDINALITY "
    "AS feature (kind, feature, x_mm, y_mm, position)";
constexpr char kSelectArtefact[] =
    "SELECT revision, content_sha256, side_mm, cone_half_angle_deg, cone_top_radius_mm, cone_bottom_radius_mm, "
    "slot_width_mm, slot_depth_mm, record_sequence, recorded_at, serial_number, certificate_number, "
    "certificate_calibrated_at, certificate_expires_at, centre_standard_uncertainty_um, "
    "flatness_standard_uncertainty_um "
    "FROM artefact_revisions JOIN record_names USING (record_id) "
    "WHERE artefact_id = $1 AND ($2::integer = 0 OR revision = $2) ORDER BY revision DESC LIMIT 1";
constexpr char kSelectFeatures[] =
    "SELECT kind, feature, x_mm, y_mm FROM artefact_features WHERE artefact_id = $1 AND revision = $2 "
    "ORDER BY kind, position_index";

// The newest revision's time decides.
#define SIXPOINT_SELECT_IDS(id, revisions, hidden)                                      \
  "SELECT " id " FROM (SELECT DISTINCT ON (" id ") " id ", recorded_at FROM " revisions \
  " JOIN record_names USING (record_id) WHERE " id " > $1 ORDER BY " id                 \
  ", revision DESC) newest WHERE ($2::timestamptz IS NULL OR recorded_at >= $2) "       \
  "AND ($3::timestamptz IS NULL OR recorded_at < $3) " hidden "ORDER BY " id " LIMIT $4"
constexpr char kSelectMachineIds[] = SIXPOINT_SELECT_IDS("machine_id", "machine_revisions", "");
constexpr char kSelectArtefactIds[] = SIXPOINT_SELECT_IDS("artefact_id", "artefact_revisions", "");
constexpr char kSelectPartIds[] = SIXPOINT_SELECT_IDS("part_id", "part_revisions", "AND part_id <> ALL ($5::text[]) ");
constexpr char kSelectModelIds[] = SIXPOINT_SELECT_IDS(
    "machining_model_id", "machining_model_revisions",
    "AND EXISTS (SELECT FROM machining_models m WHERE m.machining_model_id = newest.machining_model_id "
    "AND m.part_id <> ALL ($5::text[]) AND ($6 = '' OR m.part_id = $6)) ");
#undef SIXPOINT_SELECT_IDS

// In the order of their columns.
constexpr std::optional<double> MachineRow::*kMachineFigures[] = {
    &MachineRow::touch_offset_um,          &MachineRow::scanner_field_um,    &MachineRow::tool_offset_um,
    &MachineRow::linear_scale_um_per_m,    &MachineRow::squareness_um_per_m, &MachineRow::temperature_k,
    &MachineRow::temperature_half_range_k, &MachineRow::encoder_latency_um,  &MachineRow::interim_check_limit_um};

// The id's own row, and a lock on it, so that revisions are numbered one at a time.
absl::Status Claim(Transaction& transaction, const char* insert, const char* lock, const std::string& id) {
  if (const absl::StatusOr<Rows> locked = transaction.Execute(lock, Params().Text(id)); !locked.ok())
    return locked.status();
  return transaction.Execute(insert, Params().Text(id)).status();
}

absl::StatusOr<Recorded> Journal(Transaction& transaction, const std::string& record_id, const std::string& kind,
                                 const std::string& id, int revision, RecordEntry entry) {
  entry.kind = kind;
  entry.name = RevisionName(kind, id, revision);
  return AppendRecord(transaction, record_id, entry);
}

// Nothing new: the request gives what was there.
template <typename Row>
absl::StatusOr<Row> AsBefore(Transaction& transaction, const RecordEntry& entry, const std::string& name, Row row) {
  if (absl::Status kept = KeepRequest(transaction, entry.request, name); !kept.ok()) return kept;
  return row;
}

}  // namespace

absl::StatusOr<MachineRow> InsertMachine(Transaction& transaction, MachineRow machine, RecordEntry entry) {
  const std::string& id = machine.machine_id;
  if (const absl::Status claimed = Claim(transaction, kInsertMachine, kLockMachine, id); !claimed.ok()) return claimed;
  absl::StatusOr<std::optional<MachineRow>> newest = FindMachine(transaction, id, 0);
  if (!newest.ok()) return newest.status();
  if (*newest && (*newest)->content_sha256 == machine.content_sha256)
    return AsBefore(transaction, entry, RevisionName("machine", id, (*newest)->revision), **std::move(newest));
  machine.revision = *newest ? (*newest)->revision + 1 : 1;
  const std::string record_id = NewUuid();
  Params params;
  params.Text(id).Int(machine.revision).Digest(machine.content_sha256).Text(machine.sensor_model);
  params.Real(machine.sensor_noise_um).Int(machine.sensor_column_count).Real(machine.sensor_mid_range_mm);
  params.Real(machine.sensor_range_mm).Real(machine.sensor_line_angle_deg).Reals(machine.nominal_centre_mm);
  params.Real(machine.safety_translation_mm).Real(machine.safety_rotation_deg).Real(machine.safety_uncertainty_share);
  params.Real(machine.safety_registration_age_h).Real(machine.safety_keep_out_mm);
  params.OptionalText(machine.approach);
  for (const auto figure : kMachineFigures) params.OptionalReal(machine.*figure);
  Add(machine.scale_expansion, &params);
  params.OptionalText(machine.sensor_serial_number).OptionalText(machine.sensor_kind);
  params.OptionalText(machine.touch_probe_serial_number);
  Add(machine.touch_probe_certificate, &params);
  params.Uuid(record_id);
  if (const absl::StatusOr<Rows> inserted = transaction.Execute(kInsertMachineRevision, params); !inserted.ok())
    return inserted.status();
  int position = 0;
  for (const JointRow& joint : machine.joints) {
    Params row;
    row.Text(id).Int(machine.revision).Text(joint.side).Int(position++).Text(joint.axis).Text(joint.kind);
    row.Reals(joint.direction);
    joint.point_mm ? row.Reals(*joint.point_mm) : row.Null();
    row.Real(joint.sign).Real(joint.minimum).Real(joint.maximum);
    row.OptionalReal(joint.positioning_standard_uncertainty_deg);
    if (const absl::StatusOr<Rows> inserted = transaction.Execute(kInsertJoint, row); !inserted.ok())
      return inserted.status();
  }
  entry.machine = id;
  const absl::StatusOr<Recorded> recorded = Journal(transaction, record_id, "machine", id, machine.revision, entry);
  if (!recorded.ok()) return recorded.status();
  machine.recorded = *recorded;
  return machine;
}

absl::StatusOr<std::optional<MachineRow>> FindMachine(Transaction& transaction, const std::string& id, int revision) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectMachine, Params().Text(id).Int(revision));
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return std::nullopt;
  MachineRow machine;
  machine.machine_id = id;
  machine.revision = static_cast<int>(rows->Int(0, 0));
  machine.content_sha256 = rows->Digest(0, 1);
  machine.sensor_model = rows->Text(0, 2);
  machine.sensor_noise_um = rows->Real(0, 3);
  machine.sensor_column_count = static_cast<int>(rows->Int(0, 4));
  machine.sensor_mid_range_mm = rows->Real(0, 5);
  machine.sensor_range_mm = rows->Real(0, 6);
  machine.sensor_line_angle_deg = rows->Real(0, 7);
  machine.nominal_centre_mm = rows->Reals(0, 8);
  machine.safety_translation_mm = rows->Real(0, 9);
  machine.safety_rotation_deg = rows->Real(0, 10);
  machine.safety_uncertainty_share = rows->Real(0, 11);
  machine.safety_registration_age_h = rows->Real(0, 12);
  machine.safety_keep_out_mm = rows->Real(0, 13);
  machine.recorded = {rows->Int(0, 14), rows->Time(0, 15)};
  machine.approach = rows->OptionalText(0, 16);
  int column = 17;
  for (const auto figure : kMachineFigures) machine.*figure = rows->OptionalReal(0, column++);
  machine.scale_expansion = ExpansionAt(*rows, 0, column);
  machine.sensor_serial_number = rows->OptionalText(0, column + 2);
  machine.sensor_kind = rows->OptionalText(0, column + 3);
  machine.touch_probe_serial_number = rows->OptionalText(0, column + 4);
  machine.touch_probe_certificate = CertificateAt(*rows, 0, column + 5);
  const absl::StatusOr<Rows> joints = transaction.Execute(kSelectJoints, Params().Text(id).Int(machine.revision));
  if (!joints.ok()) return joints.status();
  for (int row = 0; row < joints->count(); ++row) {
    JointRow& joint = machine.joints.emplace_back();
    joint.side = joints->Text(row, 0);
    joint.axis = joints->Text(row, 1);
    joint.kind = joints->Text(row, 2);
    joint.direction = joints->Reals(row, 3);
    if (!joints->IsNull(row, 4)) joint.point_mm = joints->Reals(row, 4);
    joint.sign = joints->Real(row, 5);
    joint.minimum = joints->Real(row, 6);
    joint.maximum = joints->Real(row, 7);
    joint.positioning_standard_uncertainty_deg = joints->OptionalReal(row, 8);
  }
  if (absl::Status read = rows->status(); !read.ok()) return read;
  return joints->Checked(std::move(machine));
}

absl::StatusOr<ArtefactRow> InsertArtefact(Transaction& transaction, ArtefactRow artefact, RecordEntry entry) {
  const std::string& id = artefact.artefact_id;
  if (const absl::Status claimed = Claim(transaction, kInsertArtefact, kLockArtefact, id); !claimed.ok())
    return claimed;
  absl::StatusOr<std::optional<ArtefactRow>> newest = FindArtefact(transaction, id, 0);
  if (!newest.ok()) return newest.status();
  if (*newest && (*newest)->content_sha256 == artefact.content_sha256)
    return AsBefore(transaction, entry, RevisionName("artefact", id, (*newest)->revision), **std::move(newest));
  artefact.revision = *newest ? (*newest)->revision + 1 : 1;
  const std::string record_id = NewUuid();
  Params params;
  params.Text(id).Int(artefact.revision).Digest(artefact.content_sha256).Real(artefact.side_mm);
  params.Real(artefact.cone_half_angle_deg).Real(artefact.cone_top_radius_mm).Real(artefact.cone_bottom_radius_mm);
  params.Real(artefact.slot_width_mm).Real(artefact.slot_depth_mm);
  params.Uuid(record_id).OptionalText(artefact.serial_number);
  Add(artefact.certificate, &params);
  params.OptionalReal(artefact.centre_standard_uncertainty_um);
  params.OptionalReal(artefact.flatness_standard_uncertainty_um);
  if (const absl::StatusOr<Rows> inserted = transaction.Execute(kInsertArtefactRevision, params); !inserted.ok())
    return inserted.status();
  std::vector<std::string> kinds, names;
  std::vector<double> x_mm, y_mm;
  for (const PlateFeatureRow& feature : artefact.features) {
    kinds.push_back(feature.kind);
    names.push_back(feature.feature);
    x_mm.push_back(feature.x_mm);
    y_mm.push_back(feature.y_mm);
  }
  const absl::StatusOr<Rows> features = transaction.Execute(
      kInsertFeatures, Params().Text(id).Int(artefact.revision).Texts(kinds).Texts(names).Reals(x_mm).Reals(y_mm));
  if (!features.ok()) return features.status();
  const absl::StatusOr<Recorded> recorded = Journal(transaction, record_id, "artefact", id, artefact.revision, entry);
  if (!recorded.ok()) return recorded.status();
  artefact.recorded = *recorded;
  return artefact;
}

absl::StatusOr<std::optional<ArtefactRow>> FindArtefact(Transaction& transaction, const std::string& id, int revision) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectArtefact, Params().Text(id).Int(revision));
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return std::nullopt;
  ArtefactRow artefact;
  artefact.artefact_id = id;
  artefact.revision = static_cast<int>(rows->Int(0, 0));
  artefact.content_sha256 = rows->Digest(0, 1);
  artefact.side_mm = rows->Real(0, 2);
  artefact.cone_half_angle_deg = rows->Real(0, 3);
  artefact.cone_top_radius_mm = rows->Real(0, 4);
  artefact.cone_bottom_radius_mm = rows->Real(0, 5);
  artefact.slot_width_mm = rows->Real(0, 6);
  artefact.slot_depth_mm = rows->Real(0, 7);
  artefact.recorded = {rows->Int(0, 8), rows->Time(0, 9)};
  artefact.serial_number = rows->OptionalText(0, 10);
  artefact.certificate = CertificateAt(*rows, 0, 11);
  artefact.centre_standard_uncertainty_um = rows->OptionalReal(0, 14);
  artefact.flatness_standard_uncertainty_um = rows->OptionalReal(0, 15);
  const absl::StatusOr<Rows> features = transaction.Execute(kSelectFeatures, Params().Text(id).Int(artefact.revision));
  if (!features.ok()) return features.status();
  for (int row = 0; row < features->count(); ++row)
    artefact.features.push_back(
        {features->Text(row, 0), features->Text(row, 1), features->Real(row, 2), features->Real(row, 3)});
  if (absl::Status read = rows->status(); !read.ok()) return read;
  return features->Checked(std::move(artefact));
}

namespace {

struct RegisteredKind {
  const char *collection, *sql;
  bool of_parts;  // those that may not be seen are hidden
};
RegisteredKind KindOf(Registered what) {
  switch (what) {
    case Registered::kMachines:
      return {"machines", kSelectMachineIds, false};
    case Registered::kArtefacts:
      return {"artefacts", kSelectArtefactIds, false};
    case Registered::kParts:
      return {"parts", kSelectPartIds, true};
    case Registered::kMachiningModels:
      break;
  }
  return {"machining_models", kSelectModelIds, true};
}

}  // namespace

std::string CollectionOf(Registered what) { return KindOf(what).collection; }

absl::StatusOr<std::vector<std::string>> ListRegistered(Transaction& transaction, Registered what,
                                                        const RegisteredFilter& filter, const std::string& after,
                                                        int limit) {
  const RegisteredKind kind = KindOf(what);
  Params params;
  params.Text(after);
  AddSpan(filter.recorded, &params);
  params.Int(limit);
  if (kind.of_parts) {
    const absl::StatusOr<Sight> sight = SightOf(transaction, filter.reader);
    if (!sight.ok()) return sight.status();
    params.Texts(sight->hidden_parts);
  }
  if (what == Registered::kMachiningModels) params.Text(filter.part_id);
  return AllRows(transaction, kind.sql, params,
                 [](const Rows& rows, int row) -> std::string { return rows.Text(row, 0); });
}

}  // namespace sixpoint::storage
