#include "tests/support/cut_blades.h"

#include <optional>
#include <utility>
#include <vector>

#include "storage/blobs.h"
#include "storage/calibrations.h"
#include "storage/correction_events.h"
#include "storage/corrections.h"
#include "storage/inspections.h"
#include "storage/registrations.h"
#include "storage/scans.h"
#include "storage/three.h"
#include "tests/support/registered.h"
#include "tests/support/rows_of_m1.h"
#include "tests/support/sample_calibrations.h"

namespace sixpoint::testing {
namespace {

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
  row.condition_number = 44;
  row.weakest_standard_uncertainty_um = 1;
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
  for (const CutHole& hole : HolesOf(blade)) {
    if (row.groups.empty() || row.groups.back().group_name != hole.group) {
      storage::CorrectionGroupRow& group = row.groups.emplace_back();
      group.group_name = hole.group;
      group.a_deg = hole.a_deg;
      group.b_deg = hole.b_deg;
    }
    row.groups.back().holes.emplace_back().hole_name = hole.hole;
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

storage::InspectionHoleRow InspectedHoleOf(const CutHole& cut, const CutBlade& blade) {
  storage::InspectionHoleRow hole;
  hole.group_name = cut.group;
  hole.hole_name = cut.hole;
  hole.verdict = hole.position_verdict = hole.inclination_verdict = blade.measured ? "CONFORM" : "NOT_MEASURED";
  if (!blade.measured) hole.reason = "no pin";
  if (blade.measured)
    hole.measured = storage::InspectionHoleRow::Measured{blade.off_mm.norm(),
                                                         0,
                                                         kCutExpandedUncertainty_um,
                                                         kCutExpandedUncertainty_deg,
                                                         cut.found_start_mm,
                                                         cut.axis,
                                                         0.4};
  hole.position_tolerance_mm = 0.1;
  hole.inclination_tolerance_deg = 1;
  if (blade.measured) hole.budget_um = CutBudget_um();
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
  row.budget_sources = CutBudgetSources();
  for (const CutHole& hole : HolesOf(blade)) row.holes.push_back(InspectedHoleOf(hole, blade));
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
  for (const CutHole& hole : HolesOf({})) {
    if (part.hole_groups.empty() || part.hole_groups.back().group != hole.group) {
      storage::HoleGroupRow& group = part.hole_groups.emplace_back();
      group.group = hole.group;
      group.diameter_mm = 0.4;
      group.depth_mm = 5;
      group.a_nominal_deg = hole.a_deg;
      group.b_nominal_deg = hole.b_deg;
      group.axis_in_part = storage::ListOf(hole.axis);
      group.position_tolerance_mm = 0.1;
      group.inclination_tolerance_deg = 1;
      group.position_zone = "RADIUS";
    }
    part.hole_groups.back().holes.push_back(
        {hole.hole, storage::ListOf(hole.predicted_start_mm), storage::ListOf(hole.axis)});
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

CutNames CutBlades::Cut(const CutBlade& blade) {
  CutNames names;
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
  for (const CutHole& hole : HolesOf(blade)) report.holes.push_back({hole.group, hole.hole});
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
