#include "bench/repair/milled_blade.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>

#include "metrology/milling/removal.h"
#include "metrology/milling/repair_plan.h"

namespace sixpoint::bench {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using metrology::BladeSection;
using metrology::NormalMethod;

constexpr std::uint64_t kSeed = 4;
constexpr double kKept = 0.8;
constexpr double kScallop_mm = 0.005;
constexpr double kWeld_mm = 1.2;              // of the weld, over the true surface
constexpr double kOutlineExpanded_mm = 3e-3;  // of the measured outlines: what the guard keeps clear
constexpr double kDepth_mm = 0.25;            // of the dexels: less than half of the blade's thinnest end
constexpr double kNearLine_mm = 8;            // below the line: so far dexels stand

template <typename Work>
double Seconds(const Work& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

// Dexels on an outline, about so far apart; with the expanded uncertainty there, the less of both nodes beside it, where the outline has one.
void StandOn(const metrology::Outline& outline, double z_mm, const Vector2d& origin_mm, double top_mm,
             std::vector<metrology::Dexel>* dexels, const std::vector<double>* standard_mm = nullptr,
             std::vector<double>* expanded_mm = nullptr) {
  for (double at_mm = 0; at_mm < outline.length_mm(); at_mm += 0.15) {
    const metrology::OutlinePlace place = outline.PlaceAt(at_mm);
    const Vector2d point = outline.PointAt(place) + origin_mm, normal = outline.NormalAt(place);
    dexels->push_back({{point.x(), point.y(), z_mm}, {normal.x(), normal.y(), 0}, top_mm});
    if (expanded_mm == nullptr) continue;
    const std::size_t next = outline.Next(place.node);
    expanded_mm->push_back(metrology::kTargetCoverage * std::min((*standard_mm)[place.node], (*standard_mm)[next]));
  }
}

struct Judged {
  double gouge_mm = 0, rest_mm = 0, mean_rest_mm = 0;
  double beyond_mm = 0;  // of a gouge, what is more than the place is uncertain by
  std::size_t touched = 0, count = 0;
};

Judged JudgedBy(const std::vector<metrology::Dexel>& dexels, const metrology::RecontourPath& path,
                const metrology::BallMill& mill, int thread_count, const std::vector<double>& expanded_mm = {}) {
  const metrology::Removal removal = Remove(dexels, path, mill, kDepth_mm, thread_count);
  Judged judged;
  judged.touched = removal.touched_count;
  judged.count = dexels.size();
  for (std::size_t i = 0; i < expanded_mm.size(); ++i)
    judged.beyond_mm = std::max(judged.beyond_mm, -removal.top_mm[i] - expanded_mm[i]);
  for (const double top_mm : removal.top_mm) {
    judged.gouge_mm = std::max(judged.gouge_mm, -top_mm);
    judged.rest_mm = std::max(judged.rest_mm, top_mm);
    judged.mean_rest_mm += top_mm / static_cast<double>(dexels.size());
  }
  return judged;
}

struct Planned {
  std::vector<BladeSection> measured;
  metrology::Extrapolation target;
  metrology::GuardedSurface guard;
  double stock_mm = 0;
};

// What paths by either kind of normals, with and without the guard, remove of the true blade and of the weld over the target.
void RunRemoval(const NominalBlade& nominal, const BladeWorld& world, const metrology::StackOptions& options,
                const std::vector<BladeSection>& asked, const Planned& planned,
                const metrology::PathOptions& path_options, const metrology::RepairPlan& whole,
                nlohmann::json* figures) {
  const int thread_count = options.thread_count;
  std::vector<metrology::Dexel> under, over;
  std::vector<double> expanded_mm;  // of those over
  for (double z_mm = options.heights.cutoff_mm - kNearLine_mm; z_mm < options.heights.cutoff_mm; z_mm += 0.5) {
    // Denser towards the line, where a ball could reach under it.
    const double left_mm = options.heights.cutoff_mm - z_mm;
    const std::vector<double> here = left_mm > 1
                                         ? std::vector<double>{z_mm}
                                         : std::vector<double>{z_mm, z_mm + 0.1, z_mm + 0.2, z_mm + 0.3, z_mm + 0.4};
    const auto cut = NominalSections(*nominal.surface, here, options);
    for (const BladeSection& section : *cut)
      StandOn(TrueOutline(section, world, options), section.z_mm, options.origin_mm, 0, &under);
  }
  for (std::size_t k = 0; k < asked.size(); ++k)
    StandOn(planned.target.sections[k].outline, asked[k].z_mm, options.origin_mm, kWeld_mm, &over,
            &planned.target.sections[k].standard_mm, &expanded_mm);
  const Judged low_whole = JudgedBy(under, whole.path, path_options.mill, thread_count),
               high_whole = JudgedBy(over, whole.path, path_options.mill, thread_count, expanded_mm);
  std::printf(
      "as the service plans it, with the places that a chord of 1 um asks for: below the line %zu of %zu dexels "
      "touched, "
      "%.3f um deep; above it %.3f um below the target, rest %.2f um at most, %.2f um mean; beyond U %.3f um\n",
      low_whole.touched, low_whole.count, 1e3 * low_whole.gouge_mm, 1e3 * high_whole.gouge_mm, 1e3 * high_whole.rest_mm,
      1e3 * high_whole.mean_rest_mm, 1e3 * high_whole.beyond_mm);
  (*figures)["service_below_line_um"] = 1e3 * std::max(0.0, low_whole.gouge_mm);
  (*figures)["service_overcut_um"] = 1e3 * high_whole.gouge_mm;
  (*figures)["service_beyond_u_um"] = 1e3 * high_whole.beyond_mm;
  for (const NormalMethod method : {NormalMethod::kPublished, NormalMethod::kSurface}) {
    metrology::PathOptions by = path_options;
    by.normals = method;
    for (const bool guarded : {false, true}) {
      const auto made = PlanPath(planned.target.sections, options.origin_mm, planned.stock_mm,
                                 guarded ? planned.guard : metrology::GuardedSurface{}, by, thread_count);
      if (!made.ok()) continue;
      const Judged low = JudgedBy(under, *made, by.mill, thread_count),
                   high = JudgedBy(over, *made, by.mill, thread_count, expanded_mm);
      std::printf(
          "%-9s normals, %-9s: below the line %zu of %zu dexels touched, %.3f um deep; above it %.3f um below the "
          "target, rest %.2f um at most, %.2f um mean\n",
          method == NormalMethod::kPublished ? "published" : "surface", guarded ? "guarded" : "unguarded", low.touched,
          low.count, 1e3 * low.gouge_mm, 1e3 * high.gouge_mm, 1e3 * high.rest_mm, 1e3 * high.mean_rest_mm);
      std::fflush(stdout);
      if (method == NormalMethod::kPublished || !guarded) continue;
      (*figures)["below_line_um"] = 1e3 * std::max(0.0, low.gouge_mm);
      (*figures)["gouge_um"] = 1e3 * std::max({0.0, low.gouge_mm, high.beyond_mm});
      (*figures)["overcut_um"] = 1e3 * high.gouge_mm;
      (*figures)["rest_um"] = 1e3 * high.rest_mm;
      (*figures)["dexels_below_line_touched"] = low.touched;
    }
  }
}

}  // namespace

void RunPlan(const DrawnBlade& drawn, std::size_t points, int thread_count, nlohmann::json* figures) {
  const NominalBlade& nominal = drawn.nominal;
  const BladeWorld world(kSeed, nominal.low_mm, nominal.high_mm);
  const std::size_t kept = KeptSections(drawn, kKept);
  metrology::StackOptions options = drawn.options;
  options.heights.cutoff_mm = drawn.sections[kept - 1].z_mm + options.half_width_mm;
  options.thread_count = thread_count;
  metrology::PathOptions path_options;
  const double step_mm = *metrology::StepOverFor(kScallop_mm, path_options.mill.radius_mm);
  const std::vector<double> pass_z_mm =
      metrology::PassHeights(options.heights.cutoff_mm, options.heights.target_mm, step_mm);
  const std::vector<BladeSection> below(drawn.sections.begin(),
                                        drawn.sections.begin() + static_cast<std::ptrdiff_t>(kept));
  std::vector<BladeSection> asked;
  const double prepared_s = Seconds([&] { asked = *NominalSections(*nominal.surface, pass_z_mm, options); });
  // The cloud: the blade's own wall, and above the line the weld.
  const WallPoints wall = WallOf(*nominal.surface, points, nominal.low_mm.z(), nominal.high_mm.z(), 9);
  metrology::Points cloud = ScanOf(wall, world, kNoise_mm, kSeed);
  for (std::size_t i = 0; i < cloud.size(); ++i)
    if (cloud[i].z() > options.heights.cutoff_mm + 0.3)
      cloud[i] += kWeld_mm * Vector3d(wall.normals[i].x(), wall.normals[i].y(), 0).normalized();
  nominal.surface->PrepareNear(thread_count);
  std::vector<double> pass_s, plan_s;
  Planned planned;
  absl::StatusOr<metrology::RecontourPath> path = absl::InternalError("");
  for (int run = 0; run < 3; ++run) {
    std::vector<double> distances_mm;
    pass_s.push_back(Seconds([&] { nominal.surface->SignedDistances(cloud, 2, thread_count, &distances_mm); }));
    double sections_s = 0, target_s = 0, path_s = 0;
    sections_s = Seconds([&] { planned.measured = MeasureSections(cloud, options)->sections; });
    target_s = Seconds([&] {
      planned.target = *Extrapolate(planned.measured, below, asked, metrology::ExtrapolationMethod::kProcessOfDeviation,
                                    thread_count);
    });
    path_s = Seconds([&] {
      metrology::Points weld;
      for (const Vector3d& point : cloud)
        if (point.z() > options.heights.cutoff_mm + 0.3) weld.push_back(point);
      planned.stock_mm = WeldStockOf(planned.target.sections, options.origin_mm, weld).greatest_mm;
      planned.guard =
          GuardBelow(planned.measured, planned.target.sections.front(), options.origin_mm, 2, kOutlineExpanded_mm);
      path = PlanPath(planned.target.sections, options.origin_mm, planned.stock_mm, planned.guard, path_options,
                      thread_count);
    });
    plan_s.push_back(sections_s + target_s + path_s);
    std::printf("plan of %zu points: pass %.3f s; sections %.3f s, target %.3f s, path %.3f s\n", cloud.size(),
                pass_s.back(), sections_s, target_s, path_s);
  }
  if (!path.ok()) {
    std::printf("no path: %s\n", std::string(path.status().message()).c_str());
    return;
  }
  std::sort(pass_s.begin(), pass_s.end());
  std::sort(plan_s.begin(), plan_s.end());
  std::size_t places = 0;
  double lifted_mm = 0;
  for (const auto& pass : path->passes)
    for (const auto& place : pass.places) ++places, lifted_mm = std::max(lifted_mm, place.lifted_mm);
  std::printf(
      "nominal sections prepared in %.1f s; plan %.3f s = %.1f passes; stock %.3f mm, %zu roughing layers, %zu "
      "passes, %zu places, scallop %.2f um, lifted %.2f um at most\n",
      prepared_s, plan_s[1], plan_s[1] / pass_s[1], planned.stock_mm, path->roughing_layers, path->passes.size(),
      places, 1e3 * path->scallop_mm, 1e3 * lifted_mm);
  (*figures)["plan_over_distance_passes"] = plan_s[1] / pass_s[1];
  (*figures)["plan_s"] = plan_s[1];
  (*figures)["distance_pass_s"] = pass_s[1];
  (*figures)["nominal_sections_s"] = prepared_s;
  // The whole way as the service goes it: nominal sections, thinning and simulation with it.
  metrology::RepairOptions as_served;
  as_served.stack = options;
  as_served.path = path_options;
  as_served.scallop_mm = kScallop_mm;
  as_served.guard_mm = kOutlineExpanded_mm;
  as_served.greatest_uncertainty_mm = 1;
  absl::StatusOr<metrology::RepairPlan> whole = absl::InternalError("");
  const double whole_s = Seconds([&] { whole = metrology::PlanRepair(cloud, as_served); });
  if (!whole.ok()) {
    std::printf("no plan: %s\n", std::string(whole.status().message()).c_str());
    return;
  }
  std::size_t kept_places = 0;
  for (const auto& pass : whole->path.passes) kept_places += pass.places.size();
  std::printf("the whole plan %.3f s; %zu of its places are kept\n", whole_s, kept_places);
  (*figures)["service_plan_s"] = whole_s;
  (*figures)["service_places"] = kept_places;
  RunRemoval(nominal, world, options, asked, planned, path_options, *whole, figures);
}

}  // namespace sixpoint::bench
