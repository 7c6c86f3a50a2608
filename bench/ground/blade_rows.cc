#include "bench/ground/blade_rows.h"

#include "bench/ground/transactions.h"
#include "storage/blobs.h"
#include "storage/calibrations.h"
#include "storage/corrections.h"
#include "storage/inspections.h"
#include "storage/registrations.h"
#include "storage/scans.h"
#include "tests/support/registered.h"
#include "tests/support/sample_calibrations.h"

namespace sixpoint::bench {
namespace {

storage::RecordEntry Entry(const std::string& kind, const std::string& name, const std::string& serial,
                           const std::vector<std::string>& inputs) {
  storage::RecordEntry entry;
  entry.kind = kind;
  entry.name = name;
  entry.inputs = inputs;
  if (!serial.empty()) entry.blade = serial;
  entry.machine = "m1";
  entry.method = "best fit";
  entry.software_version = "0.1.0+bench";
  entry.requested_by = "machine 1";
  entry.summary_json = R"({"residual_rms_um": 4.2, "point_count": 381220})";
  entry.request = storage::KeptRequest{"bench.Add", storage::NewUuid(), std::string(64, 'a')};
  return entry;
}

// What the results of a blade have in common.
template <typename Row>
void Fill(const Registry& registry, const std::string& serial, Row* row) {
  row->blade_serial = serial;
  row->machine_id = "m1";
  row->machine_revision = 1;
  row->part_id = "p1";
  row->part_revision = 1;
  row->sensor_calibration_id = registry.sensor_calibration_id;
  row->rotation_calibration_id = registry.rotation_calibration_id;
  row->requested_by = "machine 1";
  row->software_version = "0.1.0+bench";
}

std::string Calibrate(storage::Transaction& transaction, storage::CalibrationRow row) {
  row.calibration_id = storage::NewUuid();
  row.machine_id = "m1";
  row.request_sha256 = Must(storage::PutBlob(transaction, "request"));
  row.valid_from = std::chrono::system_clock::now() - std::chrono::hours(1);
  row.valid_until = row.valid_from + std::chrono::hours(24 * 365);
  row.requested_by = "engineer";
  row.software_version = "0.1.0+bench";
  Must(storage::InsertCalibration(transaction, row, Entry("calibration", row.name(), "", {"machines/m1@1"})));
  return row.calibration_id;
}

storage::RegistrationRow RegistrationOf(const Registry& registry, const std::string& serial,
                                        const std::vector<std::string>& scans, bool six_point) {
  storage::RegistrationRow row;
  Fill(registry, serial, &row);
  row.registration_id = storage::NewUuid();
  row.method = six_point ? "SIX_POINT" : "BEST_FIT";
  row.outcome = "CONVERGED";
  row.zero_from_part = std::vector<double>(12, 0.123456789012345);
  row.reference_mm = {1.25, 2.5, 3.75};
  row.covariance = row.noise_covariance = std::vector<double>(36, 1.23456789e-9);
  row.calibration_sensitivity = std::vector<double>(84, 0.123456789012345);
  row.weakest_direction = std::vector<double>(6, 0.408248290463863);
  row.condition_number = 44;
  row.weakest_standard_uncertainty_um = 1;
  row.point_count = 400000;
  row.points_used = 381220;
  for (const auto& [source, draws] :
       {std::pair("sensor calibration, calibrations/0192f0c4-0000-7000-8000-000000000001", 6),
        std::pair("rotation calibration, calibrations/0192f0c4-0000-7000-8000-000000000002", 8),
        std::pair("touch probe's offset, machines/m1", 3), std::pair("scanner's field, machines/m1", 9),
        std::pair("arm when calibrated, calibrations/0192f0c4-0000-7000-8000-000000000001", 6),
        std::pair("arm when scanned, machines/m1, s1", 6)})
    row.error_sources.push_back({source, 7, draws,
                                 std::vector<double>(static_cast<std::size_t>(23 * draws), 0.123456789012345),
                                 std::vector<double>(static_cast<std::size_t>(6 * draws), 1.23456789e-4)});
  for (const std::string& scan : scans) row.scans.push_back({scan, 100000, 95305, 0.4});
  for (std::size_t i = 1; i < scans.size(); ++i) row.agreements.push_back({scans[0], scans[i], 300, 2.1, 1.9});
  for (int i = 0; six_point && i < 6; ++i) row.datums.push_back({"A" + std::to_string(i), 12.5, 0.4, 900});
  return row;
}

std::vector<double> Budget() {
  return {3.66696, 3.66696, 1.10566, 1.03923, 0.750005, 0.603629, 0.30672, 0.000196, 0.000051};
}
std::vector<std::string> BudgetSources() {
  return {"arm when calibrated, calibrations/0192f0c4-0000-7000-8000-000000000001",
          "arm when scanned, machines/m1, s1",
          "scanner's field, machines/m1",
          "touch probe's offset, machines/m1",
          "rotation calibration, calibrations/0192f0c4-0000-7000-8000-000000000002",
          "noise of the scans",
          "sensor calibration, calibrations/0192f0c4-0000-7000-8000-000000000001",
          "angles of the drilling",
          "angles of the scans"};
}

storage::CorrectionRow CorrectionOf(const Registry& registry, const std::string& serial,
                                    const std::string& registration, const BladeSize& size) {
  storage::CorrectionRow row;
  Fill(registry, serial, &row);
  row.correction_id = storage::NewUuid();
  row.registration_id = registration;
  row.release = "AUTOMATIC";
  row.envelope_translation_mm = 2;
  row.envelope_rotation_deg = 3;
  // A recall asks for blades that were machined long ago.
  row.valid_until = std::chrono::system_clock::now() + std::chrono::seconds(1);
  row.budget_sources = BudgetSources();
  for (int g = 0; g < size.groups; ++g) {
    storage::CorrectionGroupRow& group = row.groups.emplace_back();
    group.group_name = "G" + std::to_string(g);
    group.a_deg = group.a_ideal_deg = 12.345678901234;
    group.b_deg = group.b_ideal_deg = 60.12345678901;
    for (int h = 0; h < size.holes_per_group; ++h)
      group.holes.push_back(
          {"H" + std::to_string(h), {12.3456789, -45.678901, 78.901234}, {12.3, -45.6, 78.9}, 11.25, Budget(), {}});
  }
  return row;
}

storage::InspectionRow InspectionOf(const Registry& registry, const std::string& serial,
                                    const std::string& registration, const std::string& pins, const BladeSize& size) {
  storage::InspectionRow row;
  Fill(registry, serial, &row);
  row.inspection_id = storage::NewUuid();
  row.registration_id = registration;
  row.method = "SIX_POINT";
  row.verdict = "CONFORM";
  row.decision_rule = "ISO 14253-1";
  row.deviation_point_count = 381220;
  row.scan_ids = {pins};
  row.budget_sources = BudgetSources();
  for (int h = 0; h < size.groups * size.holes_per_group; ++h) {
    storage::InspectionHoleRow& hole = row.holes.emplace_back();
    hole.group_name = "G" + std::to_string(h / size.holes_per_group);
    hole.hole_name = "H" + std::to_string(h % size.holes_per_group);
    hole.verdict = hole.position_verdict = hole.inclination_verdict = "CONFORM";
    hole.measured = storage::InspectionHoleRow::Measured{0.0123, 0.123, 8.5, 0.2, {12.3, -45.6, 78.9}, {0, 0, 1}, 0.4};
    hole.position_tolerance_mm = 0.03;
    hole.inclination_tolerance_deg = 1;
    hole.point_count = 1200;
    hole.budget_um = Budget();
  }
  return row;
}

}  // namespace

Registry MakeRegistry(storage::Database* database) {
  testing::RegisterUsual(database);
  storage::Transaction transaction = Begin(database);
  Registry registry;
  registry.sensor_calibration_id = Calibrate(transaction, testing::SampleSensorCalibration());
  registry.rotation_calibration_id = Calibrate(transaction, testing::SampleRotationCalibration());
  Commit(&transaction);
  return registry;
}

void AddScan(storage::Transaction& transaction, const std::string& serial, const std::string& scan_id,
             int block_count) {
  storage::ScanRow scan;
  scan.scan_id = scan_id;
  scan.machine_id = "m1";
  scan.machine_revision = 1;
  scan.blade_serial = serial;
  scan.kind = "airfoil";
  scan.profile_pitch_mm = 0.05;
  scan.columns_per_profile = 1280;
  scan.point_count = 1280 * 30 * block_count;
  scan.encoding = "raw_profiles";
  scan.stored_encoding = "range_image";
  scan.profile_count = 30 * block_count;
  scan.block_count = block_count;
  scan.stored_bytes = 38400L * block_count;
  scan.stored_sha256 = scan.sent_sha256 = storage::Sha256Hex(scan_id);
  std::vector<storage::ScanBlockRow> blocks;
  std::vector<std::string> digests;
  for (int i = 0; i < block_count; ++i) {
    storage::ScanBlockRow& block = blocks.emplace_back();
    block.point_count = 38400;
    block.blob_sha256 = block.sent_sha256 = storage::Sha256Hex(scan_id + "/" + std::to_string(i));
    block.first_profile = 30 * i;
    block.profile_count = 30;
    digests.push_back(block.blob_sha256);
  }
  Must(transaction.Execute(
      "INSERT INTO blobs (sha256, size_bytes, store, object_id) SELECT sha256, 38400, 's3', gen_random_uuid() "
      "FROM unnest($1::bytea[]) AS object (sha256)",
      storage::Params().Digests(digests)));
  Must(storage::InsertScan(transaction, scan, blocks,
                           Entry("scan", "scans/" + scan_id, serial, {"machines/m1@1", "blades/" + serial})));
}

void AddBladeOnly(storage::Database* database, const std::string& serial) {
  storage::Transaction transaction = Begin(database);
  Must(storage::InsertBlade(transaction, {serial, "p1", {}}, Entry("blade", "", serial, {"parts/p1@1"})));
  Commit(&transaction);
}

void AddBlade(storage::Database* database, const Registry& registry, const std::string& serial, const BladeSize& size) {
  AddBladeOnly(database, serial);
  std::vector<std::string> scans,
      inputs = {"machines/m1@1", "parts/p1@1", "calibrations/" + registry.sensor_calibration_id,
                "calibrations/" + registry.rotation_calibration_id};
  for (const char* which : {"-b000", "-b060", "-b120", "-pins"}) {
    storage::Transaction transaction = Begin(database);
    AddScan(transaction, serial, serial + which, size.blocks_per_scan);
    Commit(&transaction);
    scans.push_back(serial + which);
    inputs.push_back("scans/" + serial + which);
  }
  std::string registration_id;
  for (const bool six_point : {false, true}) {
    storage::Transaction transaction = Begin(database);
    const storage::RegistrationRow row = RegistrationOf(registry, serial, scans, six_point);
    Must(storage::InsertRegistration(transaction, row,
                                     Entry("registration", "registrations/" + row.registration_id, serial, inputs)));
    Commit(&transaction);
    registration_id = row.registration_id;
  }
  inputs.push_back("registrations/" + registration_id);
  {
    storage::Transaction transaction = Begin(database);
    const storage::CorrectionRow row = CorrectionOf(registry, serial, registration_id, size);
    Must(storage::InsertCorrection(transaction, row,
                                   Entry("correction", "corrections/" + row.correction_id, serial, inputs)));
    Commit(&transaction);
  }
  storage::Transaction transaction = Begin(database);
  const storage::InspectionRow row = InspectionOf(registry, serial, registration_id, scans.back(), size);
  Must(storage::InsertInspection(transaction, row,
                                 Entry("inspection", "inspections/" + row.inspection_id, serial, inputs)));
  Commit(&transaction);
}

}  // namespace sixpoint::bench
