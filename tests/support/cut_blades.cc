#include "tests/support/cut_blades.h"

#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "metrology/kinematics/rotary_axes.h"
#include "storage/blobs.h"
#include "storage/calibrations.h"
#include "storage/correction_events.h"
#include "storage/corrections.h"
#include "storage/inspections.h"
#include "storage/registrations.h"
#include "storage/scans.h"
#include "tests/support/registered.h"
#include "tests/support/rows_of_m1.h"
#include "tests/support/sample_calibrations.h"

namespace sixpoint::testing {
namespace {

constexpr double kRad = 3.14159265358979323846 / 180;
constexpr double kAngles[2][2] = {{0, 55}, {20, -30}};  // A, B of G1 and G2

std::vector<double> ListOf(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
std::array<double, 3> ThreeOf(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

// The part stands as its CAD does.
Eigen::Matrix3d PartFromMachine(int group) {
  const metrology::RotaryAxes axes;
  return axes.MachineFromZero(kAngles[group][0] * kRad, kAngles[group][1] * kRad).linear().transpose();
}
Eigen::Vector3d AxisOf(int group) { return PartFromMachine(group) * Eigen::Vector3d::UnitZ(); }
Eigen::Vector3d StartOf(int group, int hole) { return {10.0 * hole, 5.0 * group, 20}; }
std::string GroupName(int group) { return "G" + std::to_string(group + 1); }
std::string HoleName(int hole) { return "H" + std::to_string(hole + 1); }

std::string PutRegistration(storage::Transaction& t, const std::string& serial,
                            const MachinesCalibrations& calibrations) {
  auto row = ResultOf<storage::RegistrationRow>("p1", serial, calibrations);
  row.registration_id = storage::NewUuid();
  row.method = "SIX_POINT";
  row.outcome = "CONVERGED";
  row.zero_from_part = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  row.reference_mm = {0, 0, 0};
  row.covariance = row.noise_covariance = std::vector<double>(36, 0);
  row.calibration_sensitivity = std::vector<double>(84, 0);
  row.weakest_direction = std::vector<double>(6, 0.4);
  const std::string name = "registrations/" + row.registration_id;
  Must(storage::InsertRegistration(
      t, row, EntryOfM1(name, {"blades/" + serial, calibrations.sensor, calibrations.rotation}, serial)));
  return row.registration_id;
}

storage::CorrectionRow CorrectionOf(const CutBlade& blade, const MachinesCalibrations& calibrations) {
  auto row = ResultOf<storage::CorrectionRow>("p1", blade.serial, calibrations);
  row.correction_id = storage::NewUuid();
  row.release = blade.let_go ? "AUTOMATIC" : "AWAITING_PERSON";
  if (!blade.let_go) row.release_reasons = {"of the test"};
  row.envelope_translation_mm = 2;
  row.envelope_rotation_deg = 3;
  row.valid_until = storage::Instant(std::chrono::seconds(4'000'000'000));
  for (int g = 0; g < 2; ++g) {
    storage::CorrectionGroupRow& group = row.groups.emplace_back();
    group.group_name = GroupName(g);
    group.a_deg = kAngles[g][0];
    group.b_deg = kAngles[g][1];
    for (int h = 0; h < 2; ++h) group.holes.emplace_back().hole_name = HoleName(h);
  }
  return row;
}

std::string PutScan(storage::Transaction& t, const std::string& serial, int number) {
  storage::ScanRow scan;
  scan.scan_id = "pins-" + std::to_string(number);
  scan.machine_id = "m1";
  scan.machine_revision = 1;
  scan.blade_serial = serial;
  scan.kind = "pins";
  scan.profile_pitch_mm = 0.1;
  scan.columns_per_profile = 1280;
  scan.point_count = scan.block_count = scan.profile_count = scan.stored_bytes = 1;
  scan.encoding = scan.stored_encoding = "draco";
  scan.stored_sha256 = scan.sent_sha256 = std::string(64, '0');
  Must(storage::InsertScan(t, scan, {},
                           EntryOfM1("scans/" + scan.scan_id, {"machines/m1@1", "blades/" + serial}, serial)));
  return scan.scan_id;
}

storage::InspectionHoleRow HoleOf(int g, int h, const CutBlade& blade) {
  storage::InspectionHoleRow hole;
  hole.group_name = GroupName(g);
  hole.hole_name = HoleName(h);
  hole.verdict = hole.position_verdict = hole.inclination_verdict = blade.measured ? "CONFORM" : "NOT_MEASURED";
  if (!blade.measured) hole.reason = "no pin";
  if (blade.measured)
    hole.measured = storage::InspectionHoleRow::Measured{
        blade.off_mm.norm(), 0,  10, 0.1, ThreeOf(StartOf(g, h) + PartFromMachine(g) * blade.off_mm),
        ThreeOf(AxisOf(g)),  0.4};
  hole.position_tolerance_mm = 0.1;
  hole.inclination_tolerance_deg = 1;
  if (blade.measured) hole.budget_um = {4, 3};
  return hole;
}

std::string PutInspection(storage::Transaction& t, const CutBlade& blade, const MachinesCalibrations& calibrations,
                          int number) {
  auto row = ResultOf<storage::InspectionRow>("p1", blade.serial, calibrations);
  row.inspection_id = storage::NewUuid();
  row.registration_id = PutRegistration(t, blade.serial, calibrations);
  row.method = "SIX_POINT";
  row.verdict = blade.measured ? "CONFORM" : "NOT_MEASURED";
  row.decision_rule = "rule";
  row.deviation_point_count = 1;
  row.positioning_disagrees = blade.positioning_open;
  row.scan_ids = {PutScan(t, blade.serial, number)};
  row.budget_sources = {"points of the pin", "sensor calibration"};
  for (int g = 0; g < 2; ++g)
    for (int h = 0; h < 2; ++h) row.holes.push_back(HoleOf(g, h, blade));
  Must(storage::InsertInspection(
      t, row,
      EntryOfM1("inspections/" + row.inspection_id,
                {"registrations/" + row.registration_id, "scans/" + row.scan_ids[0]}, blade.serial)));
  return row.inspection_id;
}

void PutPart(storage::Transaction& t) {
  const std::string surface = Must(storage::PutBlob(t, "surface of p1"));
  const storage::TessellationRow tessellation{surface, "stl", surface, 12, 0, true, {-15, -15, -10}, {15, 15, 0}};
  Must(storage::InsertTessellation(t, tessellation, "test"));
  storage::PartRow part = PartOf("p1", tessellation);
  for (int g = 0; g < 2; ++g) {
    storage::HoleGroupRow& group = part.hole_groups.emplace_back();
    group.group = GroupName(g);
    group.diameter_mm = 0.4;
    group.depth_mm = 5;
    group.a_nominal_deg = kAngles[g][0];
    group.b_nominal_deg = kAngles[g][1];
    group.axis_in_part = ListOf(AxisOf(g));
    group.position_tolerance_mm = 0.1;
    group.inclination_tolerance_deg = 1;
    group.position_zone = "RADIUS";
    for (int h = 0; h < 2; ++h) group.holes.push_back({HoleName(h), ListOf(StartOf(g, h)), ListOf(AxisOf(g))});
  }
  storage::RecordEntry entry = EntryOfM1("parts/", {}, "");
  entry.machine.reset();
  Must(storage::InsertPart(t, part, entry));
}

}  // namespace

CutBlades::CutBlades() {
  calibrations_ = PutCalibratedMachine(database.database());
  storage::Transaction t = Must(database.database()->Begin(Soon(60)));
  PutPart(t);
  Must(t.Commit());
}

CutBlades::Names CutBlades::Cut(const CutBlade& blade) {
  Names names;
  storage::Transaction t = Must(database.database()->Begin(Soon(60)));
  RegisterBlade(t, blade.serial, "p1");
  storage::CorrectionRow correction = CorrectionOf(blade, calibrations_);
  correction.registration_id = PutRegistration(t, blade.serial, calibrations_);
  names.correction = correction.correction_id;
  Must(storage::InsertCorrection(
      t, correction,
      EntryOfM1("corrections/" + names.correction, {"registrations/" + correction.registration_id}, blade.serial)));
  if (blade.inspected) names.inspection = PutInspection(t, blade, calibrations_, ++scan_count_);
  Must(t.Commit());
  if (!blade.reported) return names;
  storage::CutReport report;
  report.correction_id = names.correction;
  report.requested_by = "machines/m1";
  report.software_version = "test";
  report.check = [](const std::optional<storage::CorrectionRow>&) { return absl::OkStatus(); };
  for (int g = 0; g < 2; ++g)
    for (int h = 0; h < 2; ++h) report.holes.push_back({GroupName(g), HoleName(h)});
  Must(storage::CorrectionEventsIn(database.database())
           ->ReportCut({"area.Cut", storage::NewUuid(), "cut of " + blade.serial}, report, Soon(60)));
  return names;
}

std::string CutBlades::InspectAnew(const CutBlade& blade) {
  storage::Transaction t = Must(database.database()->Begin(Soon(60)));
  std::string inspection = PutInspection(t, blade, calibrations_, ++scan_count_);
  Must(t.Commit());
  return inspection;
}

void CutBlades::CalibrateAxesAnew() {
  storage::Transaction t = Must(database.database()->Begin(Soon(60)));
  calibrations_.rotation = PutCalibration(t, SampleRotationCalibration());
  Must(t.Commit());
}

void CutBlades::Withdraw(const std::string& calibration) {
  storage::CalibrationRow row;
  row.calibration_id = IdOf(calibration);
  row.machine_id = "m1";
  storage::Transaction t = Must(database.database()->Begin(Soon(60)));
  Must(storage::WithdrawCalibration(t, row, {"sensor was knocked", "engineer", "test", {}}));
  Must(t.Commit());
}

}  // namespace sixpoint::testing
