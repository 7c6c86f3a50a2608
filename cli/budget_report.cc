#include "cli/budget_report.h"

#include <algorithm>

#include "cli/number_format.h"
#include "cli/table.h"

namespace sixpoint::cli {

absl::StatusOr<std::string> BudgetText(const std::string& result, const std::string& hole,
                                       const std::vector<HoleBudget>& holes) {
  const auto found =
      hole.empty() ? std::max_element(holes.begin(), holes.end(),
                                      [](const HoleBudget& one, const HoleBudget& other) {
                                        return one.expanded_uncertainty_um < other.expanded_uncertainty_um;
                                      })
                   : std::find_if(holes.begin(), holes.end(), [&](const HoleBudget& one) { return one.hole == hole; });
  if (found == holes.end() && !hole.empty())
    return Refuse("--hole", hole, "a hole of " + result + " such as " + (holes.empty() ? "G1/H3" : holes.front().hole));
  if (found == holes.end() || found->components.empty())
    return absl::FailedPreconditionError(result +
                                         ": has no budget: it was made before one was kept, or nothing was measured");
  Table table({"source", ">u um", ">share %"});
  for (const auto& one : found->components)
    table.AddRow({one.source(), Fixed(one.standard_uncertainty_um(), 3), Fixed(100 * one.share(), 1)});
  return result + ", " + found->hole + ": U95 " + Fixed(found->expanded_uncertainty_um, 2) + " um (k = 1 below)\n" +
         table.ToText();
}

nlohmann::json BudgetJson(const std::string& hole, const std::vector<HoleBudget>& holes) {
  nlohmann::json out = nlohmann::json::object();
  for (const HoleBudget& one : holes) {
    if (!hole.empty() && one.hole != hole) continue;
    nlohmann::json& sources = out[one.hole] = nlohmann::json::object();
    for (const auto& component : one.components) sources[component.source()] = component.standard_uncertainty_um();
  }
  return out;
}

}  // namespace sixpoint::cli
