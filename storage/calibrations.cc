#include "storage/calibrations.h"

#include <map>

#include "storage/axis_characterisations.h"
#include "storage/calibration_state.h"
#include "storage/probe_calibrations.h"
#include "storage/scan_keys.h"

namespace sixpoint::storage {
namespace {

#define SIXPOINT_HEAD_COLUMNS                                                                                 \
  "calibration_id, machine_id, kind, method, inputs, request_sha256, valid_from, valid_until, requested_by, " \
  "software_version, is_draft, temperature_c, temperature_standard_uncertainty_c, humidity_percent, "         \
  "environment_note, "                                                                                        \
  "judgements"
#define SIXPOINT_SELECT_HEADS                                                                                       \
  "SELECT " SIXPOINT_HEAD_COLUMNS                                                                                   \
  ", record_sequence, recorded_at, name_of(requested_by) FROM calibrations c JOIN record_names n ON n.record_id = " \
  "c.calibration_id WHERE "
#define SIXPOINT_SENSOR_COLUMNS                                                                                    \
  "calibration_id, machine_from_sensor_rotation, t_sm_mm, covariance, alpha_deg, beta_deg, gamma_deg, "            \
  "alpha_standard_uncertainty_deg, beta_standard_uncertainty_deg, gamma_standard_uncertainty_deg, noise_um, "      \
  "touch_rms_um, residual_rms_um, condition_number, points_used, field_response, arm_series, degrees_of_freedom, " \
  "sensor_serial_number, travel, field_terms_um, field_covariance_um2, field_stated_um, arm_shares, certificate"
#define SIXPOINT_ROTATION_COLUMNS                                                                                   \
  "calibration_id, a_direction, a_point_mm, b_direction, b_point_mm, covariance, point_c_mm, "                      \
  "point_c_standard_uncertainty_mm, noise_um, residual_rms_um, check_rms_um, check_count, condition_number, axes, " \
  "degrees_of_freedom, linear_response"

constexpr char kInsertCalibration[] = "INSERT INTO calibrations (" SIXPOINT_HEAD_COLUMNS
                                      ", axis) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, "
                                      "$15, $16::jsonb, $17)";
constexpr char kInsertSensor[] = "INSERT INTO sensor_calibrations (" SIXPOINT_SENSOR_COLUMNS
                                 ") VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, "
                                 "$16, $17, $18, $19, $20, $21, $22, $23, $24::jsonb, $25)";
constexpr char kInsertCentres[] =
    "INSERT INTO sensor_calibration_centres (calibration_id, position_index, scan_key, feature, is_check, dx_um, dy_um, "
    "dz_um) SELECT $1::uuid, (position - 1)::integer, " SIXPOINT_SCAN_KEY(
        "scan_id") ", feature, is_check::boolean, dx_um, dy_um, dz_um "
    "FROM unnest($2::text[], $3::text[], $4::text[], $5::double precision[], $6::double precision[], "
    "$7::double precision[]) WITH ORDINALITY AS centre (scan_id, feature, is_check, dx_um, dy_um, dz_um, position)";
constexpr char kInsertRotation[] = "INSERT INTO rotation_calibrations (" SIXPOINT_ROTATION_COLUMNS
                                   ") VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16)";
constexpr char kInsertPoses[] =
    "INSERT INTO rotation_calibration_poses (calibration_id, position_index, a_deg, b_deg, distance_um, held_out, "
    "before_um) SELECT $1::uuid, (position - 1)::integer, a_deg, b_deg, distance_um, held_out::boolean, before_um "
    "FROM unnest($2::double precision[], $3::double precision[], $4::double precision[], $5::text[], "
    "$6::double precision[]) WITH ORDINALITY AS pose (a_deg, b_deg, distance_um, held_out, before_um, position)";

constexpr char kSelectHead[] = SIXPOINT_SELECT_HEADS "calibration_id = $1";
constexpr char kSelectCalibrationInForce[] = SIXPOINT_SELECT_HEADS
    "calibration_id = (SELECT f.calibration_id FROM calibration_forces f "
    "WHERE f.machine_id = $1 AND f.kind = $2 AND f.axis = $3 AND f.valid_from <= $4 AND $4 < f.valid_until "
    "ORDER BY f.force_sequence DESC LIMIT 1)";
constexpr char kSelectLastValidity[] =
    "SELECT valid_until FROM calibration_forces WHERE machine_id = $1 AND kind = $2 AND axis = $3 "
    "AND valid_from <= $4 ORDER BY valid_until DESC LIMIT 1";
constexpr char kSelectWithdrawn[] = SIXPOINT_SELECT_HEADS
    "calibration_id = (SELECT d.calibration_id FROM calibrations d "
    "JOIN calibration_events w ON w.calibration_id = d.calibration_id AND w.event = 'WITHDRAWN' "
    "JOIN record_names m ON m.record_id = w.record_id "
    "WHERE d.machine_id = $1 AND d.kind = $2 AND COALESCE(d.axis, '') = $3 "
    "AND d.valid_from <= $4 AND $4 < d.valid_until "
    "ORDER BY m.record_sequence DESC LIMIT 1)";
constexpr char kSelectHistory[] = SIXPOINT_SELECT_HEADS
    "calibration_id IN (SELECT f.calibration_id FROM calibration_forces f "
    "WHERE f.machine_id = $1 AND f.kind = $2 AND f.axis = $3 "
    "ORDER BY f.valid_from DESC, f.force_sequence DESC LIMIT $4) "
    "ORDER BY valid_from, record_sequence";
constexpr char kSelectStates[] =
    "SELECT c.calibration_id, (SELECT f.calibration_id FROM calibration_forces f "
    "WHERE f.machine_id = c.machine_id AND f.kind = c.kind AND f.axis = COALESCE(c.axis, '') "
    "AND f.valid_from <= $2 AND $2 < f.valid_until "
    "ORDER BY f.force_sequence DESC LIMIT 1) FROM calibrations c WHERE c.calibration_id = ANY ($1::uuid[])";
constexpr char kSelectCalibrationEvents[] =
    "SELECT calibration_id, event, reason, name_of(requested_by), software_version, record_sequence, recorded_at "
    "FROM calibration_events e JOIN record_names n ON n.record_id = e.record_id WHERE calibration_id = ANY "
    "($1::uuid[])";
constexpr char kSelectCalibrations[] = SIXPOINT_SELECT_HEADS
    "($1 = '' OR machine_id = $1) AND ($2 = '' OR kind = $2) AND ($3 = '' OR axis = $3) "
    "AND ($4 = '' OR $4 = calibration_state(c.calibration_id, $5::timestamptz)) "
    "AND ($6::timestamptz IS NULL OR recorded_at >= $6) AND ($7::timestamptz IS NULL OR recorded_at < $7) "
    "AND ($8::bigint = 0 OR record_sequence < $8::bigint) ORDER BY record_sequence DESC LIMIT $9";
constexpr char kSelectSensors[] =
    "SELECT " SIXPOINT_SENSOR_COLUMNS " FROM sensor_calibrations WHERE calibration_id = ANY ($1::uuid[])";
constexpr char kSelectRotations[] =
    "SELECT " SIXPOINT_ROTATION_COLUMNS " FROM rotation_calibrations WHERE calibration_id = ANY ($1::uuid[])";
constexpr char kSelectCentres[] =
    "SELECT " SIXPOINT_SCAN_ID("scan_key")
    ", feature, is_check, dx_um, dy_um, dz_um FROM sensor_calibration_centres WHERE calibration_id = $1 "
    "ORDER BY position_index";
constexpr char kSelectPoses[] =
    "SELECT a_deg, b_deg, distance_um, held_out, before_um FROM rotation_calibration_poses WHERE calibration_id = $1 "
    "ORDER BY position_index";
#undef SIXPOINT_HEAD_COLUMNS
#undef SIXPOINT_SELECT_HEADS
#undef SIXPOINT_SENSOR_COLUMNS
#undef SIXPOINT_ROTATION_COLUMNS

absl::Status InsertSensor(Transaction& transaction, const std::string& id, const SensorCalibrationRow& sensor) {
  Params params;
  params.Uuid(id).Reals(sensor.machine_from_sensor_rotation).Reals(sensor.t_sm_mm).Reals(sensor.covariance);
  params.Real(sensor.alpha_deg).Real(sensor.beta_deg).Real(sensor.gamma_deg);
  params.Real(sensor.alpha_standard_uncertainty_deg).Real(sensor.beta_standard_uncertainty_deg);
  params.Real(sensor.gamma_standard_uncertainty_deg);
  params.OptionalReal(sensor.noise_um).OptionalReal(sensor.touch_rms_um).OptionalReal(sensor.residual_rms_um);
  params.OptionalReal(sensor.condition_number);
  params.OptionalInt(sensor.points_used);
  sensor.field_response.empty() ? params.Null() : params.Reals(sensor.field_response);
  params.OptionalText(sensor.arm_series).OptionalReal(sensor.degrees_of_freedom);
  params.OptionalText(sensor.sensor_serial_number).OptionalText(sensor.travel);
  for (const auto* values : {&sensor.field_terms_um, &sensor.field_covariance_um2})
    values->empty() ? params.Null() : params.Reals(*values);
  params.OptionalReal(sensor.field_stated_um).OptionalText(sensor.arm_shares_json).OptionalText(sensor.certificate);
  if (const auto inserted = transaction.Execute(kInsertSensor, params); !inserted.ok()) return inserted.status();
  std::vector<std::string> scans, features, checks;
  std::vector<double> dx, dy, dz;
  for (const CentreResidualRow& c : sensor.centres) {
    scans.push_back(c.scan_id);
    features.push_back(c.feature);
    checks.push_back(c.is_check ? "true" : "false");
    dx.push_back(c.dx_um);
    dy.push_back(c.dy_um);
    dz.push_back(c.dz_um);
  }
  return transaction
      .Execute(kInsertCentres,
               Params().Uuid(id).Texts(scans).Texts(features).Texts(checks).Reals(dx).Reals(dy).Reals(dz))
      .status();
}

absl::Status InsertRotation(Transaction& transaction, const std::string& id, const RotationCalibrationRow& rotation) {
  Params params;
  params.Uuid(id).Reals(rotation.a_direction).Reals(rotation.a_point_mm).Reals(rotation.b_direction);
  params.Reals(rotation.b_point_mm).Reals(rotation.covariance).Reals(rotation.point_c_mm);
  params.Reals(rotation.point_c_standard_uncertainty_mm).Real(rotation.noise_um).Real(rotation.residual_rms_um);
  params.Real(rotation.check_rms_um).Int(rotation.check_count).Real(rotation.condition_number).Texts(rotation.axes);
  params.OptionalReal(rotation.degrees_of_freedom);
  rotation.linear_response.empty() ? params.Null() : params.Reals(rotation.linear_response);
  if (const auto inserted = transaction.Execute(kInsertRotation, params); !inserted.ok()) return inserted.status();
  std::vector<double> a, b, distances;
  std::vector<std::optional<double>> before;
  std::vector<std::string> held_out;
  for (const PoseResidualRow& p : rotation.poses) {
    a.push_back(p.a_deg);
    b.push_back(p.b_deg);
    distances.push_back(p.distance_um);
    held_out.push_back(p.held_out ? "true" : "false");
    before.push_back(p.before_um);
  }
  return transaction
      .Execute(kInsertPoses, Params().Uuid(id).Reals(a).Reals(b).Reals(distances).Texts(held_out).OptionalReals(before))
      .status();
}

SensorCalibrationRow ReadSensor(const Rows& rows, int row) {
  SensorCalibrationRow s;
  s.machine_from_sensor_rotation = rows.Reals(row, 1);
  s.t_sm_mm = rows.Reals(row, 2);
  s.covariance = rows.Reals(row, 3);
  s.alpha_deg = rows.Real(row, 4);
  s.beta_deg = rows.Real(row, 5);
  s.gamma_deg = rows.Real(row, 6);
  s.alpha_standard_uncertainty_deg = rows.Real(row, 7);
  s.beta_standard_uncertainty_deg = rows.Real(row, 8);
  s.gamma_standard_uncertainty_deg = rows.Real(row, 9);
  s.noise_um = rows.OptionalReal(row, 10);
  s.touch_rms_um = rows.OptionalReal(row, 11);
  s.residual_rms_um = rows.OptionalReal(row, 12);
  s.condition_number = rows.OptionalReal(row, 13);
  if (!rows.IsNull(row, 14)) s.points_used = rows.Int(row, 14);
  if (!rows.IsNull(row, 15)) s.field_response = rows.Reals(row, 15);
  s.arm_series = rows.OptionalText(row, 16);
  s.degrees_of_freedom = rows.OptionalReal(row, 17);
  s.sensor_serial_number = rows.OptionalText(row, 18);
  s.travel = rows.OptionalText(row, 19);
  if (!rows.IsNull(row, 20)) s.field_terms_um = rows.Reals(row, 20);
  if (!rows.IsNull(row, 21)) s.field_covariance_um2 = rows.Reals(row, 21);
  s.field_stated_um = rows.OptionalReal(row, 22);
  s.arm_shares_json = rows.OptionalText(row, 23);
  s.certificate = rows.OptionalText(row, 24);
  return s;
}

RotationCalibrationRow ReadRotation(const Rows& rows, int row) {
  RotationCalibrationRow r;
  r.a_direction = rows.Reals(row, 1);
  r.a_point_mm = rows.Reals(row, 2);
  r.b_direction = rows.Reals(row, 3);
  r.b_point_mm = rows.Reals(row, 4);
  r.covariance = rows.Reals(row, 5);
  r.point_c_mm = rows.Reals(row, 6);
  r.point_c_standard_uncertainty_mm = rows.Reals(row, 7);
  r.noise_um = rows.Real(row, 8);
  r.residual_rms_um = rows.Real(row, 9);
  r.check_rms_um = rows.Real(row, 10);
  r.check_count = static_cast<int>(rows.Int(row, 11));
  r.condition_number = rows.Real(row, 12);
  r.axes = rows.Texts(row, 13);
  r.degrees_of_freedom = rows.OptionalReal(row, 14);
  if (!rows.IsNull(row, 15)) r.linear_response = rows.Reals(row, 15);
  return r;
}

Params KeyOf(const CalibrationSubject& subject) {
  return Params().Text(subject.machine_id).Text(subject.kind).Text(subject.axis);
}

absl::Status ReadStates(Transaction& transaction, Instant now, std::vector<CalibrationRow>* calibrations) {
  std::vector<std::string> ids;
  for (const CalibrationRow& c : *calibrations) ids.push_back(c.calibration_id);
  const absl::StatusOr<Rows> events = transaction.Execute(kSelectCalibrationEvents, Params().Uuids(ids));
  if (!events.ok()) return events.status();
  const absl::StatusOr<Rows> in_force = transaction.Execute(kSelectStates, Params().Uuids(ids).Time(now));
  if (!in_force.ok()) return in_force.status();
  for (CalibrationRow& c : *calibrations) {
    for (int row = 0; row < events->count(); ++row) {
      if (events->Text(row, 0) != c.calibration_id) continue;
      (events->Text(row, 1) == "RELEASED" ? c.release : c.withdrawal) =
          CalibrationEvent{events->Text(row, 2), events->Text(row, 3), events->Text(row, 4),
                           Recorded{events->Int(row, 5), events->Time(row, 6)}};
    }
    for (int row = 0; row < in_force->count(); ++row) {
      if (in_force->Text(row, 0) != c.calibration_id) continue;
      const std::string other = in_force->IsNull(row, 1) ? "" : in_force->Text(row, 1);
      c.as_of = now;
      c.state = StateOf(c, other, now);
      if (c.state == CalibrationState::kSuperseded) c.superseded_by = other;
    }
  }
  if (absl::Status read = events->status(); !read.ok()) return read;
  return in_force->status();
}

// The heads with the results of their kinds and their states: six statements for any number of rows.
absl::StatusOr<std::vector<CalibrationRow>> ReadCalibrations(Transaction& transaction, const Rows& heads, Instant now) {
  std::vector<CalibrationRow> found;
  std::map<std::string, std::vector<std::string>> ids_by_kind;
  for (int row = 0; row < heads.count(); ++row) {
    CalibrationRow& c = found.emplace_back();
    c.calibration_id = heads.Text(row, 0);
    c.machine_id = heads.Text(row, 1);
    ids_by_kind[heads.Text(row, 2)].push_back(c.calibration_id);
    c.method = heads.Text(row, 3);
    c.inputs = heads.Texts(row, 4);
    c.request_sha256 = heads.Digest(row, 5);
    c.valid_from = heads.Time(row, 6);
    c.valid_until = heads.Time(row, 7);
    c.requested_by = heads.Text(row, 18);
    c.software_version = heads.Text(row, 9);
    c.is_draft = heads.Bool(row, 10);
    c.environment = {heads.OptionalReal(row, 11), heads.OptionalReal(row, 12), heads.OptionalReal(row, 13),
                     heads.Text(row, 14)};
    c.judgements_json = heads.OptionalText(row, 15);
    c.recorded = {heads.Int(row, 16), heads.Time(row, 17)};
  }
  if (absl::Status read = heads.status(); !read.ok()) return read;
  const absl::StatusOr<Rows> sensors = transaction.Execute(kSelectSensors, Params().Uuids(ids_by_kind["sensor"]));
  if (!sensors.ok()) return sensors.status();
  const absl::StatusOr<Rows> rotations = transaction.Execute(kSelectRotations, Params().Uuids(ids_by_kind["rotation"]));
  if (!rotations.ok()) return rotations.status();
  if (const absl::Status s = ReadProbes(transaction, ids_by_kind["probe"], &found); !s.ok()) return s;
  if (const absl::Status s = ReadAxes(transaction, ids_by_kind["axis"], &found); !s.ok()) return s;
  for (CalibrationRow& c : found) {
    for (int row = 0; row < sensors->count(); ++row)
      if (sensors->Text(row, 0) == c.calibration_id) c.sensor = ReadSensor(*sensors, row);
    for (int row = 0; row < rotations->count(); ++row)
      if (rotations->Text(row, 0) == c.calibration_id) c.rotation = ReadRotation(*rotations, row);
    if (!c.sensor && !c.rotation && !c.probe && !c.axis)
      return absl::DataLossError("calibration " + c.calibration_id + ": its result is gone");
  }
  if (const absl::Status read = ReadStates(transaction, now, &found); !read.ok()) return read;
  if (absl::Status read = sensors->status(); !read.ok()) return read;
  return rotations->Checked(std::move(found));
}

absl::Status ReadResiduals(Transaction& transaction, CalibrationRow* calibration) {
  if (calibration->probe) return ReadProbeResiduals(transaction, calibration->calibration_id, &*calibration->probe);
  if (calibration->axis) return ReadAxisTable(transaction, calibration->calibration_id, &*calibration->axis);
  const absl::StatusOr<Rows> rows = transaction.Execute(calibration->sensor ? kSelectCentres : kSelectPoses,
                                                        Params().Uuid(calibration->calibration_id));
  if (!rows.ok()) return rows.status();
  for (int row = 0; row < rows->count(); ++row)
    if (calibration->sensor)
      calibration->sensor->centres.push_back({rows->Text(row, 0), rows->Text(row, 1), rows->Bool(row, 2),
                                              rows->Real(row, 3), rows->Real(row, 4), rows->Real(row, 5)});
    else
      calibration->rotation->poses.push_back(
          {rows->Real(row, 0), rows->Real(row, 1), rows->Real(row, 2), rows->Bool(row, 3), rows->OptionalReal(row, 4)});
  if (!calibration->sensor) return rows->status();
  absl::StatusOr<std::optional<InterimStateRow>> interim = InterimStateOf(transaction, calibration->calibration_id);
  if (interim.ok()) calibration->interim = *std::move(interim);
  return interim.ok() ? rows->status() : interim.status();
}

absl::StatusOr<std::optional<CalibrationRow>> FindOne(Transaction& transaction, const char* sql, const Params& key,
                                                      Instant now) {
  const absl::StatusOr<Rows> heads = transaction.Execute(sql, key);
  if (!heads.ok()) return heads.status();
  if (heads->count() == 0) return std::nullopt;
  absl::StatusOr<std::vector<CalibrationRow>> found = ReadCalibrations(transaction, *heads, now);
  if (!found.ok()) return found.status();
  if (const absl::Status read = ReadResiduals(transaction, &found->front()); !read.ok()) return read;
  return std::move(found->front());
}

}  // namespace

absl::StatusOr<Recorded> InsertCalibration(Transaction& transaction, const CalibrationRow& c,
                                           const RecordEntry& entry) {
  Params head;
  head.Uuid(c.calibration_id).Text(c.machine_id).Text(c.kind()).Text(c.method).Texts(c.inputs).Digest(c.request_sha256);
  head.Time(c.valid_from).Time(c.valid_until).Text(c.requested_by).Text(c.software_version);
  head.Bool(c.is_draft)
      .OptionalReal(c.environment.temperature_c)
      .OptionalReal(c.environment.temperature_standard_uncertainty_c);
  head.OptionalReal(c.environment.humidity_percent).Text(c.environment.note).OptionalText(c.judgements_json);
  c.axis ? head.Text(c.axis->axis) : head.Null();
  const absl::StatusOr<Rows> inserted = transaction.Execute(kInsertCalibration, head);
  if (!inserted.ok()) return inserted.status();
  const absl::Status result = c.sensor  ? InsertSensor(transaction, c.calibration_id, *c.sensor)
                              : c.probe ? InsertProbe(transaction, c.calibration_id, *c.probe)
                              : c.axis  ? InsertAxis(transaction, c.calibration_id, *c.axis)
                                        : InsertRotation(transaction, c.calibration_id, *c.rotation);
  if (!result.ok()) return result;
  return AppendRecord(transaction, c.calibration_id, entry);
}

absl::StatusOr<std::optional<CalibrationRow>> FindCalibration(Transaction& transaction, const std::string& id) {
  const absl::StatusOr<Instant> now = NowOf(transaction);
  if (!now.ok()) return now.status();
  return FindOne(transaction, kSelectHead, Params().Uuid(id), *now);
}

absl::StatusOr<std::optional<CalibrationRow>> CalibrationInForce(Transaction& transaction,
                                                                 const CalibrationSubject& subject, Instant at) {
  return FindOne(transaction, kSelectCalibrationInForce, KeyOf(subject).Time(at), at);
}

absl::StatusOr<std::optional<CalibrationRow>> WithdrawnCalibration(Transaction& transaction,
                                                                   const CalibrationSubject& subject, Instant at) {
  return FindOne(transaction, kSelectWithdrawn, KeyOf(subject).Time(at), at);
}

absl::StatusOr<std::optional<Instant>> LastValidity(Transaction& transaction, const CalibrationSubject& subject,
                                                    Instant at) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kSelectLastValidity, KeyOf(subject).Time(at));
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return std::nullopt;
  return rows->Checked(rows->Time(0, 0));
}

absl::StatusOr<std::vector<CalibrationRow>> ListCalibrations(Transaction& transaction, const CalibrationFilter& filter,
                                                             std::int64_t before_sequence, int limit) {
  const absl::StatusOr<Instant> now = NowOf(transaction);
  if (!now.ok()) return now.status();
  Params params = KeyOf(filter.subject);
  params.Text(filter.state ? StateText(*filter.state) : "").Time(*now);
  AddSpan(filter.recorded, &params);
  const absl::StatusOr<Rows> heads = transaction.Execute(kSelectCalibrations, params.Int(before_sequence).Int(limit));
  if (!heads.ok()) return heads.status();
  absl::StatusOr<std::vector<CalibrationRow>> found = ReadCalibrations(transaction, *heads, *now);
  if (!found.ok() || !filter.with_residuals) return found;
  for (CalibrationRow& calibration : *found)
    if (absl::Status read = ReadResiduals(transaction, &calibration); !read.ok()) return read;
  return found;
}

absl::StatusOr<std::vector<CalibrationRow>> CalibrationHistory(Transaction& transaction,
                                                               const CalibrationSubject& subject, int limit) {
  const absl::StatusOr<Instant> now = NowOf(transaction);
  if (!now.ok()) return now.status();
  const absl::StatusOr<Rows> heads = transaction.Execute(kSelectHistory, KeyOf(subject).Int(limit));
  return heads.ok() ? ReadCalibrations(transaction, *heads, *now) : heads.status();
}

}  // namespace sixpoint::storage
