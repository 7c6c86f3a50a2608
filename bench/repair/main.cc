// sixpoint-bench-repair: plant-a's rotor blade with its tip cut off, worn and bent, planned anew. Camber lines beside the definition; the
// extrapolated tip by three methods beside the blade's own; the plan's time beside passes of distance; what its path removes. Prints one JSON object.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "bench/goals.h"
#include "bench/repair/judged_blade.h"
#include "bench/repair/milled_blade.h"
#include "tests/metrology/repair/camber_check.h"

namespace sixpoint::bench {
namespace {

using metrology::CamberCheck;
using metrology::CamberMethod;
using metrology::ExtrapolationMethod;
using nlohmann::json;

constexpr double kLeastKept = 0.7;

struct Sizes {
  int blades = 200, camber_blades = 10, threads = 1;
  std::size_t points = 300'000, plan_points = 1'000'000;
};

metrology::StackOptions OptionsOf(const DrawnBlade& drawn, std::size_t kept, CamberMethod camber) {
  metrology::StackOptions options = drawn.options;
  options.heights.cutoff_mm = drawn.sections[kept - 1].z_mm + options.half_width_mm;
  options.camber = camber;
  return options;
}

// Both camber methods, on the outlines as measured and on the true ones.
void RunCamber(const DrawnBlade& drawn, const WallPoints& wall, const Sizes& sizes, json* figures) {
  for (const CamberMethod method : {CamberMethod::kPublished, CamberMethod::kBisected}) {
    std::vector<double> line, extension, line_true, extension_true;
    std::size_t filtered = 0, refused = 0, left_out = 0;
    for (int b = 0; b < sizes.camber_blades; ++b) {
      const auto seed = static_cast<std::uint64_t>(b);
      const BladeWorld world(seed, drawn.nominal.low_mm, drawn.nominal.high_mm);
      const metrology::StackOptions options = OptionsOf(drawn, KeptSections(drawn, kMostKept), method);
      const auto measured = MeasureSections(ScanOf(wall, world, kNoise_mm, seed), options);
      if (!measured.ok()) {
        ++refused;
        continue;
      }
      left_out += measured->left_out.size();
      for (const metrology::BladeSection& section : measured->sections) {
        const CamberCheck own = CheckCamber(section.profile, section.outline);
        const CamberCheck real =
            CheckCamber(section.profile, TrueOutline(DrawnAt(drawn, section.z_mm), world, drawn.options));
        line.push_back(own.line_mm);
        extension.push_back(std::max(own.leading_extension_mm, own.trailing_extension_mm));
        line_true.push_back(real.line_mm);
        extension_true.push_back(std::max(real.leading_extension_mm, real.trailing_extension_mm));
        const auto& filters = section.profile.filters;
        filtered +=
            filters.one_sided_count + filters.out_of_order_count + filters.not_ahead_count + filters.off_line_count;
      }
    }
    for (auto* values : {&line, &extension, &line_true, &extension_true}) std::sort(values->begin(), values->end());
    const auto median = [](const std::vector<double>& values) { return 1e3 * values[values.size() / 2]; };
    const auto worst = [](const std::vector<double>& values) { return 1e3 * values.back(); };
    const std::string name = method == CamberMethod::kBisected ? "" : "published_";
    std::printf(
        "%-10s camber, %zu sections, %zu left out, %zu circles filtered, %zu blades refused: line %.2f um worst "
        "(median %.3f), "
        "extension %.2f (%.2f); on the true outlines %.2f (%.2f), %.2f (%.2f)\n",
        name.empty() ? "bisected" : "published", line.size(), left_out, filtered, refused, worst(line), median(line),
        worst(extension), median(extension), worst(line_true), median(line_true), worst(extension_true),
        median(extension_true));
    std::fflush(stdout);
    (*figures)[name + "camber_worst_um"] = worst(line);
    (*figures)[name + "extension_worst_um"] = worst(extension);
    (*figures)[name + "camber_true_worst_um"] = worst(line_true);
    (*figures)[name + "extension_true_worst_um"] = worst(extension_true);
  }
}

struct MethodTally {
  const char* name;
  ExtrapolationMethod method;
  TargetErrors all, tip;  // tip: of the highest section alone
  std::vector<double> rms_mm;
  std::vector<TargetErrors> by_height;  // tenths of the span beyond the cut
  metrology::Extrapolation::Determination determination;
};

void RunExtrapolation(const DrawnBlade& drawn, const WallPoints& wall, const Sizes& sizes, int first, json* figures) {
  MethodTally tallies[] = {{"polynomial, published", ExtrapolationMethod::kPolynomial, {}, {}, {}, {}, {}},
                           {"polynomial of deviation", ExtrapolationMethod::kPolynomialOfDeviation, {}, {}, {}, {}, {}},
                           {"process of deviation", ExtrapolationMethod::kProcessOfDeviation, {}, {}, {}, {}, {}}};
  int refused = 0;
  std::size_t sections = 0, left_out = 0;
  for (int b = first; b < first + sizes.blades; ++b) {
    const auto seed = static_cast<std::uint64_t>(b);
    const BladeWorld world(seed, drawn.nominal.low_mm, drawn.nominal.high_mm);
    std::mt19937_64 random(500 + seed);
    const std::size_t kept = KeptSections(drawn, std::uniform_real_distribution<double>(kLeastKept, kMostKept)(random));
    metrology::StackOptions options = OptionsOf(drawn, kept, CamberMethod::kBisected);
    options.thread_count = sizes.threads;
    const auto measured = MeasureSections(ScanOf(wall, world, kNoise_mm, seed), options);
    if (!measured.ok()) {
      ++refused;
      std::printf("%d: %s\n", b, std::string(measured.status().message()).c_str());
      continue;
    }
    const auto cut = drawn.sections.begin() + static_cast<std::ptrdiff_t>(kept);
    const std::vector<metrology::BladeSection> nominal(drawn.sections.begin(), cut), asked(cut, drawn.sections.end());
    sections += measured->sections.size(), left_out += measured->left_out.size();
    std::printf("%3d, %2zu of %zu sections kept, %zu left out:", b, kept, drawn.sections.size(),
                measured->left_out.size());
    for (MethodTally& tally : tallies) {
      const auto made = Extrapolate(measured->sections, nominal, asked, tally.method, sizes.threads);
      if (!made.ok()) {
        ++refused;
        std::printf(" %s", std::string(made.status().message()).c_str());
        continue;
      }
      if (made->determination) tally.determination = *made->determination;
      TargetErrors errors;
      for (std::size_t a = 0; a < asked.size(); ++a) {
        const metrology::Outline truth = TrueOutline(asked[a], world, drawn.options);
        TargetErrors one;
        one.Add(made->sections[a], truth);
        errors.Add(one);
        if (a + 1 == asked.size()) tally.tip.Add(one);
        tally.by_height.resize(std::max(tally.by_height.size(), a + 1));
        tally.by_height[a].Add(one);
      }
      tally.all.Add(errors);
      tally.rms_mm.push_back(errors.Rms_mm());
      std::printf(" rms %.2f um, held %.1f %%;", 1e3 * errors.Rms_mm(), errors.Held_percent());
    }
    std::printf("\n");
    std::fflush(stdout);
  }
  std::printf("\n%zu sections measured, %zu left out, %d blades refused\n", sections, left_out, refused);
  std::printf("%-26s %10s %10s %10s %10s %8s %8s\n", "", "rms um", "median um", "tip um", "worst um", "held %",
              "U / rms");
  for (MethodTally& tally : tallies) {
    std::sort(tally.rms_mm.begin(), tally.rms_mm.end());
    std::printf("%-26s %10.2f %10.2f %10.2f %10.1f %8.2f %8.2f\n", tally.name, 1e3 * tally.all.Rms_mm(),
                1e3 * tally.rms_mm[tally.rms_mm.size() / 2], 1e3 * tally.tip.Rms_mm(), 1e3 * tally.all.worst_mm,
                tally.all.Held_percent(), std::sqrt(tally.all.weighted_expanded_mm3 / tally.all.weighted_squares_mm3));
  }
  const auto& r2 = tallies[0].determination;
  std::printf("published regression of the last blade: R^2 camber %.4f, thickness %.4f, leading %.4f, trailing %.4f\n",
              r2.camber, r2.thickness, r2.leading, r2.trailing);
  std::printf("process of deviation, by sections above the cut: rms um, U um, held %%\n");
  const MethodTally& ours = tallies[2];
  for (std::size_t a = 0; a < ours.by_height.size(); ++a) {
    const TargetErrors& errors = ours.by_height[a];
    std::printf("%2zu: %6.2f %6.2f %6.1f\n", a + 1, 1e3 * errors.Rms_mm(),
                1e3 * std::sqrt(errors.weighted_expanded_mm3 / errors.length_mm), errors.Held_percent());
  }
  (*figures)["extrapolation_over_paper"] = tallies[2].all.Rms_mm() / tallies[0].all.Rms_mm();
  (*figures)["extrapolation_over_deviation_polynomial"] = tallies[2].all.Rms_mm() / tallies[1].all.Rms_mm();
  (*figures)["extrapolation_rms_um"] = 1e3 * tallies[2].all.Rms_mm();
  (*figures)["extrapolation_tip_rms_um"] = 1e3 * tallies[2].tip.Rms_mm();
  (*figures)["paper_rms_um"] = 1e3 * tallies[0].all.Rms_mm();
  (*figures)["deviation_polynomial_rms_um"] = 1e3 * tallies[1].all.Rms_mm();
  (*figures)["coverage_95_percent"] = ours.all.Held_percent();
  (*figures)["blades_refused"] = refused;
}

std::vector<Goal> Goals() {
  constexpr auto kAlways = Goal::Counts::kAlways, kInFull = Goal::Counts::kInFull;
  constexpr auto kNone = std::nullopt;
  return {
      {"camber", "published_camber_worst_um", "camber line off the middle, as published, um", kNone, 22, kAlways},
      {"camber", "camber_worst_um", "camber line off the middle, um", kNone, 5, kAlways},
      {"camber", "published_extension_worst_um", "its extension, as published, um", kNone, 12, kAlways},
      {"camber", "extension_worst_um", "its extension, um", kNone, 5, kAlways},
      {"extrapolation", "extrapolation_over_paper", "error beside the published regression's", kNone, 0.5, kInFull},
      {"extrapolation", "coverage_95_percent", "95 % intervals that hold, %", 93, 97.5, kInFull},
      {"extrapolation", "blades_refused", "blades refused", kNone, 0, kAlways},
      {"plan", "plan_over_distance_passes", "plan from a million points, in passes of distance", kNone, 10, kInFull},
      {"plan", "gouge_um", "cut below the surface beyond U, um", kNone, 0, kAlways},
      {"plan", "below_line_um", "cut below the repair line beyond U, um", kNone, 0, kAlways}};
}

int Main(int argc, char** argv) {
  CLI::App app("Repair recontouring");
  std::string shared = "../shared";
  std::vector<std::string> parts = {"camber", "extrapolation", "plan"};
  Sizes sizes;
  int first = 0;
  app.add_option("--shared", shared);
  app.add_option("--only", parts)->delimiter(',');
  app.add_option("--blades", sizes.blades);
  app.add_option("--first", first);
  app.add_option("--camber-blades", sizes.camber_blades);
  app.add_option("--points", sizes.points, "Of each blade's scan");
  app.add_option("--plan-points", sizes.plan_points);
  app.add_option("--threads", sizes.threads);
  CLI11_PARSE(app, argc, argv);
  const NominalBlade nominal = LoadBlade(shared + "/data/plant-a/cad.step");
  if (nominal.surface == nullptr) {
    std::printf("SKIPPED: no plant-a under %s\n{\"bench\": \"repair\", \"figures\": {}}\n", shared.c_str());
    return 0;
  }
  const auto has = [&](const char* part) { return std::find(parts.begin(), parts.end(), part) != parts.end(); };
  const DrawnBlade drawn = DrawBlade(nominal, sizes.threads);
  json figures;
  const WallPoints wall =
      WallOf(*nominal.surface, sizes.points, nominal.low_mm.z(), drawn.options.heights.cutoff_mm + 0.5, 3);
  if (has("camber")) RunCamber(drawn, wall, sizes, &figures);
  if (has("extrapolation")) RunExtrapolation(drawn, wall, sizes, first, &figures);
  if (has("plan")) RunPlan(drawn, sizes.plan_points, sizes.threads, &figures);
  GoalRun run;
  run.parts = parts;
  run.full = sizes.blades >= 200 && sizes.plan_points >= 1'000'000;
  const int missed = PrintGoals(Goals(), run, figures);
  std::printf("%s\n", json({{"bench", "repair"}, {"figures", figures}}).dump().c_str());
  return missed > 0 ? 1 : 0;
}

}  // namespace
}  // namespace sixpoint::bench

int main(int argc, char** argv) { return sixpoint::bench::Main(argc, argv); }
