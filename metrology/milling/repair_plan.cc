#include "metrology/milling/repair_plan.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "metrology/milling/removal.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kRemovalDepth_mm =
    0.25;                               // so far below the surface removal is followed: less than half of a thin edge
constexpr double kMostLean_rad = 1e-3;  // of a place that is left out, off the way between those that are kept
constexpr double kLeastSeenOfWeld = 0.9;
constexpr double kMostContours = 2000, kMostLaps = 10'000, kMostPlaces = 3e6;  // places: a hundred bytes each

// Of a place beside the straight way between two others: where the way passes it, and how the axis stands there.
struct OnWay {
  Vector3d centre_mm, axis;
};
OnWay BesideWay(const ToolPlace& from, const ToolPlace& to, const ToolPlace& between) {
  const Vector3d way = to.centre_mm - from.centre_mm;
  const double part = std::clamp((between.centre_mm - from.centre_mm).dot(way) / way.squaredNorm(), 0.0, 1.0);
  return {from.centre_mm + part * way, ((1 - part) * from.axis + part * to.axis).normalized()};
}

bool IsOnWay(const ToolPlace& from, const ToolPlace& to, const ToolPlace& between, double chord_mm) {
  const OnWay on = BesideWay(from, to, between);
  return (on.centre_mm - between.centre_mm).norm() <= chord_mm && on.axis.cross(between.axis).norm() <= kMostLean_rad;
}

std::vector<Dexel> DexelsBelow(const GuardedSurface& guard) {
  std::vector<Dexel> dexels;
  for (std::size_t q = 0; q < guard.points_mm.size(); ++q) dexels.push_back({guard.points_mm[q], guard.normals[q], 0});
  return dexels;
}

std::vector<Dexel> DexelsOn(const TargetSection& section, const Vector2d& origin_mm, double top_mm) {
  std::vector<Dexel> dexels;
  for (const OutlineNode& node : section.outline.nodes()) {
    const Vector2d point = node.point_mm + origin_mm;
    dexels.push_back({{point.x(), point.y(), section.z_mm}, {node.normal.x(), node.normal.y(), 0}, top_mm});
  }
  return dexels;
}

SimulatedRemoval Simulate(const RepairPlan& plan, const GuardedSurface& guard, const RepairOptions& options) {
  const int threads = options.stack.thread_count;
  const std::vector<Dexel> below = DexelsBelow(guard);
  SimulatedRemoval out;
  out.place_count_below = below.size();
  for (const double top_mm : Remove(below, plan.path, options.path.mill, kRemovalDepth_mm, threads).top_mm)
    out.deepest_below_mm = std::max(out.deepest_below_mm, -top_mm);
  std::vector<Dexel> above;
  for (const TargetSection& section : plan.target.sections) {
    const std::vector<Dexel> on = DexelsOn(section, options.stack.origin_mm, plan.stock_mm);
    above.insert(above.end(), on.begin(), on.end());
  }
  const std::vector<double> top_mm = Remove(above, plan.path, options.path.mill, kRemovalDepth_mm, threads).top_mm;
  auto next = top_mm.begin();
  for (const TargetSection& section : plan.target.sections) {
    std::vector<double>& rest_mm = out.rest_mm.emplace_back();
    for (const double standard_mm : section.standard_mm) {
      const double rest = *next++;
      rest_mm.push_back(rest);
      out.greatest_rest_mm = std::max(out.greatest_rest_mm, rest);
      out.mean_rest_mm += rest / static_cast<double>(top_mm.size());
      out.deepest_in_target_mm = std::max(out.deepest_in_target_mm, -rest);
      out.deepest_beyond_uncertainty_mm =
          std::max(out.deepest_beyond_uncertainty_mm, -rest - kTargetCoverage * standard_mm);
    }
  }
  return out;
}

// Where it is too uncertain it may as well fold: nothing is asked of its form before.
absl::Status CheckCertain(const std::vector<TargetSection>& target, const RepairOptions& options) {
  double worst_mm = 0, at_mm = 0;
  for (const TargetSection& section : target)
    for (const double standard_mm : section.standard_mm)
      if (const double expanded_mm = kTargetCoverage * standard_mm; !(expanded_mm <= worst_mm))
        worst_mm = expanded_mm, at_mm = section.z_mm;
  if (worst_mm <= options.greatest_uncertainty_mm) return absl::OkStatus();
  return Refuse("target", "uncertain by " + Rounded(1e3 * worst_mm) + " um at " + Rounded(at_mm) + " mm",
                "at most " + Rounded(1e3 * options.greatest_uncertainty_mm) +
                    " um: less of it, more of the blade below the line, or more that is allowed");
}

// Laps, and their places before they are thinned, before any of them is made.
absl::Status CheckPlaces(const RepairPlan& plan, const RepairOptions& options) {
  const double layers = std::ceil(plan.stock_mm / options.path.depth_of_cut_mm) + 1;
  double places = 0;
  for (const TargetSection& section : plan.target.sections)
    places += layers * (section.outline.length_mm() / kPlaceSpacing_mm + static_cast<double>(section.outline.size()));
  if (layers * static_cast<double>(plan.target.sections.size()) <= kMostLaps && places <= kMostPlaces)
    return absl::OkStatus();
  return Refuse("depth_of_cut_mm", options.path.depth_of_cut_mm,
                "so thick that there are at most 10000 laps of 3 million places; or a higher scallop");
}

absl::Status Gone() { return absl::CancelledError("repair: the client went away"); }

}  // namespace

absl::Status CheckRepair(const RepairOptions& options) {
  Refusals refusals;
  if (options.stack.surface == nullptr) refusals.Add(Refuse("surface", "none", "the drawing's"));
  if (!(options.guard_mm >= 0 && options.guard_mm <= options.path.mill.radius_mm))
    refusals.Add(Refuse("guard_mm", options.guard_mm, "0 to the mill's radius"));
  if (!(options.chord_mm > 0 && options.chord_mm <= 0.1))
    refusals.Add(Refuse("chord_mm", options.chord_mm, "above 0, at most 0.1"));
  if (!(options.greatest_turn_rad > 0 && options.greatest_turn_rad <= 0.2))
    refusals.Add(Refuse("greatest_turn_rad", options.greatest_turn_rad, "above 0, at most 0.2"));
  const auto step_mm = StepOverFor(options.scallop_mm, options.path.mill.radius_mm);
  const SectionHeights& heights = options.stack.heights;
  if (!step_mm)
    refusals.Add(Refuse("scallop_mm", options.scallop_mm, "above 0, below the mill's radius"));
  else if (!(heights.target_mm - heights.cutoff_mm <= kMostContours * *step_mm))
    refusals.Add(Refuse("scallop_mm", options.scallop_mm, "so high that there are at most 2000 finishing laps"));
  refusals.Add(CheckHeights(options.stack.heights));
  return refusals.status();
}

std::vector<ToolPlace> Thinned(const std::vector<ToolPlace>& places, double chord_mm, double greatest_turn_rad) {
  const std::size_t count = places.size();
  const auto at = [&](std::size_t i) -> const ToolPlace& { return places[i % count]; };
  const auto reaches = [&](std::size_t from, std::size_t to) {
    if (at(from).axis.dot(at(to).axis) < std::cos(greatest_turn_rad)) return false;
    for (std::size_t between = from + 1; between < to; ++between)
      if (!IsOnWay(at(from), at(to), at(between), chord_mm)) return false;
    return true;
  };
  std::vector<std::size_t> kept;
  for (std::size_t from = 0; from < count;) {
    kept.push_back(from);
    std::size_t to = from + 1;
    while (to < count && reaches(from, to + 1)) ++to;
    from = to;
  }
  // A straight way past a convex wall lies nearer to it than the places did: both its ends go out by that.
  std::vector<double> out_mm(kept.size(), 0);
  for (std::size_t k = 0; k < kept.size(); ++k) {
    const std::size_t next = (k + 1) % kept.size(), end = next == 0 ? count : kept[next];
    double nearer_mm = 0;
    for (std::size_t between = kept[k] + 1; between < end; ++between) {
      const Vector3d passed_mm = BesideWay(at(kept[k]), at(end), at(between)).centre_mm;
      nearer_mm = std::max(nearer_mm, (at(between).centre_mm - passed_mm).dot(at(between).normal));
    }
    for (const std::size_t one : {k, next}) out_mm[one] = std::max(out_mm[one], nearer_mm);
  }
  std::vector<ToolPlace> thinned;
  for (std::size_t k = 0; k < kept.size(); ++k) {
    ToolPlace& place = thinned.emplace_back(places[kept[k]]);
    place.lifted_mm += out_mm[k];
    place.centre_mm += out_mm[k] * place.normal;
  }
  return thinned;
}

double Length_mm(const std::vector<ToolPlace>& places) {
  double length_mm = 0;
  for (std::size_t i = 0; i < places.size(); ++i)
    length_mm += (places[(i + 1) % places.size()].centre_mm - places[i].centre_mm).norm();
  return length_mm;
}

absl::StatusOr<RepairPlan> PlanRepair(const Points& points_mm, const RepairOptions& options) {
  if (absl::Status good = CheckRepair(options); !good.ok()) return good;
  const auto going = [&] { return !options.keep_going || options.keep_going(); };
  const StackOptions& stack = options.stack;
  const int threads = stack.thread_count;
  RepairPlan plan;
  plan.origin_mm = stack.origin_mm;
  auto measured = MeasureSections(points_mm, stack);
  if (!measured.ok()) return measured.status();
  plan.measured = *std::move(measured);
  if (!going()) return Gone();
  plan.step_over_mm = *StepOverFor(options.scallop_mm, options.path.mill.radius_mm);
  const std::vector<double> laps_mm = PassHeights(stack.heights.cutoff_mm, stack.heights.target_mm, plan.step_over_mm);
  plan.step_over_mm = laps_mm[1] - laps_mm[0];
  const auto nominal = NominalSections(*stack.surface, MeasuredHeights(stack.heights, stack.half_width_mm), stack);
  if (!nominal.ok()) return Under("surface.", nominal.status());
  const auto asked = NominalSections(*stack.surface, laps_mm, stack);
  if (!asked.ok()) return Under("surface.", asked.status());
  if (!going()) return Gone();
  auto target = Extrapolate(plan.measured.sections, *nominal, *asked, options.extrapolation, threads);
  if (!target.ok()) return target.status();
  plan.target = *std::move(target);
  if (absl::Status certain = CheckCertain(plan.target.sections, options); !certain.ok()) return certain;
  const WeldStock weld = WeldStockOf(plan.target.sections, stack.origin_mm, points_mm);
  if (!(weld.seen_part >= kLeastSeenOfWeld))
    return Refuse("weld", Rounded(100 * weld.seen_part) + " % of it seen",
                  "at least 90: where it was not seen, nobody knows how much the mill would take at once");
  plan.stock_mm = weld.greatest_mm;
  if (absl::Status few = CheckPlaces(plan, options); !few.ok()) return few;
  const GuardedSurface guard = GuardBelow(plan.measured.sections, plan.target.sections.front(), stack.origin_mm,
                                          options.path.mill.radius_mm, options.guard_mm);
  if (!going()) return Gone();
  auto path = PlanPath(plan.target.sections, stack.origin_mm, plan.stock_mm, guard, options.path, threads);
  if (!path.ok()) return path.status();
  plan.path = *std::move(path);
  for (RecontourPass& pass : plan.path.passes)
    pass.places = Thinned(pass.places, options.chord_mm, options.greatest_turn_rad);
  if (!going()) return Gone();
  plan.removal = Simulate(plan, guard, options);
  if (plan.removal.deepest_below_mm > kDeepestBelowLine_mm)
    return Refuse("path", "cuts " + Rounded(1e3 * plan.removal.deepest_below_mm) + " um below the repair line",
                  "at most 1: a mill that leans away from the wall, a thinner one, or a greater guard");
  if (plan.removal.deepest_beyond_uncertainty_mm > kDeepestBeyondUncertainty_mm)
    return Refuse("path",
                  "cuts " + Rounded(1e3 * plan.removal.deepest_beyond_uncertainty_mm) +
                      " um into the target, beyond its uncertainty",
                  "at most 1: a mill that leans away from the wall, or a thinner one");
  return plan;
}

}  // namespace sixpoint::metrology
