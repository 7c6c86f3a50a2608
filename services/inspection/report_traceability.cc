#include <algorithm>
#include <utility>

#include "services/inspection/report_groups.h"
#include "services/inspection/report_of.h"
#include "services/inspection/report_words.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::inspection {
namespace {

using report::Budget;

// Each once, in their order.
class Enumeration {
 public:
  explicit Enumeration(std::string between) : between_(std::move(between)) {}
  void Add(const std::string& text) {
    if (text.empty() || std::find(all_.begin(), all_.end(), text) != all_.end()) return;
    all_.push_back(text);
  }
  std::string text() const {
    std::string text;
    for (const std::string& one : all_) text += (text.empty() ? "" : between_) + one;
    return text;
  }

 private:
  std::string between_;
  std::vector<std::string> all_;
};

bool RestsOn(const registration::v1::Registration& registration, const std::string& calibration) {
  return registration.sensor_calibration() == calibration || registration.rotation_calibration() == calibration ||
         std::any_of(registration.angles().begin(), registration.angles().end(),
                     [&](const registration::v1::ScanAngle& angle) { return angle.characterisation() == calibration; });
}

// Not whether it is in force now: the same record is told the same later.
std::string StateOf(const calibration::v1::Calibration& calibration, const ReportInputs& inputs) {
  if (calibration.has_withdrawal()) return "withdrawn: " + calibration.withdrawal().reason();
  if (calibration.state() == calibration::v1::CALIBRATION_STATE_DRAFT) return "draft";
  for (const registration::v1::Registration& registration : inputs.registrations) {
    if (!RestsOn(registration, calibration.name())) continue;
    const auto at = runtime::MomentOf(registration.has_scans_received_at() ? registration.scans_received_at()
                                                                           : registration.recorded_at());
    if (calibration.has_valid_from() && at < runtime::MomentOf(calibration.valid_from()))
      return "not valid yet when the scans came";
    if (calibration.has_valid_until() && at >= runtime::MomentOf(calibration.valid_until()))
      return "not valid any more when the scans came";
  }
  return "valid when the scans came";
}

report::CalibrationUsed UsedOf(const calibration::v1::Calibration& calibration, const ReportInputs& inputs) {
  report::CalibrationUsed used;
  used.name = calibration.name();
  used.kind = WordsOf(calibration::v1::CalibrationKind_Name(calibration.kind()), "CALIBRATION_KIND_");
  if (calibration.has_axis()) used.kind += " " + calibration.axis().axis();
  used.state = StateOf(calibration, inputs);
  if (calibration.has_valid_from()) used.valid_from = runtime::MomentOf(calibration.valid_from());
  if (calibration.has_valid_until()) used.valid_until = runtime::MomentOf(calibration.valid_until());
  return used;
}

report::ScanUsed UsedOf(const ingest::v1::Scan& scan) {
  report::ScanUsed used;
  used.name = scan.name();
  used.sha256 = scan.sha256();
  if (scan.has_received_at()) used.received_at = runtime::MomentOf(scan.received_at());
  if (scan.header().point_count() > 0) used.point_count = scan.header().point_count();
  return used;
}

report::InstrumentUsed UsedOf(const v1::Measurement& measurement) {
  report::InstrumentUsed used;
  used.name = NameOf(measurement.instrument());
  used.certificate = measurement.instrument().certificate();
  used.measurement = measurement.name();
  used.file_sha256 = measurement.file_sha256();
  if (measurement.has_measured_at()) used.measured_at = runtime::MomentOf(measurement.measured_at());
  return used;
}

Budget BudgetOf(const std::string& of,
                const google::protobuf::RepeatedPtrField<uncertainty::v1::UncertaintyComponent>& components) {
  Budget budget{of, "um", {}, std::nullopt};
  for (const uncertainty::v1::UncertaintyComponent& component : components)
    budget.lines.push_back({component.source(), component.standard_uncertainty_um(), std::nullopt});
  return budget;
}

// Of the hole that takes most of its position's tolerance.
void AddBudgetOf(const v1::Inspection& inspection, std::vector<Budget>* budgets) {
  const v1::HoleResult* worst = nullptr;
  double greatest = -1;
  for (const v1::HoleResult& hole : inspection.holes()) {
    if (!hole.has_position_error_mm() || hole.budget().empty() || !(hole.position_tolerance_mm() > 0)) continue;
    const double share = hole.position_error_mm() / hole.position_tolerance_mm();
    if (share > greatest) greatest = share, worst = &hole;
  }
  if (worst == nullptr) return;
  Budget& budget = budgets->emplace_back(BudgetOf(worst->group() + "/" + worst->hole() + "/position", worst->budget()));
  if (worst->has_position_expanded_uncertainty_um())
    budget.expanded_uncertainty = worst->position_expanded_uncertainty_um();
}

// Of its first section whose chord was measured.
void AddBudgetOf(const v1::SectionMeasurement& measurement, std::vector<Budget>* budgets) {
  for (const v1::Section& section : measurement.sections())
    for (const v1::SectionValue& value : section.values()) {
      if (value.parameter() != v1::SECTION_PARAMETER_CHORD_NOSE_TAIL || !value.has_value()) continue;
      Budget budget{section.plane().section() + ": chord nose tail", UnitOf(value.unit()), {}, std::nullopt};
      if (value.has_by_noise()) budget.lines.push_back({"noise of the points", value.by_noise(), std::nullopt});
      if (value.has_by_form()) budget.lines.push_back({"how the outline wavers", value.by_form(), std::nullopt});
      if (value.has_by_pose()) budget.lines.push_back({"pose and mapping", value.by_pose(), std::nullopt});
      if (value.has_expanded_uncertainty()) budget.expanded_uncertainty = value.expanded_uncertainty();
      if (!budget.lines.empty()) budgets->push_back(std::move(budget));
      return;
    }
}

std::vector<Budget> BudgetsOf(const ReportInputs& inputs) {
  std::vector<Budget> budgets;
  for (const v1::Inspection& inspection : inputs.inspections) AddBudgetOf(inspection, &budgets);
  for (const v1::DeviationMap& map : inputs.maps)
    if (!map.budget().empty())
      budgets.push_back(BudgetOf("a patch's mean deviation, over the surface that was seen", map.budget()));
  for (const v1::SectionMeasurement& measurement : inputs.sections) AddBudgetOf(measurement, &budgets);
  return budgets;
}

void SetWho(const ReportInputs& inputs, report::Traceability* out) {
  Enumeration machines("; "), sensors("; ");
  for (const plant::v1::Machine& machine : inputs.machines) {
    machines.Add(runtime::LastSegment(machine.name()) + ", revision " + std::to_string(machine.revision()));
    const plant::v1::Sensor& sensor = machine.sensor();
    sensors.Add(sensor.model() + (sensor.serial_number().empty() ? "" : ", serial number " + sensor.serial_number()));
  }
  out->machine = machines.text();
  out->sensor = sensors.text();
}

}  // namespace

report::Traceability TraceabilityOf(const ReportInputs& inputs) {
  report::Traceability out;
  SetWho(inputs, &out);
  Enumeration methods(", "), states("; "), asked(", "), judged_by(", "), registered_by(", "), computed_on("; ");
  if (inputs.assessment) {
    out.results.push_back(inputs.assessment->name());
    asked.Add(inputs.assessment->requested_by());
    judged_by.Add(inputs.assessment->software_version());
    computed_on.Add(inputs.assessment->computed_on());
  }
  for (const ResultHead& head : HeadsOf(inputs)) {
    out.results.push_back(head.name);
    methods.Add(WordsOf(registration::v1::Method_Name(head.method), "METHOD_"));
    states.Add(FitStateOf(head.method));
    asked.Add(head.requested_by);
    judged_by.Add(head.software_version);
    computed_on.Add(head.computed_on);
  }
  for (const registration::v1::Registration& registration : inputs.registrations) {
    out.registrations.push_back(registration.name());
    registered_by.Add(registration.software_version());
  }
  out.method = methods.text();
  out.fit_state = states.text();
  out.requested_by = asked.text();
  for (const auto& [name, text] :
       {std::pair("Software, inspection", judged_by.text()), std::pair("Software, registration", registered_by.text()),
        std::pair("Computed on", computed_on.text())})
    if (!text.empty()) out.software.push_back({name, text});
  for (const calibration::v1::Calibration& calibration : inputs.calibrations)
    out.calibrations.push_back(UsedOf(calibration, inputs));
  for (const ingest::v1::Scan& scan : inputs.scans) out.scans.push_back(UsedOf(scan));
  for (const v1::Measurement& measurement : inputs.measurements) out.instruments.push_back(UsedOf(measurement));
  out.budgets = BudgetsOf(inputs);
  return out;
}

}  // namespace sixpoint::inspection
