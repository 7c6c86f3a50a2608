#include "services/inspection/report_words.h"

#include <algorithm>
#include <cctype>

#include "report/number_text.h"

namespace sixpoint::inspection {

std::string WordsOf(const std::string& name, const std::string& prefix) {
  std::string words = name.rfind(prefix, 0) == 0 ? name.substr(prefix.size()) : name;
  std::transform(words.begin(), words.end(), words.begin(),
                 [](unsigned char c) { return c == '_' ? ' ' : static_cast<char>(std::tolower(c)); });
  return words;
}

std::string Joined(const std::string& one, const std::string& other) {
  return one.empty() || other.empty() ? one + other : one + "; " + other;
}

std::string FitStateOf(registration::v1::Method method) {
  switch (method) {
    case registration::v1::METHOD_BEST_FIT:
      return "best fit of the whole surface";
    case registration::v1::METHOD_LOCAL:
      return "best fit of a region";
    case registration::v1::METHOD_SIX_POINT:
      return "six datum points, least squares";
    case registration::v1::METHOD_SIX_POINT_NORMALS:
      return "six datum points, exactly (3-2-1)";
    case registration::v1::METHOD_ALLOWANCE:
      return "inside its blank";
    default:
      return "";
  }
}

std::string FitStateOf(const plant::v1::Drawing& drawing, const plant::v1::Characteristic& drawn,
                       registration::v1::Method method) {
  if (drawn.datum_system().empty()) return FitStateOf(method);
  for (const plant::v1::DatumSystem& system : drawing.datum_systems()) {
    if (system.datum_system() != drawn.datum_system()) continue;
    // Value by value the same (DatumPositioning).
    const std::string state = FitStateOf(static_cast<registration::v1::Method>(system.positioning()));
    return drawn.datum_system() + ": " + state + (system.region().empty() ? "" : " " + system.region());
  }
  return drawn.datum_system();
}

std::string RuleText(const plant::v1::DecisionRule& rule) {
  switch (rule.kind()) {
    case plant::v1::DECISION_RULE_KIND_ISO_14253_1:
      // Only the edition of 2017 asks for a probability.
      return "ISO 14253-1:" + rule.edition() +
             (rule.edition() == "2017" ? ": conform where the value is inside its limits with 95 % probability"
                                       : ": conform where the value is inside its limits by U (95 %)");
    case plant::v1::DECISION_RULE_KIND_SIMPLE_ACCEPTANCE:
      return "simple acceptance: conform where the value is within its limits, whatever U";
    case plant::v1::DECISION_RULE_KIND_GUARD_FACTOR:
      return "guard band: conform where the value is inside its limits by " + report::Shortest(rule.guard_factor()) +
             " U (95 %)";
    default:
      return "";
  }
}

std::string UnitOf(plant::v1::CharacteristicUnit unit) {
  return unit == plant::v1::CHARACTERISTIC_UNIT_MM    ? "mm"
         : unit == plant::v1::CHARACTERISTIC_UNIT_UM  ? "um"
         : unit == plant::v1::CHARACTERISTIC_UNIT_DEG ? "deg"
                                                      : "";
}

std::string UnitOf(v1::SectionUnit unit) {
  return unit == v1::SECTION_UNIT_MM ? "mm" : unit == v1::SECTION_UNIT_DEG ? "deg" : "";
}

std::string DesignatorOf(const plant::v1::Characteristic& drawn) {
  std::string designator = drawn.characteristic_class() == plant::v1::CHARACTERISTIC_CLASS_CRITICAL ? "CRITICAL"
                           : drawn.characteristic_class() == plant::v1::CHARACTERISTIC_CLASS_MAJOR  ? "MAJOR"
                                                                                                    : "";
  if (drawn.designator().empty()) return designator;
  return designator.empty() ? drawn.designator() : designator + ", " + drawn.designator();
}

}  // namespace sixpoint::inspection
