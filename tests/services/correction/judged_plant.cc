#include "tests/services/correction/judged_plant.h"

#include <gtest/gtest.h>

#include <utility>

#include "storage/blobs.h"
#include "storage/calibrations.h"
#include "storage/plant_registry.h"
#include "storage/registrations.h"
#include "storage/scans.h"
#include "tests/support/registered.h"

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

// Its result is the calibration service's own; foreign keys end at the head row.
void StoreCalibration(storage::Transaction& transaction, const std::string& name, const std::string& kind,
                      const std::string& axis, const std::string& method, const std::string& request_sha256) {
  storage::Params params;
  params.Uuid(IdOf(name)).Text(kind);
  axis.empty() ? params.Null() : params.Text(axis);
  const auto stored = transaction.Execute(
      "INSERT INTO calibrations (calibration_id, machine_id, kind, axis, method, inputs, request_sha256, valid_from, "
      "valid_until, requested_by, software_version) "
      "VALUES ($1, 'm1', $2, $3, $4, '{}', $5, '2020-01-01', '2100-01-01', '', 'test')",
      params.Text(method).Digest(request_sha256));
  ASSERT_TRUE(stored.ok()) << stored.status();
  const auto recorded = storage::AppendRecord(transaction, IdOf(name), Entry("calibration", name));
  ASSERT_TRUE(recorded.ok()) << recorded.status();
}

}  // namespace

JudgedPlant::JudgedPlant() { StoreRows(); }

void JudgedPlant::StudyArm(calibration::v1::Study study) {
  study.set_name(kArmStudy);
  auto transaction = database.database()->Begin(Soon());
  ASSERT_TRUE(transaction.ok()) << transaction.status();
  const auto recorded = storage::AppendRecord(*transaction, IdOf(kArmStudy), Entry("study", kArmStudy));
  ASSERT_TRUE(recorded.ok()) << recorded.status();
  ASSERT_TRUE(transaction->Commit().ok());
  studies.arm = std::move(study);
}

void JudgedPlant::Remount(calibration::v1::Calibration anew, std::int64_t from_s) {
  auto transaction = database.database()->Begin(Soon());
  ASSERT_TRUE(transaction.ok()) << transaction.status();
  const auto request = storage::PutBlob(*transaction, "mounted anew");
  ASSERT_TRUE(request.ok()) << request.status();
  StoreCalibration(*transaction, anew.name(), "sensor", "", "JOINT", *request);
  ASSERT_TRUE(transaction->Commit().ok());
  calibration.remounted = std::move(anew);
  calibration.remounted_s = from_s;
}

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
  StoreCalibration(*transaction, name, "axis", letter, "ENCODER_RUN", *request);
  ASSERT_TRUE(transaction->Commit().ok());
}

// Only what foreign keys ask for; the values themselves come from the stand-ins.
void JudgedPlant::StoreRows() {
  auto transaction = database.database()->Begin(Soon());
  ASSERT_TRUE(transaction.ok()) << transaction.status();
  // The stand-ins' ids are of the first month there is.
  const auto month = transaction->Execute(
      "SELECT make_partition(held_by, name, by_uuid, '1970-01-01') FROM partitioned_tables ORDER BY depth, name");
  ASSERT_TRUE(month.ok()) << month.status();
  RegisterMachine(*transaction, "m1");
  const auto blob = storage::PutBlob(*transaction, plant.surface_bytes);
  ASSERT_TRUE(blob.ok()) << blob.status();
  const storage::TessellationRow tessellation{*blob, "stl", *blob, 12, 0, true, {-15, -15, -10}, {15, 15, 0}};
  const absl::Status kept = storage::InsertTessellation(*transaction, tessellation, "test");
  ASSERT_TRUE(kept.ok()) << kept;
  const auto stored_part = storage::InsertPart(*transaction, PartOf("p1", tessellation), Entry("part", ""));
  ASSERT_TRUE(stored_part.ok()) << stored_part.status();
  RegisterBlade(*transaction, "sn1", "p1");

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
  StoreCalibration(*transaction, kSensorCalibration, "sensor", "", "JOINT", *blob);
  StoreCalibration(*transaction, kRotationCalibration, "rotation", "", "LINES", *blob);
  ASSERT_TRUE(transaction->Commit().ok());
  StoreRegistration(kRegistration);
}

void JudgedPlant::StoreModel(const std::vector<storage::MachiningOperationRow>& operations) {
  storage::MachiningModelRow row;
  row.machining_model_id = "edm";
  row.content_sha256 = std::string(64, 'a');
  row.part_id = "p1";
  row.part_revision = 1;
  row.operations = operations;
  row.nc_template = "M30\n";
  storage::RecordEntry entry;
  entry.software_version = "test";
  entry.inputs = {"parts/p1@1"};
  auto transaction = database.database()->Begin(Soon());
  ASSERT_TRUE(transaction.ok()) << transaction.status();
  const auto kept = storage::InsertMachiningModel(*transaction, row, entry);
  ASSERT_TRUE(kept.ok()) << kept.status();
  ASSERT_TRUE(transaction->Commit().ok());
}

void JudgedPlant::StoreRegistration(const std::string& name) {
  storage::RegistrationRow row;
  row.registration_id = IdOf(name);
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
  row.condition_number = 44;
  row.weakest_standard_uncertainty_um = 1;
  row.software_version = "test";
  auto transaction = database.database()->Begin(Soon());
  ASSERT_TRUE(transaction.ok()) << transaction.status();
  const auto stored = storage::InsertRegistration(*transaction, row, Entry("registration", name));
  ASSERT_TRUE(stored.ok()) << stored.status();
  ASSERT_TRUE(transaction->Commit().ok());
}

}  // namespace sixpoint::testing
