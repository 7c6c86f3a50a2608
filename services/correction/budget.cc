#include "services/correction/budget.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "metrology/correction/path_draws.h"
#include "services/runtime/errors.h"

namespace sixpoint::correction {
namespace {

constexpr int kUsualDraws = 10'000, kMostDraws = 200'000, kMostDrawnHoles = 10'000'000, kThreads = 2;

absl::Status CheckDraws(int draws) {
  if (draws >= metrology::kLeastDraws && draws <= kMostDraws) return absl::OkStatus();
  return runtime::Refuse("draws", std::to_string(draws), "0, or 1000 to " + std::to_string(kMostDraws));
}

// holes: that each draw solves.
absl::Status CheckWork(int draws, std::size_t holes) {
  if (static_cast<std::size_t>(draws) * holes <= kMostDrawnHoles) return absl::OkStatus();
  return runtime::Refuse("draws", std::to_string(draws) + " of " + std::to_string(holes) + " holes",
                         "at most " + std::to_string(kMostDrawnHoles / std::max<std::size_t>(1, holes)));
}

v1::HoleBudget FirstOrder(const std::string& group, const std::string& name, const metrology::CorrectedHole& hole,
                          double position_tolerance_mm) {
  v1::HoleBudget budget;
  budget.set_group(group);
  budget.set_hole(name);
  budget.set_expanded_uncertainty_um(hole.expanded_uncertainty_um);
  budget.set_position_tolerance_um(1e3 * position_tolerance_mm);
  double sum_um2 = 0;
  for (const metrology::UncertaintyComponent& component : hole.components) sum_um2 += component.variance;
  for (const metrology::UncertaintyComponent& component : hole.components) {
    v1::BudgetLine& line = *budget.add_lines();
    line.set_source(component.source);
    line.set_standard_uncertainty_um(std::sqrt(component.variance));
    line.set_share(component.variance / sum_um2);
    if (std::isfinite(component.degrees_of_freedom)) line.set_degrees_of_freedom(component.degrees_of_freedom);
  }
  return budget;
}

void AddDraws(const metrology::DrawnStart& drawn, v1::HoleBudget* budget) {
  budget->set_drawn_expanded_uncertainty_um(drawn.expanded_uncertainty_um);
  budget->set_drawn_low_um(drawn.low_um);
  budget->set_drawn_high_um(drawn.high_um);
  std::map<std::string, double> by_source;
  for (const metrology::DrawnComponent& component : drawn.components) by_source[component.source] = component.rms_um;
  for (v1::BudgetLine& line : *budget->mutable_lines())
    if (const auto found = by_source.find(line.source()); found != by_source.end())
      line.set_drawn_standard_uncertainty_um(found->second);
}

}  // namespace

absl::StatusOr<v1::Budget> BudgetOf(const Inputs& inputs, int draws, const std::function<bool()>& keep_going) {
  metrology::DrawOptions options;
  options.count = draws == 0 ? kUsualDraws : draws;
  options.threads = kThreads;
  options.keep_going = keep_going;
  if (absl::Status taken = CheckDraws(options.count); !taken.ok()) return taken;
  std::vector<CorrectedPath> paths;
  std::size_t holes = 0;  // that a draw solves: of a path its poses
  for (const metrology::NominalHoleGroup& group : inputs.groups) holes += group.holes.size();
  for (const ModelPath& path : inputs.paths) {
    auto corrected = CorrectPath(inputs, path, keep_going);
    if (!corrected.ok()) return corrected.status();
    holes += metrology::PosesPerDraw(corrected->path, corrected->WorstPose());
    paths.push_back(*std::move(corrected));
  }
  if (absl::Status taken = CheckWork(options.count, holes); !taken.ok()) return taken;
  v1::Budget budget;
  budget.set_draws(options.count);
  for (const metrology::NominalHoleGroup& group : inputs.groups) {
    const auto corrected =
        metrology::CorrectGroup(group, *inputs.pose, inputs.zero_from_part_nominal, inputs.rotation.axes,
                                inputs.machine_axes.nominal, inputs.machine_axes.limits, inputs.drilling);
    if (!corrected.ok()) return corrected.status();
    const auto drawn =
        metrology::DrawStarts(group, *corrected, *inputs.pose, inputs.rotation.axes, inputs.drilling, options);
    if (!drawn.ok()) return drawn.status();
    for (std::size_t i = 0; i < group.holes.size(); ++i) {
      v1::HoleBudget& hole = *budget.add_holes();
      hole = FirstOrder(group.name, group.holes[i].name, corrected->holes[i], group.position_tolerance_mm);
      AddDraws((*drawn)[i], &hole);
    }
  }
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const ModelPath& of = inputs.paths[i];
    const metrology::DrawnPath way{of.nominal,
                                   paths[i].path,
                                   *inputs.pose,
                                   inputs.rotation.axes,
                                   of.steps,
                                   inputs.drilling,
                                   inputs.machine_axes.letters};
    const auto drawn = metrology::DrawPose(way, paths[i].WorstPose(), options);
    if (!drawn.ok()) return drawn.status();
    v1::HoleBudget& hole = *budget.add_holes();
    hole = FirstOrder(of.nominal.name, of.nominal.name, paths[i].WorstStart(), of.nominal.position_tolerance_mm);
    AddDraws(*drawn, &hole);
  }
  return budget;
}

}  // namespace sixpoint::correction
