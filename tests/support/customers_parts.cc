#include "tests/support/customers_parts.h"

#include <utility>

#include "storage/assessments.h"
#include "storage/blobs.h"
#include "storage/calibrations.h"
#include "storage/clearances.h"
#include "storage/corrections.h"
#include "storage/deviations.h"
#include "storage/drawings.h"
#include "storage/inspections.h"
#include "storage/machining_models.h"
#include "storage/machining_passes.h"
#include "storage/measurements.h"
#include "storage/plant_registry.h"
#include "storage/reconstructions.h"
#include "storage/registrations.h"
#include "storage/repairs.h"
#include "storage/retention.h"
#include "storage/scans.h"
#include "storage/sections.h"
#include "storage/studies.h"
#include "tests/support/registered.h"
#include "tests/support/rows_of_m1.h"
#include "tests/support/sample_calibrations.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::testing {
namespace {

std::string PutRegistration(storage::Transaction& transaction, const std::string& part_id,
                            const std::string& blade_serial, const MachinesCalibrations& calibrations,
                            const std::string& scan) {
  auto row = ResultOf<storage::RegistrationRow>(part_id, blade_serial, calibrations);
  row.registration_id = storage::NewUuid();
  row.method = "SIX_POINT";
  row.outcome = "NOT_CONVERGED";
  row.station = "left";
  row.weakest_direction = std::vector<double>(6, 0.4);
  std::vector<std::string> inputs = {"blades/" + blade_serial, calibrations.sensor, calibrations.rotation};
  if (!scan.empty()) {
    row.scans = {{IdOf(scan), 1, 1, 0}};
    inputs.push_back(scan);
  }
  const std::string name = "registrations/" + row.registration_id;
  Must(storage::InsertRegistration(transaction, row, EntryOfM1(name, inputs, blade_serial)));
  return name;
}

std::string PutCorrection(storage::Transaction& transaction, const CustomersPart& of,
                          const MachinesCalibrations& calibrations) {
  auto row = ResultOf<storage::CorrectionRow>(IdOf(of.part), IdOf(of.blade), calibrations);
  row.correction_id = storage::NewUuid();
  row.registration_id = IdOf(of.registration);
  row.nc_template = "X1 (SIXPOINT " + of.word + "/H1)";
  row.nc_program = "X2 (SIXPOINT " + of.word + "/H1)";
  row.release = "AUTOMATIC";
  row.envelope_translation_mm = 2;
  row.envelope_rotation_deg = 3;
  row.valid_until = storage::Instant(std::chrono::seconds(4'000'000'000));
  const std::string name = "corrections/" + row.correction_id;
  Must(storage::InsertCorrection(transaction, row, EntryOfM1(name, {of.registration}, IdOf(of.blade))));
  return name;
}

std::string PutInspection(storage::Transaction& transaction, const CustomersPart& of,
                          const MachinesCalibrations& calibrations) {
  auto row = ResultOf<storage::InspectionRow>(IdOf(of.part), IdOf(of.blade), calibrations);
  row.inspection_id = storage::NewUuid();
  row.registration_id = IdOf(of.registration);
  row.method = "SIX_POINT";
  row.verdict = "NOT_MEASURED";
  row.decision_rule = "rule of " + of.word;
  row.deviation_point_count = 1;
  row.scan_ids = {IdOf(of.scan)};
  const std::string name = "inspections/" + row.inspection_id;
  Must(storage::InsertInspection(transaction, row, EntryOfM1(name, {of.registration}, IdOf(of.blade))));
  return name;
}

std::string PutStudy(storage::Transaction& transaction, const CustomersPart& of) {
  storage::StudyRow row;
  row.study_id = storage::NewUuid();
  row.machine_id = "m1";
  row.kind = "GAUGE";
  row.inputs = {of.scan};
  row.request_bytes = "study of " + of.word;
  row.verdict = "REPORTED";
  row.result_json = "{\"inputs\": [\"" + of.scan + "\"]}";
  row.requested_by = "users/maker";
  row.software_version = "test";
  storage::RecordEntry entry = EntryOfM1("studies/" + row.study_id, {of.scan}, "");
  entry.kind = "study";
  Must(storage::InsertStudy(transaction, row, entry));
  return "studies/" + row.study_id;
}

void PutScan(storage::Transaction& transaction, const CustomersPart& of) {
  storage::ScanRow scan;
  scan.scan_id = IdOf(of.scan);
  scan.machine_id = "m1";
  scan.machine_revision = 1;
  scan.blade_serial = IdOf(of.blade);
  scan.kind = "airfoil";
  scan.profile_pitch_mm = 0.1;
  scan.columns_per_profile = 1280;
  scan.point_count = 1;
  scan.encoding = "draco";
  scan.block_count = 1;
  scan.profile_count = 1;
  scan.stored_encoding = "draco";
  scan.stored_bytes = 1;
  scan.stored_sha256 = scan.sent_sha256 = std::string(64, '0');
  Must(storage::InsertScan(transaction, scan, {}, EntryOfM1(of.scan, {"machines/m1@1", of.blade}, IdOf(of.blade))));
}

void PutPart(storage::Transaction& transaction, const CustomersPart& of, bool has_customer) {
  const std::string surface = Must(storage::PutBlob(transaction, "surface of " + of.word));
  const storage::TessellationRow tessellation{surface, "stl", surface, 12, 0, true, {-15, -15, -10}, {15, 15, 0}};
  Must(storage::InsertTessellation(transaction, tessellation, "test"));
  storage::PartRow part = PartOf(IdOf(of.part), tessellation);
  if (has_customer) part.customer_id = of.word;
  storage::RecordEntry entry = EntryOfM1("parts/", {}, "");
  entry.machine.reset();
  Must(storage::InsertPart(transaction, part, entry));
  Must(storage::InsertBlade(transaction, {IdOf(of.blade), part.part_id, {}}, entry));
}

template <typename Decide>
void Decided(storage::Database* database, const Decide& decide) {
  storage::Transaction transaction = Must(database->Begin(Soon(60)));
  decide(transaction);
  Must(transaction.Commit());
}

}  // namespace

std::string PutDeviation(storage::Transaction& transaction, const std::string& part_id, const std::string& blade_serial,
                         const std::string& registration, const std::string& characteristic,
                         const MachinesCalibrations& calibrations) {
  auto row = ResultOf<storage::DeviationMapRow>(part_id, blade_serial, calibrations);
  row.deviation_id = storage::NewUuid();
  row.registration_id = IdOf(registration);
  row.method = "BEST_FIT";
  row.patch_mm = row.patch_count = 1;
  row.compared_count = 100;
  row.budget_sources = {"points"};
  row.budget_um = {0.2};
  row.verdict = "CONFORM";
  row.decision_rule = "ISO 14253-1";
  row.patches_sha256 = std::string(64, '0');
  row.computed_on = "x86-64";
  storage::DeviationRegionRow whole;
  whole.area_mm2 = whole.seen_area_mm2 = 1;
  whole.point_count = 100;
  whole.values = storage::DeviationRegionRow::Values{3, 3, 1, 3, 5, {0, 3, 0.5, {}}, {0, 3, 0.5, {}}};
  row.regions = {whole};
  storage::DeviationProfileRow profile;
  profile.characteristic = characteristic;
  profile.zone = "FORM_AND_LOCATION";
  profile.lower_mm = -0.05;
  profile.upper_mm = 0.05;
  profile.verdict = "CONFORM";
  profile.coverage = 1;
  profile.lowest = profile.highest = whole.values->lowest;
  row.profiles = {profile};
  row.patches = {{0, 0, 0}, {0, 0, 1}, {1}, {3}, {0.5}, {100}};
  const std::string name = "deviations/" + row.deviation_id;
  Must(storage::InsertDeviationMap(transaction, row, EntryOfM1(name, {registration}, blade_serial)));
  return name;
}

std::string PutSections(storage::Transaction& transaction, const std::string& part_id, const std::string& blade_serial,
                        const std::string& registration, const std::string& section,
                        const MachinesCalibrations& calibrations) {
  auto row = ResultOf<storage::SectionMeasurementRow>(part_id, blade_serial, calibrations);
  row.section_measurement_id = storage::NewUuid();
  row.registration_id = IdOf(registration);
  row.method = "BEST_FIT";
  row.half_width_mm = 0.1;
  row.reference_section = section;
  row.outlines_sha256 = std::string(64, '0');
  row.computed_on = "x86-64";
  storage::SectionRow one;
  one.section = section;
  one.normal_in_part = {0, 0, 1};
  one.reference_in_part = {1, 0, 0};
  one.point_count = 100;
  one.found = storage::SectionRow::Found{"ROUND", "SQUARE", 2, 1, 5, 0};
  one.values = {{"CHORD_NOSE_TAIL", "MM", 30, 30.01, 0.005, 0.001, 0.002, 0.001, ""},
                {"CHORD_TANGENT", "MM", {}, {}, {}, {}, {}, {}, "no double tangent"}};
  row.sections = {one};
  row.outlines = {{{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, {0, 0, 1, 0, 0, 1}, {0, 0, 1, 0, 0, 1}, {1, 2, 3}, {0}}};
  const std::string name = "sections/" + row.section_measurement_id;
  Must(storage::InsertSectionMeasurement(transaction, row, EntryOfM1(name, {registration}, blade_serial)));
  return name;
}

std::string PutReconstruction(storage::Transaction& transaction, const std::string& part_id,
                              const std::string& blade_serial, const std::string& registration,
                              const std::string& region, const MachinesCalibrations& calibrations) {
  auto row = ResultOf<storage::ReconstructionRow>(part_id, blade_serial, calibrations);
  row.reconstruction_id = storage::NewUuid();
  row.registration_id = IdOf(registration);
  row.method = "BEST_FIT";
  row.of_part_limits = true;
  row.applied = {0.5, 1.5, 4, 2, 4, 3};
  row.outcome = "RECONSTRUCTED";
  row.worst_step_um = 1;
  row.worst_kink_deg = 0.05;
  row.taken_count = 100;
  row.patch_count = 1;
  row.spacing_mm = 4;
  row.lattice = "lattice of " + region;
  row.lattice_sha256 = storage::Sha256Hex(row.lattice);
  row.patches_sha256 = std::string(64, '0');
  row.computed_on = "x86-64";
  storage::ReconstructionRegionRow one;
  one.applied = {region, {}, {}, {0, 0, 1}, 60, "MACHINED", 0.05, -0.5, 0.5};
  one.area_mm2 = one.seen_part = 1;
  one.patch_count = 1;
  one.least_allowance_um = 60;
  one.least_spare_um = 4;
  one.greatest_band_use = 0.3;
  row.regions = {one};
  row.holds = {{0, "STOCK", true, -0.1, 1, {1, 2, 3}, {0, 0, 1}, 0}};
  row.patches = {{1, 2, 3}, {0, 0, 1}, {2}, {60}, {0}};
  const std::string name = "reconstructions/" + row.reconstruction_id;
  Must(storage::InsertReconstruction(transaction, row, EntryOfM1(name, {registration}, blade_serial)));
  return name;
}

std::string PutMachiningPass(storage::Transaction& transaction, const std::string& part_id,
                             const std::string& blade_serial, const std::string& registration,
                             const std::string& reconstruction, const MachinesCalibrations& calibrations) {
  auto row = ResultOf<storage::MachiningPassRow>(part_id, blade_serial, calibrations);
  row.pass_id = storage::NewUuid();
  row.registration_id = IdOf(registration);
  row.correction_id = row.reconstruction_id = IdOf(reconstruction);
  row.method = "BEST_FIT";
  row.number = 1;
  row.outcome = "DONE";
  row.taken_count = 100;
  row.patch_count = 1;
  row.patches_sha256 = std::string(64, '0');
  row.computed_on = "x86-64";
  row.regions = {{"edge", 1, 0.95, 2, 1, 3, 40, 20, 1, 0.2}};
  row.patches = {{1, 2, 3}, {0, 0, 1}, {2}, {2}, {0}};
  const std::string name = "machining_passes/" + row.pass_id;
  storage::RecordEntry entry = EntryOfM1(name, {registration, reconstruction}, blade_serial);
  entry.kind = "machining_pass";
  Must(storage::InsertMachiningPass(transaction, row, entry));
  return name;
}

std::string PutRepair(storage::Transaction& transaction, const std::string& part_id, const std::string& blade_serial,
                      const std::string& registration, const MachinesCalibrations& calibrations) {
  auto row = ResultOf<storage::RepairRow>(part_id, blade_serial, calibrations);
  row.repair_id = storage::NewUuid();
  row.registration_id = IdOf(registration);
  row.method = "BEST_FIT";
  row.applied = {2, 30, 38, 1, 6, 40, "PROCESS_OF_DEVIATION", false, {}, 5, 5, 0, 50, 0.5, 0.1, 1, 10, 1, 1.2, 50};
  row.below_line_count = 1000;
  row.greatest_stock_mm = 1.2;
  row.step_over_mm = 0.3;
  row.lap_count = 2;
  row.place_count = 200;
  row.path_length_mm = 120;
  row.removal = {100, 0, 0.4, 0, 5, 2};
  row.contours_sha256 = row.path_sha256 = std::string(64, '0');
  row.computed_on = "x86-64";
  row.sections = {{38, "TARGET", "", 8, 12, 5, 0.4}};
  row.contours = {{{1, 2, 38}, {8}, {5}}};
  row.laps = {{38, 0, {1, 2, 38}, {0, 0, 1}}};
  const std::string name = "repairs/" + row.repair_id;
  Must(storage::InsertRepair(transaction, row, EntryOfM1(name, {registration}, blade_serial)));
  return name;
}

MachinesCalibrations PutCalibratedMachine(storage::Database* database) {
  storage::Transaction transaction = Must(database->Begin(Soon(60)));
  RegisterMachine(transaction, "m1");
  MachinesCalibrations calibrations;
  calibrations.sensor = PutCalibration(transaction, SampleSensorCalibration());
  calibrations.rotation = PutCalibration(transaction, SampleRotationCalibration());
  Must(transaction.Commit());
  return calibrations;
}

void PutMachiningModel(storage::Database* database, CustomersPart* part) {
  part->machining_model = "machining_models/" + part->word + "-edm";
  storage::MachiningModelRow model;
  model.machining_model_id = IdOf(part->machining_model);
  model.content_sha256 = std::string(64, '0');
  model.part_id = IdOf(part->part);
  model.part_revision = 1;
  model.operations = {{"OP10", "G1", 0.4, 60, 0}};
  model.nc_template = "X1 (SIXPOINT " + part->word + "/H1)\n";
  storage::RecordEntry entry = EntryOfM1("", {part->part + "@1"}, "");
  entry.machine.reset();
  Decided(database,
          [&](storage::Transaction& transaction) { Must(storage::InsertMachiningModel(transaction, model, entry)); });
}

std::string PutDrawingOf(storage::Transaction& transaction, const std::string& part_id, const std::string& drawing_id) {
  storage::DrawingRow row;
  row.drawing_id = drawing_id;
  row.content_sha256 = std::string(64, '0');
  row.part_id = part_id;
  row.part_revisions = {1};
  row.drawing_number = "number of " + drawing_id;
  row.drawing_revision = "C";
  row.part_number = "part number of " + drawing_id;
  row.part_name = "vane";
  row.additional_changes = {"ECN 1"};
  row.decision_rule = {"ISO_14253_1", "2017", std::nullopt};
  row.regions = {{"root", {-1, -1, -1}, {1, 1, 1}, {}, std::nullopt}};
  row.datum_systems = {{"A|B", "LOCAL", "root", {{"A", {}}, {"B", {}}}}};
  storage::DrawingSectionRow section;
  section.section = "50 %";
  section.height_mm = 5;
  section.half_width_mm = 0.1;
  row.sections = {section};
  storage::CharacteristicRow chord;
  chord.characteristic = "1";
  chord.name = "chord of " + drawing_id;
  chord.requirement = "30 +-0.1";
  chord.reference_location = "sheet 1";
  chord.characteristic_class = "MAJOR";
  chord.quantity = "SECTION_CHORD";
  chord.algorithm = "CALIPER";
  chord.section = "50 %";
  chord.unit = "MM";
  chord.nominal = 30;
  chord.lower_limit = 29.9;
  chord.upper_limit = 30.1;
  chord.datum_system = "A|B";
  row.characteristics = {chord};
  row.product_requirements = {{"MATERIAL", "alloy of " + drawing_id, "AMS 5663", "", false}};
  row.requested_by = "users/maker";
  storage::RecordEntry entry = EntryOfM1("", {"parts/" + part_id + "@1"}, "");
  entry.machine.reset();
  Must(storage::InsertDrawing(transaction, row, entry));
  return "drawings/" + drawing_id;
}

void PutDrawing(storage::Database* database, CustomersPart* part) {
  Decided(database, [&](storage::Transaction& transaction) {
    part->drawing = PutDrawingOf(transaction, IdOf(part->part), part->word + "-drawing");
  });
}

std::string PutAssessmentOf(storage::Transaction& transaction, const std::string& part_id,
                            const std::string& blade_serial, const std::string& drawing, const std::string& deviation,
                            const std::string& word) {
  storage::AssessmentRow row;
  row.assessment_id = storage::NewUuid();
  row.blade_serial = blade_serial;
  row.machine_id = "m1";
  row.machine_revision = 1;
  row.part_id = part_id;
  row.part_revision = 1;
  row.drawing_id = IdOf(drawing);
  row.drawing_revision = 1;
  row.stage = "BEFORE_MACHINING";
  row.verdict = "NOT_CONFORM";
  row.fate = "DISCARD";
  row.fate_reason = "profile of " + word;
  row.requested_by = "users/maker";
  row.software_version = "test";
  row.computed_on = "x86-64";
  row.results = {deviation};
  storage::CharacteristicFindingRow profile;
  profile.characteristic = "1";
  profile.name = "profile of " + word;
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
  const std::string name = "assessments/" + row.assessment_id;
  Must(storage::InsertAssessment(transaction, row, EntryOfM1(name, {deviation, drawing + "@1"}, blade_serial)));
  return name;
}

void PutAssessment(storage::Database* database, CustomersPart* part) {
  Decided(database, [&](storage::Transaction& transaction) {
    part->assessment =
        PutAssessmentOf(transaction, IdOf(part->part), IdOf(part->blade), part->drawing, part->deviation, part->word);
  });
}

std::string PutMeasurementOf(storage::Transaction& transaction, const std::string& part_id,
                             const std::string& blade_serial, const std::string& drawing) {
  storage::MeasurementRow row;
  row.measurement_id = storage::NewUuid();
  row.blade_serial = blade_serial;
  row.measured_at = storage::Instant(std::chrono::seconds(1'795'000'000));
  row.file.drawing_id = IdOf(drawing);
  row.file.drawing_revision = 1;
  row.file.part_id = part_id;
  row.file.instrument = {"CMM", "Acme", "C-1", "instrument of " + blade_serial, "certificate 7"};
  row.file.format = "CSV";
  row.file.sha256 = std::string(64, '0');
  row.file.lengths_expanded_uncertainty_um = 2;
  row.file.uncertainty_basis = "ISO 15530-3";
  row.file.software_version = "test";
  row.values = {{"1", "", "MM", "", 30.02, 0.002, ""}};
  row.left_out = {"left out of " + blade_serial};
  row.left_out_count = 1;
  storage::MeasurementImport import;
  import.requested_by = "users/maker";
  import.measurements = {row};
  storage::RecordEntry entry = EntryOfM1("", {}, "");
  entry.machine.reset();
  Must(storage::InsertMeasurements(transaction, import, entry));
  return "measurements/" + row.measurement_id;
}

void PutMeasurement(storage::Database* database, CustomersPart* part) {
  Decided(database, [&](storage::Transaction& transaction) {
    part->measurement = PutMeasurementOf(transaction, IdOf(part->part), IdOf(part->blade), part->drawing);
  });
}

CustomersPart PutCustomersPart(storage::Database* database, const std::string& word, bool has_customer,
                               const MachinesCalibrations& calibrations) {
  CustomersPart made;
  made.word = word;
  made.part = "parts/" + word + "-part";
  made.blade = "blades/" + word + "-sn";
  made.scan = "scans/" + word + "-scan";
  made.deletion = "deletions/" + word + "-scan";
  Decided(database, [&](storage::Transaction& transaction) {
    PutPart(transaction, made, has_customer);
    PutScan(transaction, made);
    made.registration = PutRegistration(transaction, IdOf(made.part), IdOf(made.blade), calibrations, made.scan);
    made.correction = PutCorrection(transaction, made, calibrations);
    made.inspection = PutInspection(transaction, made, calibrations);
    made.deviation = PutDeviation(transaction, IdOf(made.part), IdOf(made.blade), made.registration,
                                  "17 of " + made.word, calibrations);
    made.sections = PutSections(transaction, IdOf(made.part), IdOf(made.blade), made.registration,
                                "root of " + made.word, calibrations);
    made.reconstruction = PutReconstruction(transaction, IdOf(made.part), IdOf(made.blade), made.registration,
                                            "edge of " + made.word, calibrations);
    made.machining_pass = PutMachiningPass(transaction, IdOf(made.part), IdOf(made.blade), made.registration,
                                           made.reconstruction, calibrations);
    made.repair = PutRepair(transaction, IdOf(made.part), IdOf(made.blade), made.registration, calibrations);
    made.study = PutStudy(transaction, made);
  });
  Must(storage::DeleteScanPoints(database, nullptr,
                                 {IdOf(made.scan), "of " + word, "users/maker", "test", std::nullopt}, Soon(60)));
  return made;
}

void PutRegistrations(storage::Transaction& transaction, const std::string& part_id, const std::string& blade_serial,
                      const MachinesCalibrations& calibrations, int count) {
  for (int i = 0; i < count; ++i) PutRegistration(transaction, part_id, blade_serial, calibrations, "");
}

void Clear(storage::Database* database, const std::string& holder, const std::string& scope) {
  Decided(database, [&](storage::Transaction& transaction) {
    Must(storage::GrantClearance(transaction, {holder, scope, "users/keeper", storage::NewUuid()}));
  });
}

void Unclear(storage::Database* database, const std::string& holder, const std::string& scope) {
  Decided(database, [&](storage::Transaction& transaction) {
    Must(storage::WithdrawClearance(transaction, {holder, scope, "users/keeper", storage::NewUuid()}));
  });
}

}  // namespace sixpoint::testing
