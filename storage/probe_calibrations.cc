#include "storage/probe_calibrations.h"

namespace sixpoint::storage {
namespace {

#define SIXPOINT_PROBE_COLUMNS                                                                                 \
  "calibration_id, block, approach, offset_mm, covariance, point_standard_uncertainty_mm, scale, "             \
  "scale_standard_uncertainty, direction_standard_uncertainty_urad, noise_um, noise_factor, residual_rms_um, " \
  "touch_rms_um, condition_number, displacement_matrix_condition_number, worst_approach_angle_deg"
constexpr char kInsertProbe[] = "INSERT INTO probe_calibrations (" SIXPOINT_PROBE_COLUMNS
                                ") VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16)";
constexpr char kSelectProbes[] =
    "SELECT " SIXPOINT_PROBE_COLUMNS " FROM probe_calibrations WHERE calibration_id = ANY ($1::uuid[])";
#undef SIXPOINT_PROBE_COLUMNS
constexpr char kInsertReadings[] =
    "INSERT INTO probe_calibration_readings (calibration_id, position_index, face, displacement_mm, residual_um) "
    "SELECT $1::uuid, (position - 1)::integer, face, displacement_mm, residual_um "
    "FROM unnest($2::text[], $3::double precision[], $4::double precision[]) "
    "WITH ORDINALITY AS reading (face, displacement_mm, residual_um, position)";
constexpr char kInsertChecks[] =
    "INSERT INTO probe_calibration_checks (calibration_id, position_index, face, reading_count, angle_urad, "
    "origin_distance_um, distance_um, residual_range_um) "
    "SELECT $1::uuid, (position - 1)::integer, face, reading_count::integer, angle_urad, origin_distance_um, "
    "distance_um, "
    "residual_range_um FROM unnest($2::text[], $3::double precision[], $4::double precision[], $5::double precision[], "
    "$6::double precision[], $7::double precision[]) WITH ORDINALITY AS face_check (face, reading_count, angle_urad, "
    "origin_distance_um, distance_um, residual_range_um, position)";
constexpr char kSelectReadings[] =
    "SELECT face, displacement_mm, residual_um FROM probe_calibration_readings WHERE calibration_id = $1 "
    "ORDER BY position_index";
constexpr char kSelectProbeChecks[] =
    "SELECT face, reading_count, angle_urad, origin_distance_um, distance_um, residual_range_um "
    "FROM probe_calibration_checks WHERE calibration_id = $1 ORDER BY position_index";

ProbeCalibrationRow ReadProbe(const Rows& rows, int row) {
  ProbeCalibrationRow p;
  p.block = rows.Text(row, 1);
  p.approach = rows.Reals(row, 2);
  p.offset_mm = rows.Reals(row, 3);
  p.covariance = rows.Reals(row, 4);
  p.point_standard_uncertainty_mm = rows.Reals(row, 5);
  p.scale = rows.Real(row, 6);
  p.scale_standard_uncertainty = rows.Real(row, 7);
  p.direction_standard_uncertainty_urad = rows.Real(row, 8);
  p.noise_um = rows.Real(row, 9);
  p.noise_factor = rows.Real(row, 10);
  p.residual_rms_um = rows.Real(row, 11);
  p.touch_rms_um = rows.Real(row, 12);
  p.condition_number = rows.Real(row, 13);
  p.displacement_matrix_condition_number = rows.Real(row, 14);
  p.worst_approach_angle_deg = rows.Real(row, 15);
  return p;
}

}  // namespace

absl::Status InsertProbe(Transaction& transaction, const std::string& id, const ProbeCalibrationRow& probe) {
  Params params;
  params.Uuid(id).Text(probe.block).Reals(probe.approach).Reals(probe.offset_mm).Reals(probe.covariance);
  params.Reals(probe.point_standard_uncertainty_mm).Real(probe.scale).Real(probe.scale_standard_uncertainty);
  params.Real(probe.direction_standard_uncertainty_urad).Real(probe.noise_um).Real(probe.noise_factor);
  params.Real(probe.residual_rms_um).Real(probe.touch_rms_um).Real(probe.condition_number);
  params.Real(probe.displacement_matrix_condition_number).Real(probe.worst_approach_angle_deg);
  if (const absl::StatusOr<Rows> inserted = transaction.Execute(kInsertProbe, params); !inserted.ok())
    return inserted.status();
  std::vector<std::string> faces;
  std::vector<double> displacements, residuals;
  for (const ProbeResidualRow& r : probe.readings) {
    faces.push_back(r.face);
    displacements.push_back(r.displacement_mm);
    residuals.push_back(r.residual_um);
  }
  const absl::StatusOr<Rows> readings =
      transaction.Execute(kInsertReadings, Params().Uuid(id).Texts(faces).Reals(displacements).Reals(residuals));
  if (!readings.ok()) return readings.status();
  std::vector<std::string> checked;
  std::vector<double> counts, angles, origin_distances, distances, ranges;
  for (const ProbeFaceCheckRow& c : probe.checks) {
    checked.push_back(c.face);
    counts.push_back(c.reading_count);
    angles.push_back(c.angle_urad);
    origin_distances.push_back(c.origin_distance_um);
    distances.push_back(c.distance_um);
    ranges.push_back(c.residual_range_um);
  }
  Params checks;
  checks.Text(id).Texts(checked).Reals(counts).Reals(angles).Reals(origin_distances).Reals(distances).Reals(ranges);
  return transaction.Execute(kInsertChecks, checks).status();
}

absl::Status ReadProbes(Transaction& transaction, const std::vector<std::string>& calibration_ids,
                        std::vector<CalibrationRow>* calibrations) {
  const absl::StatusOr<Rows> probes = transaction.Execute(kSelectProbes, Params().Uuids(calibration_ids));
  if (!probes.ok()) return probes.status();
  for (CalibrationRow& c : *calibrations)
    for (int row = 0; row < probes->count(); ++row)
      if (probes->Text(row, 0) == c.calibration_id) c.probe = ReadProbe(*probes, row);
  return probes->status();
}

absl::Status ReadProbeResiduals(Transaction& transaction, const std::string& calibration_id,
                                ProbeCalibrationRow* probe) {
  const absl::StatusOr<Rows> readings = transaction.Execute(kSelectReadings, Params().Uuid(calibration_id));
  if (!readings.ok()) return readings.status();
  for (int row = 0; row < readings->count(); ++row)
    probe->readings.push_back({readings->Text(row, 0), readings->Real(row, 1), readings->Real(row, 2)});
  const absl::StatusOr<Rows> checks = transaction.Execute(kSelectProbeChecks, Params().Uuid(calibration_id));
  if (!checks.ok()) return checks.status();
  for (int row = 0; row < checks->count(); ++row)
    probe->checks.push_back({checks->Text(row, 0), static_cast<int>(checks->Int(row, 1)), checks->Real(row, 2),
                             checks->Real(row, 3), checks->Real(row, 4), checks->Real(row, 5)});
  if (absl::Status read = readings->status(); !read.ok()) return read;
  return checks->status();
}

}  // namespace sixpoint::storage
