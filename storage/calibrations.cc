#include "storage/calibrations.h"

namespace sixpoint::storage {
namespace {

#define SIXPOINT_HEAD_COLUMNS                                                                                 \
  "calibration_id, machine_id, kind, method, inputs, request_sha256, valid_from, valid_until, requested_by, " \
  "software_version, record_sequence, recorded_at"
#define SIXPOINT_SENSOR_COLUMNS                                                                               \
  "calibration_id, machine_from_sensor_rotation, t_sm_mm, covariance, alpha_deg, beta_deg, gamma_deg, "       \
  "alpha_standard_uncertainty_deg, beta_standard_uncertainty_deg, gamma_standard_uncertainty_deg, noise_um, " \
  "touch_rms_um, residual_rms_um, condition_number, points_used"
#define SIXPOINT_ROTATION_COLUMNS                                                              \
  "calibration_id, a_direction, a_point_mm, b_direction, b_point_mm, covariance, point_c_mm, " \
  "point_c_standard_uncertainty_mm, noise_um, residual_rms_um, check_rms_um, check_count, condition_number, axes"

constexpr char kInsertHead[] =
    "INSERT INTO calibrations (" SIXPOINT_HEAD_COLUMNS ") VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12)";
constexpr char kInsertSensor[] = "INSERT INTO sensor_calibrations (" SIXPOINT_SENSOR_COLUMNS
                                 ") VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15)";
constexpr char kInsertCentres[] =
    "INSERT INTO sensor_calibration_centres (calibration_id, position_index, scan_id, feature, is_check, dx_um, dy_um, "
    "dz_um) SELECT $1::text, (position - 1)::integer, scan_id, feature, is_check::boolean, dx_um, dy_um, dz_um "
    "FROM unnest($2::text[], $3::text[], $4::text[], $5::double precision[], $6::double precision[], "
    "$7::double precision[]) WITH ORDINALITY AS centre (scan_id, feature, is_check, dx_um, dy_um, dz_um, position)";
constexpr char kInsertRotation[] = "INSERT INTO rotation_calibrations (" SIXPOINT_ROTATION_COLUMNS
                                   ") VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14)";
constexpr char kInsertPoses[] =
    "INSERT INTO rotation_calibration_poses (calibration_id, position_index, a_deg, b_deg, distance_um, held_out, "
    "before_um) SELECT $1::text, (position - 1)::integer, a_deg, b_deg, distance_um, held_out::boolean, before_um "
    "FROM unnest($2::double precision[], $3::double precision[], $4::double precision[], $5::text[], "
    "$6::double precision[]) WITH ORDINALITY AS pose (a_deg, b_deg, distance_um, held_out, before_um, position)";

constexpr char kSelectHead[] = "SELECT " SIXPOINT_HEAD_COLUMNS " FROM calibrations WHERE calibration_id = $1";
constexpr char kSelectInForce[] =
    "SELECT " SIXPOINT_HEAD_COLUMNS
    " FROM calibrations WHERE machine_id = $1 AND kind = $2 AND valid_from <= $3 AND $3 < valid_until "
    "ORDER BY record_sequence DESC LIMIT 1";
constexpr char kSelectLastValidity[] =
    "SELECT valid_until FROM calibrations WHERE machine_id = $1 AND kind = $2 AND valid_from <= $3 "
    "ORDER BY valid_until DESC LIMIT 1";
constexpr char kSelectPage[] = "SELECT " SIXPOINT_HEAD_COLUMNS
                               " FROM calibrations WHERE ($1 = '' OR machine_id = $1) AND ($2 = '' OR kind = $2) "
                               "AND ($3::bigint = 0 OR record_sequence < $3::bigint) "
                               "ORDER BY record_sequence DESC LIMIT $4";
constexpr char kSelectSensors[] =
    "SELECT " SIXPOINT_SENSOR_COLUMNS " FROM sensor_calibrations WHERE calibration_id = ANY ($1::text[])";
constexpr char kSelectRotations[] =
    "SELECT " SIXPOINT_ROTATION_COLUMNS " FROM rotation_calibrations WHERE calibration_id = ANY ($1::text[])";
constexpr char kSelectCentres[] =
    "SELECT scan_id, feature, is_check, dx_um, dy_um, dz_um FROM sensor_calibration_centres WHERE calibration_id = $1 "
    "ORDER BY position_index";
constexpr char kSelectPoses[] =
    "SELECT a_deg, b_deg, distance_um, held_out, before_um FROM rotation_calibration_poses WHERE calibration_id = $1 "
    "ORDER BY position_index";
#undef SIXPOINT_HEAD_COLUMNS
#undef SIXPOINT_SENSOR_COLUMNS
#undef SIXPOINT_ROTATION_COLUMNS

absl::Status InsertSensor(Transaction& transaction, const std::string& id, const SensorCalibrationRow& sensor) {
  Params params;
  params.Text(id).Reals(sensor.machine_from_sensor_rotation).Reals(sensor.t_sm_mm).Reals(sensor.covariance);
  params.Real(sensor.alpha_deg).Real(sensor.beta_deg).Real(sensor.gamma_deg);
  params.Real(sensor.alpha_standard_uncertainty_deg).Real(sensor.beta_standard_uncertainty_deg);
  params.Real(sensor.gamma_standard_uncertainty_deg).Real(sensor.noise_um).Real(sensor.touch_rms_um);
  params.Real(sensor.residual_rms_um).Real(sensor.condition_number).Int(sensor.points_used);
  const absl::StatusOr<Rows> inserted = transaction.Execute(kInsertSensor, params);
  if (!inserted.ok()) return inserted.status();
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
               Params().Text(id).Texts(scans).Texts(features).Texts(checks).Reals(dx).Reals(dy).Reals(dz))
      .status();
}

absl::Status InsertRotation(Transaction& transaction, const std::string& id, const RotationCalibrationRow& rotation) {
  Params params;
  params.Text(id).Reals(rotation.a_direction).Reals(rotation.a_point_mm).Reals(rotation.b_direction);
  params.Reals(rotation.b_point_mm).Reals(rotation.covariance).Reals(rotation.point_c_mm);
  params.Reals(rotation.point_c_standard_uncertainty_mm).Real(rotation.noise_um).Real(rotation.residual_rms_um);
  params.Real(rotation.check_rms_um).Int(rotation.check_count).Real(rotation.condition_number).Texts(rotation.axes);
  const absl::StatusOr<Rows> inserted = transaction.Execute(kInsertRotation, params);
  if (!inserted.ok()) return inserted.status();
  std::vector<double> a, b, distances, before;
  std::vector<std::string> held_out;
  for (const PoseResidualRow& p : rotation.poses) {
    a.push_back(p.a_deg);
    b.push_back(p.b_deg);
    distances.push_back(p.distance_um);
    held_out.push_back(p.held_out ? "true" : "false");
    before.push_back(p.before_um.value_or(0));
  }
  return transaction
      .Execute(kInsertPoses, Params().Text(id).Reals(a).Reals(b).Reals(distances).Texts(held_out).Reals(before))
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
  s.noise_um = rows.Real(row, 10);
  s.touch_rms_um = rows.Real(row, 11);
  s.residual_rms_um = rows.Real(row, 12);
  s.condition_number = rows.Real(row, 13);
  s.points_used = rows.Int(row, 14);
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
  return r;
}

// The heads with the results of their kinds: three statements for any number of rows.
absl::StatusOr<std::vector<CalibrationRow>> ReadCalibrations(Transaction& transaction, const Rows& heads) {
  std::vector<CalibrationRow> found;
  std::vector<std::string> sensor_ids, rotation_ids;
  for (int row = 0; row < heads.count(); ++row) {
    CalibrationRow& c = found.emplace_back();
    c.calibration_id = heads.Text(row, 0);
    c.machine_id = heads.Text(row, 1);
    (heads.Text(row, 2) == "sensor" ? sensor_ids : rotation_ids).push_back(c.calibration_id);
    c.method = heads.Text(row, 3);
    c.inputs = heads.Texts(row, 4);
    c.request_sha256 = heads.Text(row, 5);
    c.valid_from = heads.Time(row, 6);
    c.valid_until = heads.Time(row, 7);
    c.requested_by = heads.Text(row, 8);
    c.software_version = heads.Text(row, 9);
    c.recorded = {heads.Int(row, 10), heads.Time(row, 11)};
  }
  const absl::StatusOr<Rows> sensors = transaction.Execute(kSelectSensors, Params().Texts(sensor_ids));
  if (!sensors.ok()) return sensors.status();
  const absl::StatusOr<Rows> rotations = transaction.Execute(kSelectRotations, Params().Texts(rotation_ids));
  if (!rotations.ok()) return rotations.status();
  for (CalibrationRow& c : found) {
    for (int row = 0; row < sensors->count(); ++row)
      if (sensors->Text(row, 0) == c.calibration_id) c.sensor = ReadSensor(*sensors, row);
    for (int row = 0; row < rotations->count(); ++row)
      if (rotations->Text(row, 0) == c.calibration_id) c.rotation = ReadRotation(*rotations, row);
    if (!c.sensor && !c.rotation)
      return absl::DataLossError("calibration " + c.calibration_id + ": its result is gone");
  }
  return found;
}

absl::Status ReadResiduals(Transaction& transaction, CalibrationRow* calibration) {
  const absl::StatusOr<Rows> rows = transaction.Execute(calibration->sensor ? kSelectCentres : kSelectPoses,
                                                        Params().Text(calibration->calibration_id));
  if (!rows.ok()) return rows.status();
  for (int row = 0; row < rows->count(); ++row) {
    if (calibration->sensor)
      calibration->sensor->centres.push_back({rows->Text(row, 0), rows->Text(row, 1), rows->Bool(row, 2),
                                              rows->Real(row, 3), rows->Real(row, 4), rows->Real(row, 5)});
    else
      calibration->rotation->poses.push_back(
          {rows->Real(row, 0), rows->Real(row, 1), rows->Real(row, 2), rows->Bool(row, 3),
           rows->IsNull(row, 4) ? std::nullopt : std::optional<double>(rows->Real(row, 4))});
  }
  return absl::OkStatus();
}

absl::StatusOr<std::optional<CalibrationRow>> FindOne(Transaction& transaction, const char* sql, const Params& key) {
  const absl::StatusOr<Rows> heads = transaction.Execute(sql, key);
  if (!heads.ok()) return heads.status();
  if (heads->count() == 0) return std::nullopt;
  absl::StatusOr<std::vector<CalibrationRow>> found = ReadCalibrations(transaction, *heads);
  if (!found.ok()) return found.status();
  if (const absl::Status read = ReadResiduals(transaction, &found->front()); !read.ok()) return read;
  return std::move(found->front());
}

}  // namespace

absl::StatusOr<Recorded> InsertCalibration(Transaction& transaction, const CalibrationRow& c,
                                           const std::string& summary_json) {
  RecordEntry entry;
  entry.kind = "calibration";
  entry.name = "calibrations/" + c.calibration_id;
  entry.inputs = c.inputs;
  entry.machine = c.machine_id;
  entry.method = c.method;
  entry.software_version = c.software_version;
  entry.requested_by = c.requested_by;
  entry.summary_json = summary_json;
  const absl::StatusOr<Recorded> recorded = AppendRecord(transaction, entry);
  if (!recorded.ok()) return recorded.status();
  Params head;
  head.Text(c.calibration_id).Text(c.machine_id).Text(c.kind()).Text(c.method).Texts(c.inputs).Text(c.request_sha256);
  head.Time(c.valid_from).Time(c.valid_until).Text(c.requested_by).Text(c.software_version);
  head.Int(recorded->sequence).Time(recorded->recorded_at);
  const absl::StatusOr<Rows> inserted = transaction.Execute(kInsertHead, head);
  if (!inserted.ok()) return inserted.status();
  const absl::Status result = c.sensor ? InsertSensor(transaction, c.calibration_id, *c.sensor)
                                       : InsertRotation(transaction, c.calibration_id, *c.rotation);
  if (!result.ok()) return result;
  return recorded;
}

absl::StatusOr<std::optional<CalibrationRow>> FindCalibration(Transaction& transaction, const std::string& id) {
  return FindOne(transaction, kSelectHead, Params().Text(id));
}

absl::StatusOr<std::optional<CalibrationRow>> CalibrationInForce(Transaction& transaction,
                                                                 const std::string& machine_id, const std::string& kind,
                                                                 Instant at) {
  return FindOne(transaction, kSelectInForce, Params().Text(machine_id).Text(kind).Time(at));
}

absl::StatusOr<std::optional<Instant>> LastValidity(Transaction& transaction, const std::string& machine_id,
                                                    const std::string& kind, Instant at) {
  const absl::StatusOr<Rows> rows =
      transaction.Execute(kSelectLastValidity, Params().Text(machine_id).Text(kind).Time(at));
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return std::nullopt;
  return rows->Time(0, 0);
}

absl::StatusOr<std::vector<CalibrationRow>> ListCalibrations(Transaction& transaction, const std::string& machine_id,
                                                             const std::string& kind, std::int64_t before_sequence,
                                                             int limit) {
  const absl::StatusOr<Rows> heads =
      transaction.Execute(kSelectPage, Params().Text(machine_id).Text(kind).Int(before_sequence).Int(limit));
  if (!heads.ok()) return heads.status();
  return ReadCalibrations(transaction, *heads);
}

}  // namespace sixpoint::storage
