#include "tests/services/correction/judged_plant.h"

#include <gtest/gtest.h>

#include "storage/blobs.h"
#include "storage/calibrations.h"
#include "storage/plant_registry.h"
#include "storage/registrations.h"
#include "storage/scans.h"

namespace sixpoint::testing {
namespace {

std::string IdOf(const std::string& name) { return name.substr(name.find('/') + 1); }

storage::RecordEntry Entry(const std::string& kind, const std::string& name) {
  storage::RecordEntry entry;
  entry.kind = kind;
  entry.name = name;
  entry.software_version = "test";
  return entry;
}

}  // namespace

JudgedPlant::JudgedPlant() { StoreRows(); }

void JudgedPlant::Withdraw(const std::string& name) {
  storage::CalibrationRow row;
  row.calibration_id = IdOf(name);
  row.machine_id = "m1";
  auto transaction = database.database()->Begin(Soon());
  ASSERT_TRUE(transaction.ok()) << transaction.status();
  const auto withdrawn =
      storage::WithdrawCalibration(*transaction, row, {"sensor was knocked", "engineer", "test", {}});
  ASSERT_TRUE(withdrawn.ok()) << withdrawn.status();
  ASSERT_TRUE(transaction->Commit().ok());
}

void JudgedPlant::Characterise(bool is_b, const std::vector<double>& forward_error_deg,
                               const std::vector<double>& backward_error_deg, double standard_uncertainty_deg) {
  if (!StandIns::Characterise(is_b, forward_error_deg, backward_error_deg, standard_uncertainty_deg)) return;
  const std::string name = is_b ? kBCharacterisation : kACharacterisation;
  const std::string letter = plant.machine.kinematics().part_side(is_b ? 1 : 0).axis();
  auto transaction = database.database()->Begin(Soon());
  ASSERT_TRUE(transaction.ok()) << transaction.status();
  const auto request = storage::PutBlob(*transaction, "encoder run");
  ASSERT_TRUE(request.ok()) << request.status();
  const auto recorded = storage::AppendRecord(*transaction, Entry("calibration", name));
  ASSERT_TRUE(recorded.ok()) << recorded.status();
  const auto stored = transaction->Execute(
      "INSERT INTO calibrations (calibration_id, machine_id, kind, axis, method, inputs, request_sha256, valid_from, "
      "valid_until, requested_by, software_version, record_sequence, recorded_at) "
      "VALUES ($1, 'm1', 'axis', $2, 'ENCODER_RUN', '{}', $3, '2020-01-01', '2100-01-01', '', 'test', $4, $5)",
      storage::Params()
          .Text(IdOf(name))
          .Text(letter)
          .Text(*request)
          .Int(recorded->sequence)
          .Time(recorded->recorded_at));
  ASSERT_TRUE(stored.ok()) << stored.status();
  ASSERT_TRUE(transaction->Commit().ok());
}

// Only what foreign keys ask for; the values themselves come from the stand-ins.
void JudgedPlant::StoreRows() {
  auto transaction = database.database()->Begin(Soon());
  ASSERT_TRUE(transaction.ok()) << transaction.status();
  storage::MachineRow machine;
  machine.machine_id = "m1";
  machine.content_sha256 = std::string(64, '0');
  machine.sensor_model = "model";
  machine.sensor_noise_um = 2;
  machine.sensor_column_count = 1280;
  machine.sensor_mid_range_mm = 66;
  machine.sensor_range_mm = 25;
  machine.sensor_line_angle_deg = 20;
  machine.nominal_centre_mm = {0, 0, 0};
  machine.safety_translation_mm = 2;
  machine.safety_rotation_deg = 3;
  const auto stored_machine = storage::InsertMachine(*transaction, machine, Entry("machine", ""));
  ASSERT_TRUE(stored_machine.ok()) << stored_machine.status();

  const auto blob = storage::PutBlob(*transaction, plant.surface_bytes);
  ASSERT_TRUE(blob.ok()) << blob.status();
  storage::PartRow part;
  part.part_id = "p1";
  part.content_sha256 = std::string(64, '0');
  part.cad_format = "stl";
  part.cad_unit_mm = 1;
  part.zero_from_part_nominal_rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  part.zero_from_part_nominal_translation_mm = {0, 0, 0};
  part.tessellation = {*blob, "stl", *blob, 12, 0, true, {-15, -15, -10}, {15, 15, 0}};
  const absl::Status tessellation = storage::InsertTessellation(*transaction, part.tessellation, "test");
  ASSERT_TRUE(tessellation.ok()) << tessellation;
  const auto stored_part = storage::InsertPart(*transaction, part, Entry("part", ""));
  ASSERT_TRUE(stored_part.ok()) << stored_part.status();
  const auto stored_blade = storage::InsertBlade(*transaction, {"sn1", "p1", {}}, Entry("blade", ""));
  ASSERT_TRUE(stored_blade.ok()) << stored_blade.status();

  for (const std::string& name : scans) {
    storage::ScanRow scan;
    scan.scan_id = IdOf(name);
    scan.machine_id = "m1";
    scan.machine_revision = 1;
    scan.blade_serial = "sn1";
    scan.kind = "pins";
    scan.profile_pitch_mm = 0.1;
    scan.columns_per_profile = 1280;
    scan.point_count = 1;
    scan.encoding = "draco";
    scan.block_count = 1;
    scan.profile_count = 1;
    scan.stored_encoding = "draco";
    scan.stored_bytes = 1;
    scan.stored_sha256 = scan.sent_sha256 = std::string(64, '0');
    const auto stored = storage::InsertScan(*transaction, scan, {}, Entry("scan", name));
    ASSERT_TRUE(stored.ok()) << stored.status();
  }
  // Their results are the calibration service's own; foreign keys end at the head row.
  for (const auto& [name, kind, method] :
       {std::tuple{kSensorCalibration, "sensor", "JOINT"}, std::tuple{kRotationCalibration, "rotation", "LINES"}}) {
    const auto recorded = storage::AppendRecord(*transaction, Entry("calibration", name));
    ASSERT_TRUE(recorded.ok()) << recorded.status();
    const auto stored = transaction->Execute(
        "INSERT INTO calibrations (calibration_id, machine_id, kind, method, inputs, request_sha256, valid_from, "
        "valid_until, requested_by, software_version, record_sequence, recorded_at) "
        "VALUES ($1, 'm1', $2, $3, '{}', $4, '2020-01-01', '2100-01-01', '', 'test', $5, $6)",
        storage::Params()
            .Text(IdOf(name))
            .Text(kind)
            .Text(method)
            .Text(*blob)
            .Int(recorded->sequence)
            .Time(recorded->recorded_at));
    ASSERT_TRUE(stored.ok()) << stored.status();
  }
  storage::RegistrationRow row;
  row.registration_id = IdOf(kRegistration);
  row.blade_serial = "sn1";
  row.machine_id = "m1";
  row.machine_revision = 1;
  row.part_id = "p1";
  row.part_revision = 1;
  row.method = "SIX_POINT";
  row.sensor_calibration_id = IdOf(kSensorCalibration);
  row.rotation_calibration_id = IdOf(kRotationCalibration);
  row.outcome = "NOT_CONVERGED";  // without values: the stand-in tells them
  row.weakest_direction = std::vector<double>(6, 0.4);
  row.software_version = "test";
  const auto stored = storage::InsertRegistration(*transaction, row, Entry("registration", kRegistration));
  ASSERT_TRUE(stored.ok()) << stored.status();
  ASSERT_TRUE(transaction->Commit().ok());
}

}  // namespace sixpoint::testing
