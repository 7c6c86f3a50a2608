#include "seed/registry.h"

#include <cmath>

#include "seed/diagonal.h"
#include "storage/blobs.h"
#include "storage/plant_registry.h"

namespace sixpoint::seed {
namespace {

using storage::Database;
using storage::Transaction;

constexpr std::chrono::seconds kRegistryPatience{60};
constexpr double kDegPerRad = 57.29577951308232;
// A calibration holds for a month and ten days; the last one of a machine that was not calibrated lately ended two days ago.
constexpr std::chrono::hours kValidity{40 * 24}, kOver{2 * 24};
constexpr char kScanBytes[] = "seeded: a scan without points\n";

storage::MachineRow MachineOf(const Machine& planned) {
  storage::MachineRow machine;
  machine.machine_id = planned.id;
  machine.content_sha256 = storage::Sha256Hex("seeded machine " + planned.id);
  machine.joints = {{"part", "A", "rotary", {0, 1, 0}, std::vector<double>{0, 0, 0}, 1, -120, 120},
                    {"part", "B", "rotary", {1, 0, 0}, std::vector<double>{0, 0, 0}, 1, -360, 360},
                    {"tool", "X", "linear", {1, 0, 0}, std::nullopt, 1, -300, 300},
                    {"tool", "Y", "linear", {0, 1, 0}, std::nullopt, 1, -300, 300},
                    {"tool", "Z", "linear", {0, 0, 1}, std::nullopt, 1, -300, 300}};
  machine.sensor_model = "seeded line scanner";
  machine.sensor_serial_number = planned.id + "-S";
  machine.sensor_kind = "LINE";
  machine.sensor_noise_um = 2;
  machine.sensor_column_count = 1280;
  machine.sensor_mid_range_mm = 66;
  machine.sensor_range_mm = 25;
  machine.sensor_line_angle_deg = 20;
  machine.nominal_centre_mm = {0, 0, 0};
  machine.safety_translation_mm = 2;
  machine.safety_rotation_deg = 3;
  machine.safety_uncertainty_share = 1.0 / 3;
  machine.safety_registration_age_h = 8;
  machine.safety_keep_out_mm = 0.5;
  machine.touch_probe_serial_number = planned.id + "-T";
  return machine;
}

storage::ArtefactRow ArtefactOf(const std::string& id) {
  storage::ArtefactRow artefact;
  artefact.artefact_id = id;
  artefact.content_sha256 = storage::Sha256Hex("seeded artefact " + id);
  artefact.side_mm = 80;
  artefact.cone_half_angle_deg = 30;
  artefact.cone_top_radius_mm = 5;
  artefact.cone_bottom_radius_mm = 1;
  artefact.slot_width_mm = 4;
  artefact.slot_depth_mm = 2;
  artefact.features = {{"cone", "C1", -20, -20}, {"cone", "C2", 20, -20}, {"cone", "C3", 0, 20}, {"slot", "S1", 0, 0}};
  return artefact;
}

storage::PartRow PartOf(const Plan& plan, int part, const storage::TessellationRow& tessellation) {
  storage::PartRow row;
  row.part_id = plan.PartId(part);
  row.content_sha256 = storage::Sha256Hex("seeded part " + row.part_id);
  row.cad_format = "stl";
  row.cad_unit_mm = 1;
  row.zero_from_part_nominal_rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  row.zero_from_part_nominal_translation_mm = {0, 0, 0};
  row.tessellation = tessellation;
  for (const Hole& hole : plan.HolesOf(part)) {
    if (row.hole_groups.empty() || row.hole_groups.back().group != hole.group) {
      storage::HoleGroupRow& group = row.hole_groups.emplace_back();
      group.group = hole.group;
      group.diameter_mm = 0.5;
      group.depth_mm = 3;
      group.a_nominal_deg = 0;
      group.b_nominal_deg = 60;
      group.axis_in_part = {0, 0, 1};
      group.position_tolerance_mm = 0.03;
      group.inclination_tolerance_deg = 1;
      group.position_zone = "RADIUS";
    }
    row.hole_groups.back().holes.push_back({hole.name, {hole.start_x_mm, hole.start_y_mm, 0}, {0, 0, 1}});
  }
  return row;
}

storage::CalibrationRow Common(const Plan& plan, const Machine& machine, int month, const std::string& request_sha256) {
  storage::CalibrationRow row;
  row.calibration_id = storage::NewUuid();
  row.machine_id = machine.id;
  row.inputs = {"machines/" + machine.id + "@1"};
  row.request_sha256 = request_sha256;
  row.valid_from = plan.MonthBegins(month);
  row.valid_until = row.valid_from + kValidity;
  if (machine.is_expired && row.valid_until > plan.MonthBegins(plan.options().month_count))
    row.valid_until = plan.MonthBegins(plan.options().month_count) - kOver;
  row.requested_by = kSeeder;
  row.software_version = kSoftwareVersion;
  row.environment.temperature_c = 20.5;
  return row;
}

storage::CalibrationRow SensorOf(const Plan& plan, int machine, int month, storage::CalibrationRow row) {
  row.method = "JOINT";
  row.inputs.push_back("artefacts/" + plan.ArtefactId() + "@1");
  storage::SensorCalibrationRow& sensor = row.sensor.emplace();
  sensor.machine_from_sensor_rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  sensor.t_sm_mm = {10 + 1e-3 * plan.DriftedBy(machine, plan.MonthBegins(month)), -20, 150};
  sensor.covariance = Diagonal(6, 1e-10, 3, 4e-6);
  sensor.alpha_standard_uncertainty_deg = sensor.beta_standard_uncertainty_deg = sensor.gamma_standard_uncertainty_deg =
      1e-5 * kDegPerRad;
  sensor.noise_um = 2.1;
  sensor.touch_rms_um = 1.4;
  sensor.residual_rms_um = 2.6;
  sensor.condition_number = 210;
  sensor.points_used = 180000;
  sensor.sensor_serial_number = row.machine_id + "-S";
  return row;
}

storage::CalibrationRow RotationOf(storage::CalibrationRow row) {
  row.method = "LINES";
  storage::RotationCalibrationRow& rotation = row.rotation.emplace();
  rotation.a_direction = {0, 1, 0};
  rotation.b_direction = {1, 0, 0};
  rotation.a_point_mm = rotation.b_point_mm = rotation.point_c_mm = {0.012, 0, -0.021};
  rotation.point_c_standard_uncertainty_mm = {0.002, 0.002, 0.002};
  rotation.covariance = Diagonal(8, 4e-6, 0, 4e-6);
  rotation.noise_um = 1;
  rotation.residual_rms_um = 1.8;
  rotation.check_rms_um = 2.2;
  rotation.check_count = 4;
  rotation.condition_number = 90;
  rotation.poses = {{0, 0, 1.2, false, 14.0}, {30, 60, 1.9, false, 22.0}, {-30, 120, 2.4, true, 25.0}};
  return row;
}

storage::CalibrationRow AxisOf(const std::string& letter, storage::CalibrationRow row) {
  row.method = "ENCODER_RUN";
  storage::AxisCharacterisationRow& axis = row.axis.emplace();
  axis.axis = letter;
  axis.reading_count = 288;
  axis.beyond_limits_count = 0;
  axis.reversal = {0.0008, 0.0001};
  axis.mean = {0, 0.0001};
  axis.long_wave_order = 1;
  axis.long_wave_amplitude = {0.002, 0.0001};
  axis.least_detectable_deg = 0.0003;
  axis.greatest_error = {0.0024, 0.0001};
  axis.greatest_error_at_deg = 90;
  axis.standard_uncertainty = {0.0015, 0.0001};
  axis.compensated_standard_uncertainty = {0.0003, 0.0001};
  axis.noise = {0.0002, 0.00005};
  axis.table_standard_uncertainty_deg = 0.0002;
  for (int i = 0; i < 12; ++i) {
    axis.forward_error_deg.push_back(0.002 * std::sin(30 * i / kDegPerRad));
    axis.backward_error_deg.push_back(axis.forward_error_deg.back() - 0.0008);
  }
  return row;
}

absl::Status Calibrate(Transaction& transaction, const storage::CalibrationRow& row, std::string* id) {
  storage::RecordEntry entry = EntryOf("calibration", row.name(), row.requested_by);
  entry.inputs = row.inputs;
  entry.machine = row.machine_id;
  entry.method = row.method;
  entry.measured_at = row.valid_from;
  *id = row.calibration_id;
  return storage::InsertCalibration(transaction, row, entry).status();
}

// Of one month: both that a registration rests on, and, twice a year, how the axes position.
absl::Status CalibrateMonth(Transaction& transaction, const Plan& plan, int machine, int month,
                            const std::string& request_sha256, Registry* registry) {
  const Machine& planned = plan.machines()[static_cast<std::size_t>(machine)];
  std::vector<Calibrations>& months = registry->by_machine[static_cast<std::size_t>(machine)];
  Calibrations made = months.empty() ? Calibrations() : months.back();
  const auto common = [&] { return Common(plan, planned, month, request_sha256); };
  absl::Status status = Calibrate(transaction, SensorOf(plan, machine, month, common()), &made.sensor_id);
  if (status.ok()) status = Calibrate(transaction, RotationOf(common()), &made.rotation_id);
  if (status.ok() && month % 6 == 0) {
    storage::CalibrationRow row = common();
    row.valid_until = row.valid_from + std::chrono::hours(200 * 24);
    status = Calibrate(transaction, AxisOf("A", row), &made.axis_a_id);
    row.calibration_id = storage::NewUuid();
    if (status.ok()) status = Calibrate(transaction, AxisOf("B", row), &made.axis_b_id);
  }
  months.push_back(made);
  return status;
}

absl::Status WriteParts(Transaction& transaction, const Plan& plan) {
  for (int part = 0; part < kPartCount; ++part) {
    const auto surface = storage::PutBlob(transaction, "seeded: the surface of " + plan.PartId(part) + "\n");
    if (!surface.ok()) return surface.status();
    const storage::TessellationRow tessellation{*surface, "seeded", *surface,        12,
                                                0,        true,     {-15, -20, -10}, {25, 20, 0}};
    absl::Status status = storage::InsertTessellation(transaction, tessellation, kSoftwareVersion);
    if (status.ok())
      status =
          storage::InsertPart(transaction, PartOf(plan, part, tessellation), EntryOf("part", "", kSeeder)).status();
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

}  // namespace

storage::RecordEntry EntryOf(const std::string& kind, const std::string& name, const std::string& requested_by) {
  storage::RecordEntry entry;
  entry.kind = kind;
  entry.name = name;
  entry.software_version = kSoftwareVersion;
  entry.requested_by = requested_by;
  return entry;
}

absl::StatusOr<Registry> WriteRegistry(Database* database, const Plan& plan) {
  Registry registry;
  absl::StatusOr<Transaction> transaction = database->Begin(std::chrono::steady_clock::now() + kRegistryPatience);
  if (!transaction.ok()) return transaction.status();
  absl::StatusOr<std::string> blob = storage::PutBlob(*transaction, kScanBytes);
  if (!blob.ok()) return blob.status();
  registry.scan_blob_sha256 = *blob;
  registry.scan_blob_bytes = sizeof kScanBytes - 1;
  for (const Machine& machine : plan.machines())
    if (auto made = storage::InsertMachine(*transaction, MachineOf(machine), EntryOf("machine", "", kSeeder));
        !made.ok())
      return made.status();
  if (auto made =
          storage::InsertArtefact(*transaction, ArtefactOf(plan.ArtefactId()), EntryOf("artefact", "", kSeeder));
      !made.ok())
    return made.status();
  if (absl::Status status = WriteParts(*transaction, plan); !status.ok()) return status;
  const absl::StatusOr<std::string> request =
      storage::PutBlob(*transaction, "seeded: a calibration without a request\n");
  if (!request.ok()) return request.status();
  registry.by_machine.resize(plan.machines().size());
  for (int month = 0; month < plan.options().month_count; ++month)
    for (int machine = 0; machine < plan.options().machine_count; ++machine)
      if (absl::Status status = CalibrateMonth(*transaction, plan, machine, month, *request, &registry); !status.ok())
        return status;
  if (absl::Status status = transaction->Commit(); !status.ok()) return status;
  return registry;
}

}  // namespace sixpoint::seed
