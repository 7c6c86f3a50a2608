#include <algorithm>
#include <map>
#include <utility>

#include "services/inspection/report_groups.h"
#include "services/inspection/report_of.h"
#include "services/inspection/stored_verdict.h"

namespace sixpoint::inspection {
namespace {

using GroupAndHole = std::pair<std::string, std::string>;

std::map<GroupAndHole, std::array<double, 3>> DrawnStarts(const plant::v1::Part& part) {
  std::map<GroupAndHole, std::array<double, 3>> starts;
  for (const plant::v1::HoleGroup& group : part.hole_groups())
    for (const plant::v1::Hole& hole : group.holes()) {
      const geometry::v1::Point& start = hole.start_in_part_mm();
      starts[{group.group(), hole.hole()}] = {start.x_mm(), start.y_mm(), start.z_mm()};
    }
  return starts;
}

double In_mm(double value, plant::v1::CharacteristicUnit unit) {
  return unit == plant::v1::CHARACTERISTIC_UNIT_UM ? value / 1e3 : value;
}

// What an assessment says of one hole.
struct HoleFindings {
  std::vector<exchange::MeasuredValue> verdicts;
  std::optional<double> position_limit_mm, inclination_limit_deg;
  std::string reason;
};

void Narrow(double limit, std::optional<double>* tightest) { *tightest = std::min(limit, tightest->value_or(limit)); }

void Take(const v1::CharacteristicFinding& finding, HoleFindings* of) {
  of->verdicts.emplace_back().verdict = FileVerdictOf(finding.verdict());
  if (of->reason.empty()) of->reason = finding.reason();
  if (!finding.has_upper_limit()) return;
  if (finding.quantity() == plant::v1::CHARACTERISTIC_QUANTITY_HOLE_POSITION)
    Narrow(In_mm(finding.upper_limit(), finding.unit()), &of->position_limit_mm);
  if (finding.quantity() == plant::v1::CHARACTERISTIC_QUANTITY_HOLE_INCLINATION)
    Narrow(finding.upper_limit(), &of->inclination_limit_deg);
}

// Of findings that rest on that inspection, or on none.
std::map<GroupAndHole, HoleFindings> FindingsOf(const v1::Assessment& assessment, const Balloons& balloons,
                                                const std::string& inspection) {
  std::map<GroupAndHole, HoleFindings> of;
  for (const v1::CharacteristicFinding& finding : assessment.findings()) {
    const auto drawn = balloons.find(finding.characteristic());
    if (drawn == balloons.end() || drawn->second->hole_group().empty()) continue;
    if (!finding.result().empty() && finding.result() != inspection) continue;
    const std::string& hole = finding.feature().empty() ? drawn->second->hole() : finding.feature();
    Take(finding, &of[{drawn->second->hole_group(), hole}]);
  }
  return of;
}

void SetMeasured(const v1::HoleResult& result, report::Hole* hole) {
  if (result.has_start_in_part_mm()) {
    const geometry::v1::Point& start = result.start_in_part_mm();
    const auto& drawn = hole->nominal_mm;
    hole->displacement_mm = {start.x_mm() - drawn[0], start.y_mm() - drawn[1], start.z_mm() - drawn[2]};
    if (result.has_position_expanded_uncertainty_um())
      hole->position_expanded_uncertainty_mm = result.position_expanded_uncertainty_um() / 1e3;
  }
  if (!result.has_inclination_error_deg()) return;
  hole->inclination_deg = result.inclination_error_deg();
  if (result.has_inclination_expanded_uncertainty_deg())
    hole->inclination_expanded_uncertainty_deg = result.inclination_expanded_uncertainty_deg();
}

// By the part's record, as the inspection judged it.
void Judge(const v1::HoleResult& result, report::Hole* hole) {
  hole->verdict = FileVerdictOf(result.verdict());
  hole->reason = result.reason();
  hole->position_limit_mm = result.position_tolerance_mm();
  hole->inclination_limit_deg = result.inclination_tolerance_deg();
}

// By the drawing.
void Judge(const HoleFindings& findings, report::Hole* hole) {
  const bool measured = hole->displacement_mm || hole->inclination_deg;
  hole->verdict = measured ? exchange::WorstOf(findings.verdicts) : report::Verdict::kNotMeasured;
  hole->reason = findings.reason;
  hole->position_limit_mm = findings.position_limit_mm;
  hole->inclination_limit_deg = findings.inclination_limit_deg;
}

}  // namespace

std::vector<report::Hole> ReportedHolesOf(const ReportInputs& inputs) {
  const auto starts = DrawnStarts(inputs.part);
  const Balloons balloons = BalloonsOf(inputs.drawing);
  std::vector<report::Hole> holes;
  for (std::size_t i = 0; i < inputs.inspections.size(); ++i) {
    const v1::Inspection& inspection = inputs.inspections[i];
    std::map<GroupAndHole, HoleFindings> findings;
    if (inputs.assessment) findings = FindingsOf(*inputs.assessment, balloons, inspection.name());
    for (const v1::HoleResult& result : inspection.holes()) {
      const auto start = starts.find({result.group(), result.hole()});
      if (start == starts.end()) continue;  // it has no drawn place to be shown at; its characteristics are told
      report::Hole& hole = holes.emplace_back();
      hole.id = result.group() + "/" + result.hole();
      if (inputs.inspections.size() > 1) hole.id += " (" + std::to_string(i + 1) + ")";
      hole.nominal_mm = start->second;
      SetMeasured(result, &hole);
      const auto found = findings.find({result.group(), result.hole()});
      hole.judged = !inputs.assessment || found != findings.end();
      if (!inputs.assessment) Judge(result, &hole);
      if (found != findings.end()) Judge(found->second, &hole);
      if (!hole.judged) hole.reason = result.reason();
    }
  }
  return holes;
}

}  // namespace sixpoint::inspection
