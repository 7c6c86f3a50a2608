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
#include "tests/support/sample_results.h"
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
  row.condition_number = 44;
  row.weakest_standard_uncertainty_um = 1;
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
  auto row = ResultOf(part_id, blade_serial, calibrations, SampleDeviation());
  row.deviation_id = storage::NewUuid();
  row.registration_id = IdOf(registration);
  row.profiles.front().characteristic = characteristic;
  const std::string name = "deviations/" + row.deviation_id;
  Must(storage::InsertDeviationMap(transaction, row, EntryOfM1(name, {registration}, blade_serial)));
  return name;
}

std::string PutSections(storage::Transaction& transaction, const std::string& part_id, const std::string& blade_serial,
                        const std::string& registration, const std::string& section,
                        const MachinesCalibrations& calibrations) {
  auto row = ResultOf(part_id, blade_serial, calibrations, SampleSections());
  row.section_measurement_id = storage::NewUuid();
  row.registration_id = IdOf(registration);
  row.reference_section = row.sections.front().section = section;
  const std::string name = "sections/" + row.section_measurement_id;
  Must(storage::InsertSectionMeasurement(transaction, row, EntryOfM1(name, {registration}, blade_serial)));
  return name;
}

std::string PutReconstruction(storage::Transaction& transaction, const std::string& part_id,
                              const std::string& blade_serial, const std::string& registration,
                              const std::string& region, const MachinesCalibrations& calibrations) {
  auto row = ResultOf(part_id, blade_serial, calibrations, SampleReconstruction());
  row.reconstruction_id = storage::NewUuid();
  row.registration_id = IdOf(registration);
  row.lattice = "lattice of " + region;
  row.lattice_sha256 = storage::Sha256Hex(row.lattice);
  row.regions.front().applied.region = region;
  const std::string name = "reconstructions/" + row.reconstruction_id;
  Must(storage::InsertReconstruction(transaction, row, EntryOfM1(name, {registration}, blade_serial)));
  return name;
}

std::string PutMachiningPass(storage::Transaction& transaction, const std::string& part_id,
                             const std::string& blade_serial, const std::string& registration,
                             const std::string& reconstruction, const MachinesCalibrations& calibrations) {
  auto row = ResultOf(part_id, blade_serial, calibrations, SampleMachiningPass());
  row.pass_id = storage::NewUuid();
  row.registration_id = IdOf(registration);
  row.correction_id = row.reconstruction_id = IdOf(reconstruction);
  const std::string name = "machining_passes/" + row.pass_id;
  storage::RecordEntry entry = EntryOfM1(name, {registration, reconstruction}, blade_serial);
  entry.kind = "machining_pass";
  Must(storage::InsertMachiningPass(transaction, row, entry));
  return name;
}

std::string PutRepair(storage::Transaction& transaction, const std::string& part_id, const std::string& blade_serial,
                      const std::string& registration, const MachinesCalibrations& calibrations) {
  auto row = ResultOf(part_id, blade_serial, calibrations, SampleRepair());
  row.repair_id = storage::NewUuid();
  row.registration_id = IdOf(registration);
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
  storage::AssessmentRow row = SampleAssessment();
  row.assessment_id = storage::NewUuid();
  row.blade_serial = blade_serial;
  row.part_id = part_id;
  row.drawing_id = IdOf(drawing);
  row.fate_reason = row.findings.front().name = "profile of " + word;
  row.results = {deviation};
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
  storage::MeasurementRow row = SampleMeasurement();
  row.measurement_id = storage::NewUuid();
  row.blade_serial = blade_serial;
  row.file.drawing_id = IdOf(drawing);
  row.file.part_id = part_id;
  row.file.instrument.serial_number = "instrument of " + blade_serial;
  row.left_out = {"left out of " + blade_serial};
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
