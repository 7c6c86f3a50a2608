#include "tests/support/sample_results.h"

#include <chrono>
#include <optional>
#include <string>

#include "storage/blobs.h"

namespace sixpoint::testing {
namespace {

const std::string kZeroDigest(64, '0');

}  // namespace

storage::InspectionRow SampleInspection() {
  storage::InspectionRow row;
  row.method = "SIX_POINT";
  row.verdict = "NOT_MEASURED";
  row.decision_rule = "ISO 14253-1";
  row.deviation_point_count = 100;
  row.computed_on = "x86-64";
  row.budget_sources = {"points of the pin"};
  for (const char* name : {"H1", "H2"}) {
    storage::InspectionHoleRow& hole = row.holes.emplace_back();
    hole.group_name = "G1";
    hole.hole_name = name;
    hole.position_tolerance_mm = 0.1;
    hole.inclination_tolerance_deg = 1;
  }
  storage::InspectionHoleRow &good = row.holes[0], &missing = row.holes[1];
  good.verdict = good.position_verdict = good.inclination_verdict = "CONFORM";
  good.measured = storage::InspectionHoleRow::Measured{0.02, 0.25, 6, 0.05, {0.02, 0, 0}, {0, 0, 1}, 0.4};
  good.point_count = 50;
  good.budget_um = {3};
  missing.verdict = missing.position_verdict = missing.inclination_verdict = "NOT_MEASURED";
  missing.reason = "no pin stands in it";
  return row;
}

storage::DeviationMapRow SampleDeviation() {
  storage::DeviationMapRow row;
  row.method = "BEST_FIT";
  row.patch_mm = row.patch_count = 1;
  row.compared_count = 100;
  row.budget_sources = {"points"};
  row.budget_um = {0.2};
  row.verdict = "CONFORM";
  row.decision_rule = "ISO 14253-1";
  row.patches_sha256 = kZeroDigest;
  row.computed_on = "x86-64";
  storage::DeviationRegionRow whole;
  whole.area_mm2 = whole.seen_area_mm2 = 1;
  whole.point_count = 100;
  whole.values = storage::DeviationRegionRow::Values{3, 3, 1, 3, 5, {0, 3, 0.5, {}}, {0, 3, 0.5, {}}};
  row.regions = {whole};
  storage::DeviationProfileRow profile;
  profile.characteristic = "17";
  profile.zone = "FORM_AND_LOCATION";
  profile.lower_mm = -0.05;
  profile.upper_mm = 0.05;
  profile.verdict = "CONFORM";
  profile.coverage = 1;
  profile.lowest = profile.highest = whole.values->lowest;
  row.profiles = {profile};
  row.patches = {{0, 0, 0}, {0, 0, 1}, {1}, {3}, {0.5}, {100}};
  return row;
}

storage::SectionMeasurementRow SampleSections() {
  storage::SectionMeasurementRow row;
  row.method = "BEST_FIT";
  row.half_width_mm = 0.1;
  row.reference_section = "50 %";
  row.outlines_sha256 = kZeroDigest;
  row.computed_on = "x86-64";
  storage::SectionRow one;
  one.section = "50 %";
  one.normal_in_part = {0, 0, 1};
  one.reference_in_part = {1, 0, 0};
  one.point_count = 100;
  one.found = storage::SectionRow::Found{"ROUND", "SQUARE", 2, 1, 5, 0};
  one.values = {{"CHORD_NOSE_TAIL", "MM", 30, 30.01, 0.005, 0.001, 0.002, 0.001, ""},
                {"CHORD_TANGENT", "MM", {}, {}, {}, {}, {}, {}, "no double tangent"}};
  row.sections = {one};
  row.outlines = {{{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, {0, 0, 1, 0, 0, 1}, {0, 0, 1, 0, 0, 1}, {1, 2, 3}, {0}}};
  return row;
}

storage::ReconstructionRow SampleReconstruction() {
  storage::ReconstructionRow row;
  row.method = "BEST_FIT";
  row.of_part_limits = true;
  row.applied = {0.5, 1.5, 4, 2, 4, 3};
  row.outcome = "RECONSTRUCTED";
  row.worst_step_um = 1;
  row.worst_kink_deg = 0.05;
  row.taken_count = 100;
  row.patch_count = 1;
  row.spacing_mm = 4;
  row.lattice = "lattice";
  row.lattice_sha256 = storage::Sha256Hex(row.lattice);
  row.patches_sha256 = kZeroDigest;
  row.computed_on = "x86-64";
  storage::ReconstructionRegionRow one;
  one.applied = {"edge", {}, {}, {0, 0, 1}, 60, "MACHINED", 0.05, -0.5, 0.5};
  one.area_mm2 = one.seen_part = 1;
  one.patch_count = 1;
  one.least_allowance_um = 60;
  one.least_spare_um = 4;
  one.greatest_band_use = 0.3;
  row.regions = {one};
  row.holds = {{0, "STOCK", true, -0.1, 1, {1, 2, 3}, {0, 0, 1}, 0}};
  row.patches = {{1, 2, 3}, {0, 0, 1}, {2}, {60}, {0}};
  return row;
}

storage::MachiningPassRow SampleMachiningPass() {
  storage::MachiningPassRow row;
  row.method = "BEST_FIT";
  row.number = 1;
  row.outcome = "DONE";
  row.taken_count = 100;
  row.patch_count = 1;
  row.patches_sha256 = kZeroDigest;
  row.computed_on = "x86-64";
  row.regions = {{"edge", 1, 0.95, 2, 1, 3, 40, 20, 1, 0.2}};
  row.patches = {{1, 2, 3}, {0, 0, 1}, {2}, {2}, {0}};
  return row;
}

storage::RepairRow SampleRepair() {
  storage::RepairRow row;
  row.method = "BEST_FIT";
  row.applied = {2, 30, 38, 1, 6, 40, "PROCESS_OF_DEVIATION", false, {}, 5, 5, 0, 50, 0.5, 0.1, 1, 10, 1, 1.2, 50};
  row.below_line_count = 1000;
  row.greatest_stock_mm = 1.2;
  row.step_over_mm = 0.3;
  row.lap_count = 2;
  row.place_count = 200;
  row.path_length_mm = 120;
  row.removal = {100, 0, 0.4, 0, 5, 2};
  row.contours_sha256 = row.path_sha256 = kZeroDigest;
  row.computed_on = "x86-64";
  row.sections = {{38, "TARGET", "", 8, 12, 5, 0.4}};
  row.contours = {{{1, 2, 38}, {8}, {5}}};
  row.laps = {{38, 0, {1, 2, 38}, {0, 0, 1}}};
  return row;
}

storage::AssessmentRow SampleAssessment() {
  storage::AssessmentRow row;
  row.machine_id = "m1";
  row.machine_revision = 1;
  row.part_revision = 1;
  row.drawing_revision = 1;
  row.stage = "BEFORE_MACHINING";
  row.verdict = "NOT_CONFORM";
  row.fate = "DISCARD";
  row.fate_reason = "profile";
  row.requested_by = "users/maker";
  row.software_version = "test";
  row.computed_on = "x86-64";
  storage::CharacteristicFindingRow profile;
  profile.characteristic = "1";
  profile.name = "profile";
  profile.characteristic_class = "CRITICAL";
  profile.quantity = "PROFILE_FORM";
  profile.unit = "MM";
  profile.lower_limit = -0.05;
  profile.upper_limit = 0.05;
  profile.value = 0.1;
  profile.expanded_uncertainty = 0.01;
  profile.verdict = "NOT_CONFORM";
  profile.rule = {"GUARD_FACTOR", "", 0.5};
  profile.result_index = 0;
  profile.method = "BEST_FIT";
  profile.cure = "NONE";
  profile.others = {{0, "BEST_FIT", 0.1, std::nullopt}};
  row.findings = {profile};
  row.conflicts = {{"1", 0, 0, 100, 10, {}, true, 1}};
  return row;
}

storage::MeasurementRow SampleMeasurement() {
  storage::MeasurementRow row;
  row.measured_at = storage::Instant(std::chrono::seconds(1'795'000'000));
  row.file.drawing_revision = 1;
  row.file.instrument = {"CMM", "Acme", "C-1", "4711", "certificate 7"};
  row.file.format = "CSV";
  row.file.sha256 = kZeroDigest;
  row.file.lengths_expanded_uncertainty_um = 2;
  row.file.uncertainty_basis = "ISO 15530-3";
  row.file.software_version = "test";
  row.values = {{"1", "", "MM", "", 30.02, 0.002, ""}};
  storage::CountValues(&row);
  row.left_out = {"roughness"};
  row.left_out_count = 1;
  return row;
}

}  // namespace sixpoint::testing
