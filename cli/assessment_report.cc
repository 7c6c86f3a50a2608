#include "cli/assessment_report.h"

#include "cli/number_format.h"
#include "cli/output.h"
#include "cli/reports.h"
#include "refusal/message_text.h"

namespace sixpoint::cli {
namespace {

using inspection::v1::Assessment;
using inspection::v1::CharacteristicFinding;

std::string StageText(inspection::v1::AssessmentStage stage) {
  return EnumText(inspection::v1::AssessmentStage_Name(stage), "ASSESSMENT_STAGE_");
}

std::string FateText(const Assessment& assessment) {
  if (assessment.fate() == inspection::v1::BLANK_FATE_UNSPECIFIED) return "-";
  return EnumText(inspection::v1::BlankFate_Name(assessment.fate()), "BLANK_FATE_");
}

std::string UnitText(const CharacteristicFinding& finding) {
  return EnumText(plant::v1::CharacteristicUnit_Name(finding.unit()), "CHARACTERISTIC_UNIT_");
}

// Enough places that a micrometre and a thousandth of a degree are seen.
std::string NumberIn(const CharacteristicFinding& finding, bool known, double value) {
  if (!known) return "-";
  return Fixed(value, finding.unit() == plant::v1::CHARACTERISTIC_UNIT_UM ? 1 : 4);
}

std::string GroupsText(const Assessment& assessment) {
  Table table({"of", "verdict", ">conform", ">of"});
  for (const auto& group : assessment.groups())
    table.AddRow({group.group(), VerdictName(group.verdict()), std::to_string(group.conform_count()),
                  std::to_string(group.finding_count())});
  return table.ToText();
}

std::string OthersText(const CharacteristicFinding& finding) {
  std::string text;
  for (const auto& other : finding.others()) {
    if (!text.empty()) text += "; ";
    text += NumberIn(finding, true, other.value());
    if (other.has_expanded_uncertainty()) text += " +- " + NumberIn(finding, true, other.expanded_uncertainty());
    text += " by " + (other.method() == 0 ? other.result() : MethodText(other.method()));
  }
  return text.empty() ? "-" : text;
}

std::string CureText(const CharacteristicFinding& finding) {
  return finding.cure() == inspection::v1::CURE_UNSPECIFIED
             ? "-"
             : EnumText(inspection::v1::Cure_Name(finding.cure()), "CURE_");
}

std::string FindingsText(const Assessment& assessment) {
  const bool blank = assessment.fate() != inspection::v1::BLANK_FATE_UNSPECIFIED;
  Cells head = {"no.",  "name",   "at", "class",   ">nominal", ">lower", ">upper",
                "unit", ">value", ">U", "verdict", "rule",     "by",     "others"};
  if (blank) head.push_back("cure");
  head.push_back("reason");
  Table table(head);
  for (const CharacteristicFinding& one : assessment.findings()) {
    Cells cells = {one.characteristic(),
                   one.name(),
                   one.feature().empty() ? "-" : one.feature(),
                   EnumText(CharacteristicClass_Name(one.characteristic_class()), "CHARACTERISTIC_CLASS_"),
                   NumberIn(one, one.has_nominal(), one.nominal()),
                   NumberIn(one, one.has_lower_limit(), one.lower_limit()),
                   NumberIn(one, one.has_upper_limit(), one.upper_limit()),
                   UnitText(one),
                   NumberIn(one, one.has_value(), one.value()),
                   NumberIn(one, one.has_expanded_uncertainty(), one.expanded_uncertainty()),
                   VerdictName(one.verdict()),
                   RuleText(one.decision_rule()),
                   one.method() == 0 ? "-" : MethodText(one.method()),
                   OthersText(one)};
    if (blank) cells.push_back(CureText(one));
    cells.push_back(one.reason());
    table.AddRow(std::move(cells));
  }
  return table.ToText();
}

std::string ConflictsText(const Assessment& assessment) {
  if (assessment.conflicts().empty()) return "";
  Table table({"no rigid motion frees", "of", "limit", ">deviation um", ">U um", ">share %"});
  for (const auto& one : assessment.conflicts())
    table.AddRow(
        {"patch " + std::to_string(one.patch().patch()) + " at " + PointText(one.patch().centre_in_part_mm(), 2),
         one.characteristic(), one.above() ? "upper" : "lower", Fixed(one.patch().mean_um(), 1),
         Fixed(one.patch().expanded_uncertainty_um(), 1), Fixed(100 * one.share(), 1)});
  return table.ToText();
}

}  // namespace

std::string AssessmentText(const Assessment& assessment) {
  std::string head = assessment.name() + " of " + assessment.blade() + " by " + assessment.drawing() + ", " +
                     StageText(assessment.stage()) + ": " + VerdictName(assessment.verdict());
  if (assessment.fate() != inspection::v1::BLANK_FATE_UNSPECIFIED) {
    head += ", " + FateText(assessment);
    if (!assessment.fate_reason().empty()) head += "\n" + assessment.fate_reason();
  }
  std::string results;
  for (const std::string& result : assessment.results()) results += (results.empty() ? "from " : ", ") + result;
  return head + "\n" + results + "\n" + GroupsText(assessment) + FindingsText(assessment) + ConflictsText(assessment);
}

Cells AssessmentCells(const Assessment& assessment) {
  int conform = 0, count = 0;
  for (const auto& group : assessment.groups()) {
    conform += group.conform_count();
    count += group.finding_count();
  }
  return {IdText(assessment.name()),         IdText(assessment.blade()),
          IdText(assessment.drawing()),      StageText(assessment.stage()),
          VerdictName(assessment.verdict()), FateText(assessment),
          std::to_string(conform),           std::to_string(count),
          assessment.requested_by(),         TimeText(assessment.recorded_at())};
}

std::string AssessmentPlanText(const inspection::v1::AssessmentPlan& plan) {
  Table table({"order", "positioned by", "datums", "for characteristics"});
  for (const auto& order : plan.orders()) {
    std::string characteristics;
    for (const std::string& one : order.characteristics())
      characteristics += (characteristics.empty() ? "" : ", ") + one;
    const std::string what = order.has_inspect() ? "inspect, pins in the holes"
                             : order.has_map()
                                 ? "deviation map, " + std::to_string(order.map().profiles_size()) + " profiles"
                                 : "section measure, " + std::to_string(order.sections().sections_size()) + " sections";
    table.AddRow(
        {what, MethodText(order.method()), order.datum_system().empty() ? "-" : order.datum_system(), characteristics});
  }
  std::string text = plan.drawing() + "\n" + table.ToText();
  std::string elsewhere;
  for (const std::string& one : plan.measured_elsewhere()) elsewhere += (elsewhere.empty() ? "" : ", ") + one;
  return elsewhere.empty() ? text : text + "by other instruments: " + elsewhere + "\n";
}

}  // namespace sixpoint::cli
