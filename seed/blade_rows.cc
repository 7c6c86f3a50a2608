#include "seed/blade_rows.h"

#include <algorithm>
#include <cstdio>

#include "seed/diagonal.h"
#include "storage/blobs.h"

namespace sixpoint::seed {
namespace {

constexpr double kPositionTolerance_um = 30, kInclinationTolerance_deg = 1;
constexpr int kPointCount = 38400, kProfileCount = 30;
// A verdict's severity, as metrology/inspection/verdict.h orders them.
constexpr const char* kVerdicts[] = {"CONFORM", "UNDECIDABLE", "NOT_MEASURED", "NOT_CONFORM"};

// By ISO 14253-1: what is uncertain about the limit is neither.
int VerdictOf(double error, double uncertainty, double tolerance) {
  return error + uncertainty <= tolerance ? 0 : error - uncertainty > tolerance ? 3 : 1;
}

std::string Json(const char* format, const std::string& word, double number) {
  char text[200];
  std::snprintf(text, sizeof text, format, word.c_str(), number);
  return text;
}

const std::vector<std::string>& BudgetSources() {
  static const std::vector<std::string> sources = {"sensor calibration", "rotation calibration", "noise of the scans"};
  return sources;
}

}  // namespace

BladeRows::BladeRows(const Plan& plan, const Registry& registry, int index)
    : plan_(plan),
      registry_(registry),
      index_(index),
      blade_(plan.BladeOf(index)),
      machine_id_(plan.machines()[static_cast<std::size_t>(blade_.machine)].id),
      part_id_(plan.PartId(blade_.part)) {}

template <typename Row>
void BladeRows::Fill(int month, Row* row) const {
  row->blade_serial = blade_.serial;
  row->machine_id = machine_id_;
  row->machine_revision = row->part_revision = 1;
  row->part_id = part_id_;
  row->sensor_calibration_id = CalibrationsOf(month).sensor_id;
  row->rotation_calibration_id = CalibrationsOf(month).rotation_id;
  row->requested_by = "machines/" + machine_id_;
  row->software_version = kSoftwareVersion;
}

// What the results of a blade rest on alike.
storage::RecordEntry BladeRows::Entry(const std::string& kind, const std::string& name, int month) const {
  storage::RecordEntry entry = EntryOf(kind, name, "machines/" + machine_id_);
  const Calibrations& of_month = CalibrationsOf(month);
  entry.inputs = {"machines/" + machine_id_ + "@1", "parts/" + part_id_ + "@1", "calibrations/" + of_month.sensor_id,
                  "calibrations/" + of_month.rotation_id};
  entry.blade = blade_.serial;
  entry.machine = machine_id_;
  entry.method = "BEST_FIT";
  return entry;
}

storage::RecordEntry BladeRows::BladeEntry() const { return EntryOf("blade", "", kSeeder); }

std::string BladeRows::WorkOrder() const {
  constexpr int kBladesAnOrder = 50;
  return "SEED-WO-" + std::to_string(index_ / kBladesAnOrder);
}

Made<storage::DispositionRow> BladeRows::Disposition(const storage::InspectionRow& inspection) const {
  constexpr const char* kDecisions[] = {"REWORK", "SCRAP", "CONCESSION", "USE_AS_IS"};
  storage::DispositionRow row;
  row.disposition_id = storage::NewUuid();
  row.inspection_id = inspection.inspection_id;
  row.blade_serial = inspection.blade_serial;
  row.machine_id = inspection.machine_id;
  row.disposition = kDecisions[index_ % 4];
  row.reason = "seeded";
  if (row.disposition == "CONCESSION") row.reference = "SEED-C-" + std::to_string(index_);
  row.requested_by = kSeeder;
  row.software_version = kSoftwareVersion;
  storage::RecordEntry entry = EntryOf("disposition", "dispositions/" + row.disposition_id, kSeeder);
  entry.inputs = {"inspections/" + inspection.inspection_id};
  entry.blade = row.blade_serial;
  entry.machine = row.machine_id;
  entry.method = row.disposition;
  return {std::move(row), std::move(entry)};
}

Made<storage::ScanRow> BladeRows::Scan(const std::string& kind) const {
  storage::ScanRow scan;
  scan.scan_id = ScanId(kind);
  scan.machine_id = machine_id_;
  scan.machine_revision = 1;
  scan.blade_serial = blade_.serial;
  scan.kind = kind;
  scan.v0_mm = {-60, -90, 281};
  scan.b_deg = 60;
  scan.profile_pitch_mm = 0.2;
  scan.columns_per_profile = 1280;
  scan.point_count = kPointCount;
  scan.encoding = "raw_profiles";
  scan.stored_encoding = "range_image";
  scan.profile_count = kProfileCount;
  scan.block_count = 1;
  scan.stored_bytes = registry_.scan_blob_bytes;
  scan.stored_sha256 = scan.sent_sha256 = storage::Sha256OfDigests({registry_.scan_blob_sha256});
  // Pins are scanned after drilling, half an hour later.
  scan.measured_at = blade_.scanned_at + std::chrono::minutes(kind == "pins" ? 30 : 0);
  storage::RecordEntry entry = EntryOf("scan", "scans/" + scan.scan_id, "machines/" + machine_id_);
  entry.inputs = {"machines/" + machine_id_ + "@1", "blades/" + blade_.serial};
  entry.blade = blade_.serial;
  entry.machine = machine_id_;
  entry.measured_at = scan.measured_at;
  entry.summary_json = Json(R"({"kind": "%s", "point_count": %.0f})", kind, kPointCount);
  return {std::move(scan), std::move(entry)};
}

storage::ScanBlockRow BladeRows::BlockOf(const storage::ScanRow& scan) const {
  storage::ScanBlockRow block;
  block.point_count = static_cast<int>(scan.point_count);
  block.blob_sha256 = block.sent_sha256 = registry_.scan_blob_sha256;
  block.profile_count = scan.profile_count;
  return block;
}

Made<storage::RegistrationRow> BladeRows::Registration(int month) const {
  storage::RegistrationRow row;
  Fill(month, &row);
  row.registration_id = storage::NewUuid();
  row.method = "BEST_FIT";
  const bool converged = blade_.casting != Casting::kTwisted;
  row.outcome = converged ? "CONVERGED" : "NOT_CONVERGED";
  if (converged) {
    row.zero_from_part = {1, 0, 0, 0.21, 0, 1, 0, -0.13, 0, 0, 1, 1e-3 * blade_.off_um};
    row.reference_mm = {0, 0, 0};
    row.covariance = Diagonal(6, 1e-10, 3, 6e-6);
    row.noise_covariance = Diagonal(6, 1e-11, 3, 2e-7);
    row.calibration_sensitivity = std::vector<double>(84, 0);
  } else {
    row.remark = "the casting is twisted: the fit goes back and forth";
  }
  row.point_count = kPointCount;
  row.points_used = converged ? kPointCount - 900 : kPointCount / 3;
  row.iteration_count = converged ? 12 : 100;
  row.residual_rms_um = row.residual_sigma_um = converged ? 4.2 : 310;
  row.condition_number = 44;
  row.weakest_direction = {0, 0, 0, 0, 1, 0};
  row.weakest_standard_uncertainty_um = 2.4;
  row.compute_seconds = 1.3;
  row.scans = {{ScanId("airfoil"), row.point_count, row.points_used, 0.4}};
  storage::RecordEntry entry = Entry("registration", "registrations/" + row.registration_id, month);
  entry.inputs.push_back("blades/" + blade_.serial);
  entry.inputs.push_back("scans/" + ScanId("airfoil"));
  const Calibrations& of_month = CalibrationsOf(month);
  for (const std::string& table : {of_month.axis_a_id, of_month.axis_b_id})
    entry.inputs.push_back("calibrations/" + table);
  entry.summary_json = Json(R"({"outcome": "%s", "residual_sigma_um": %g})", row.outcome, *row.residual_sigma_um);
  return {std::move(row), std::move(entry)};
}

Made<storage::CorrectionRow> BladeRows::Correction(const std::string& registration_id) const {
  storage::CorrectionRow row;
  Fill(blade_.month, &row);
  row.correction_id = storage::NewUuid();
  row.registration_id = registration_id;
  row.release = "AUTOMATIC";
  row.envelope_translation_mm = 2;
  row.envelope_rotation_deg = 3;
  row.valid_until = blade_.scanned_at + std::chrono::hours(8);
  row.registration_age_h = 8;
  row.budget_sources = BudgetSources();
  for (const Hole& hole : plan_.HolesOf(blade_.part)) {
    if (row.groups.empty() || row.groups.back().group_name != hole.group) {
      storage::CorrectionGroupRow& group = row.groups.emplace_back();
      group.group_name = hole.group;
      group.b_nominal_deg = group.b_ideal_deg = group.b_deg = 60;
      group.a_deg = group.a_ideal_deg = 0.021;
    }
    row.groups.back().holes.push_back({hole.name,
                                       {hole.start_x_mm + 0.21, hole.start_y_mm - 0.13, 1e-3 * blade_.off_um},
                                       {hole.start_x_mm, hole.start_y_mm, 0},
                                       9.1,
                                       {3.1, 2.6, 0.4},
                                       {}});
  }
  storage::RecordEntry entry = Entry("correction", "corrections/" + row.correction_id, blade_.month);
  entry.inputs.insert(entry.inputs.begin(), "registrations/" + registration_id);
  entry.summary_json = Json(R"({"release": "%s", "greatest_shift_mm": %g})", row.release, 0.247);
  return {std::move(row), std::move(entry)};
}

Made<storage::InspectionRow> BladeRows::Inspection(const std::string& registration_id, int month,
                                                   const std::string& rejudges_id) const {
  storage::InspectionRow row;
  Fill(month, &row);
  row.inspection_id = storage::NewUuid();
  row.registration_id = registration_id;
  row.rejudges_id = rejudges_id;
  row.method = "BEST_FIT";
  row.decision_rule = "ISO 14253-1";
  row.deviation_minimum_um = -22;
  row.deviation_p05_um = -8;
  row.deviation_p95_um = blade_.casting == Casting::kThick ? 90 : 8;
  row.deviation_maximum_um = row.deviation_p95_um + 14;
  row.deviation_rms_um = row.deviation_p95_um / 1.6;
  row.deviation_point_count = kPointCount - 2400;
  row.deviation_excluded_count = 2400;
  row.scan_ids = {ScanId("pins")};
  row.budget_sources = BudgetSources();
  // A withdrawn calibration was off: judged again, every hole lies elsewhere by as much.
  const double judged_again_um = rejudges_id.empty() ? 0 : 12;
  int worst = 0;
  const std::vector<HoleValue> values = plan_.ValuesOf(index_, blade_);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const Hole& hole = plan_.HolesOf(blade_.part)[i];
    const HoleValue& value = values[i];
    storage::InspectionHoleRow& judged = row.holes.emplace_back();
    judged.group_name = hole.group;
    judged.hole_name = hole.name;
    judged.position_tolerance_mm = 1e-3 * kPositionTolerance_um;
    judged.inclination_tolerance_deg = kInclinationTolerance_deg;
    int position = 2, inclination = 2;
    if (value.is_measured) {
      const double error_um = value.position_error_um + judged_again_um;
      position = VerdictOf(error_um, value.position_uncertainty_um, kPositionTolerance_um);
      inclination =
          VerdictOf(value.inclination_error_deg, value.inclination_uncertainty_deg, kInclinationTolerance_deg);
      judged.measured = storage::InspectionHoleRow::Measured{1e-3 * error_um,
                                                             value.inclination_error_deg,
                                                             value.position_uncertainty_um,
                                                             value.inclination_uncertainty_deg,
                                                             {hole.start_x_mm + 1e-3 * error_um, hole.start_y_mm, 0},
                                                             {0, 0, 1},
                                                             0.498};
      judged.point_count = 1200;
      judged.pin_residual_rms_um = 1.6;
      judged.pin_half_play_um = 2;
      judged.budget_um = {3.1, 2.6, 0.4};
    } else {
      judged.reason = "no pin was found";
    }
    judged.position_verdict = kVerdicts[position];
    judged.inclination_verdict = kVerdicts[inclination];
    judged.verdict = kVerdicts[std::max(position, inclination)];
    worst = std::max({worst, position, inclination});
  }
  row.verdict = kVerdicts[worst];
  storage::RecordEntry entry = Entry("inspection", "inspections/" + row.inspection_id, month);
  entry.inputs.insert(entry.inputs.begin(), "registrations/" + registration_id);
  entry.inputs.push_back("scans/" + ScanId("pins"));
  entry.summary_json = Json(R"({"verdict": "%s", "deviation_rms_um": %g})", row.verdict, row.deviation_rms_um);
  return {std::move(row), std::move(entry)};
}

}  // namespace sixpoint::seed
