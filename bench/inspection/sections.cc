// `bench/run inspection --sections`. The last line is one JSON object.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "bench/goals.h"
#include "metrology/frames/angles.h"
#include "metrology/sections/section_uncertainty.h"
#include "tests/metrology/sections/airfoils.h"
#include "tests/metrology/sections/loop_outline.h"

namespace sixpoint::bench {
namespace {

using namespace metrology;
using P = SectionParameter;
using Clock = std::chrono::steady_clock;

constexpr int kBlades = 400;
using metrology::kRadPerDeg;

std::vector<Goal> Goals() {
  constexpr auto kAlways = Goal::Counts::kAlways, kInFull = Goal::Counts::kInFull;
  constexpr auto kNone = std::nullopt;
  return {
      {"exact", "section_worst_um", "exact blades: chord, thickness, radii: worst, um", kNone, 2, kAlways},
      {"exact", "section_worst_deg", "exact blades: stagger: worst, deg", kNone, 0.005, kAlways},
      {"measured", "coverage_95_low_percent", "with the nominal: least share of a parameter's intervals that hold, %",
       90, kNone, kInFull},
      {"measured", "coverage_95_pooled_low_percent", "with the nominal, all parameters: least share of a world, %", 93,
       kNone, kInFull},
      {"measured", "coverage_95_pooled_high_percent", "with the nominal, all parameters: greatest share of a world, %",
       kNone, 99.5, kInFull},
      {"measured", "u_over_rms_high", "with the nominal: greatest U over root mean square error", kNone, 4, kInFull},
      {"times", "section_s", "a million points, one section: s", kNone, 1, Goal::Counts::kWhereQuiet},
  };
}

struct Tally {
  int count = 0, held = 0;
  double squares = 0, expanded_squares = 0;
  void Add(double error, double expanded) {
    ++count;
    held += std::abs(error) <= expanded;
    squares += error * error;
    expanded_squares += expanded * expanded;
  }
};

// What is known of a blade.
std::vector<std::pair<P, double>> Known(const Blade& blade, const BladeTruth& truth) {
  std::vector<std::pair<P, double>> known = {{P::kChordNoseTail, truth.chord_mm},
                                             {P::kStaggerNoseTail, truth.stagger_rad},
                                             {P::kThicknessInscribed, truth.thickness_mm},
                                             {P::kLeadingX, truth.leading_mm.x()},
                                             {P::kTrailingY, truth.trailing_mm.y()}};
  if (blade.leading == BladeEnd::kCircle) known.emplace_back(P::kLeadingRadius, truth.lead_radius_mm);
  if (blade.trailing == BladeEnd::kCircle) known.emplace_back(P::kTrailingRadius, truth.trail_radius_mm);
  return known;
}

void RunExact(int blades, nlohmann::json* figures) {
  std::mt19937_64 random(71);
  double worst_um = 0, worst_deg = 0;
  for (int i = 0; i < blades; ++i) {
    Blade blade = RandomBlade(random);
    if (i % 3 == 1) blade.trailing = BladeEnd::kSquare;
    if (i % 3 == 2) blade.leading = BladeEnd::kEllipse, blade.flat_laws = true;
    const BladeTruth truth = TruthOf(blade);
    const auto outline = LoopOutline(PolygonOf(blade, 0.02));
    const SectionValues values = ValuesOf(outline->fitted.outline, CamberOf(outline->fitted.outline, {}));
    for (const auto& [p, wanted] : Known(blade, truth)) {
      const double off =
          values[p] ? std::abs(std::remainder(*values[p] - wanted, p == P::kStaggerNoseTail ? 360 * kRadPerDeg : 1e9))
                    : 1e6;
      double* const worst = p == P::kStaggerNoseTail ? &worst_deg : &worst_um;
      *worst = std::fmax(*worst, p == P::kStaggerNoseTail ? off / kRadPerDeg : 1e3 * off);
    }
  }
  std::printf("%d exact blades: worst %.3f um, %.5f deg\n", blades, worst_um, worst_deg);
  (*figures)["section_worst_um"] = worst_um;
  (*figures)["section_worst_deg"] = worst_deg;
}

struct World {
  const char* name;
  double noise_mm, form_mm;
  bool nominal, spline;
};

struct Summary {
  double low = 100, high = 0, ratio = 0, pooled = 0;  // coverage of a parameter and of all, %; greatest U over rms
};

// Prints each parameter's row.
Summary RunWorld(const World& world, int blades) {
  std::map<P, Tally> tallies;
  int unset = 0, asked = 0;
  for (int i = 0; i < blades; ++i) {
    std::mt19937_64 random(1000 + static_cast<unsigned>(i));
    Blade blade = RandomBlade(random);
    if (i % 3 == 1) blade.trailing = BladeEnd::kSquare;
    const BladeTruth truth = TruthOf(blade);
    const std::vector<Eigen::Vector2d> polygon = PolygonOf(blade, 0.02);
    Measuring measuring;
    measuring.noise_mm = world.noise_mm;
    if (world.form_mm > 0)
      measuring.form_mm =
          world.spline ? SplineForm(world.form_mm, 16, random) : FourierForm(world.form_mm, 2, 8, random);
    measuring.lean = {0.05, 0.1};
    const Points points = MeasuredOn(polygon, measuring, random);
    OutlineOptions options;
    options.noise_um = 1e3 * world.noise_mm;
    const auto outline = MeasuredOutline(points, {}, options);
    std::optional<SectionOutline> nominal;
    UncertaintyOptions uncertainty;
    if (world.nominal) {
      // Not the blade itself: displaced, turned, and all over 10 um thicker.
      Blade drawn = blade;
      drawn.place_mm += Eigen::Vector2d(0.03, -0.04);
      drawn.stagger_rad += 0.001;
      drawn.lead_mm += 0.01;
      drawn.trail_mm += 0.01;
      nominal = *LoopOutline(PolygonOf(drawn, 0.02));
      uncertainty.nominal = &nominal->fitted.outline;
    }
    const auto known = Known(blade, truth);
    asked += static_cast<int>(known.size());
    if (!outline.ok()) {
      unset += static_cast<int>(known.size());
      continue;
    }
    const MeasuredSection section = *MeasureSection(*outline, uncertainty);
    for (const auto& [p, wanted] : known)
      if (section.values[p])
        tallies[p].Add(p == P::kStaggerNoseTail ? std::remainder(*section.values[p] - wanted, 360 * kRadPerDeg)
                                                : *section.values[p] - wanted,
                       section.uncertainty(p).expanded);
      else
        ++unset;
  }
  std::printf("\n%s, %d blades; unset %d of %d\n%-32s %6s %9s %12s %10s\n", world.name, blades, unset, asked, "", "n",
              "held %", "rms um, mdeg", "U / rms");
  Summary summary;
  int held_count = 0, count = 0;
  for (const auto& [p, tally] : tallies) {
    const double held = 100.0 * tally.held / tally.count, rms = std::sqrt(tally.squares / tally.count);
    const double ratio = std::sqrt(tally.expanded_squares / tally.count) / rms;
    std::printf("%-32s %6d %9.1f %12.3f %10.2f\n", NameOf(p).c_str(), tally.count, held,
                rms * (p == P::kStaggerNoseTail ? 1e3 / kRadPerDeg : 1e3), ratio);
    held_count += tally.held;
    count += tally.count;
    summary.low = std::min(summary.low, held);
    summary.high = std::max(summary.high, held);
    summary.ratio = std::max(summary.ratio, ratio);
  }
  summary.pooled = 100.0 * held_count / std::max(1, count);
  std::printf("%-32s %6d %9.1f\n", "all", count, summary.pooled);
  std::fflush(stdout);
  return summary;
}

// A straight blade of 80 mm, a million points.
void Time(int threads, nlohmann::json* figures) {
  std::mt19937_64 random(5);
  const Blade blade;
  Measuring measuring;
  measuring.count = 1000000;
  measuring.half_width_mm = 40;
  const Points points = MeasuredOn(PolygonOf(blade, 0.02), measuring, random);
  double slowest_s = 0;
  for (const double height_mm : {-30, -15, 0, 15, 30}) {
    SectionPlane plane;
    plane.origin_mm.z() = height_mm;
    OutlineOptions options;
    options.half_width_mm = 0.2;
    options.thread_count = threads;
    UncertaintyOptions uncertainty;
    uncertainty.thread_count = threads;
    const auto began = Clock::now();
    const auto outline = MeasuredOutline(points, plane, options);
    const double outline_s = std::chrono::duration<double>(Clock::now() - began).count();
    const MeasuredSection section = *MeasureSection(*outline, uncertainty);
    const double all_s = std::chrono::duration<double>(Clock::now() - began).count();
    std::printf("height %5.1f: %lld points, outline %.3f s, with uncertainty %.3f s\n", height_mm,
                static_cast<long long>(outline->evidence.used_count), outline_s, all_s);
    slowest_s = std::max(slowest_s, all_s);
  }
  (*figures)["section_s"] = slowest_s;
}

int Run(int blades, int threads, bool quiet) {
  nlohmann::json figures = nlohmann::json::object();
  RunExact(std::min(blades, 200), &figures);
  const World worlds[] = {{"noise alone, 2 um", 0.002, 0, false, false},
                          {"2 um, waver 5 um in Fourier terms, nominal known", 0.002, 0.005, true, false},
                          {"2 um, waver 5 um as a spline, nominal known", 0.002, 0.005, true, true},
                          {"2 um, waver 5 um in Fourier terms, no nominal", 0.002, 0.005, false, false},
                          {"2 um, waver 5 um as a spline, no nominal", 0.002, 0.005, false, true}};
  double low = 100, high = 0, ratio = 0, pooled_low = 100, pooled_high = 0;
  int number = 0;
  for (const World& world : worlds) {
    const Summary found = RunWorld(world, blades);
    figures["coverage_low_percent_" + std::to_string(number)] = found.low;
    figures["u_over_rms_high_" + std::to_string(number++)] = found.ratio;
    if (!world.nominal) continue;
    low = std::min(low, found.low);
    high = std::max(high, found.high);
    ratio = std::max(ratio, found.ratio);
    pooled_low = std::min(pooled_low, found.pooled);
    pooled_high = std::max(pooled_high, found.pooled);
  }
  figures["coverage_95_low_percent"] = low;
  figures["coverage_95_high_percent"] = high;
  figures["coverage_95_pooled_low_percent"] = pooled_low;
  figures["coverage_95_pooled_high_percent"] = pooled_high;
  figures["u_over_rms_high"] = ratio;
  Time(threads, &figures);
  const int missed = PrintGoals(Goals(), {{"exact", "measured", "times"}, blades >= kBlades, quiet}, figures);
  figures["missed"] = missed;
  std::printf("%s\n", nlohmann::json({{"bench", "inspection"}, {"figures", figures}}).dump().c_str());
  return missed == 0 ? 0 : 1;
}

}  // namespace
}  // namespace sixpoint::bench

int main(int argc, char** argv) {
  int blades = sixpoint::bench::kBlades, threads = 1;
  bool quiet = true, sound = true;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--no-times") == 0)
      quiet = false;
    else if (std::strcmp(argv[i], "--blades") == 0 && i + 1 < argc)
      blades = std::atoi(argv[++i]);
    else if (std::strcmp(argv[i], "--threads") == 0 && i + 1 < argc)
      threads = std::atoi(argv[++i]);
    else
      sound = false;
  }
  if (!sound || blades < 3 || threads < 1) {
    std::fprintf(stderr, "usage: bench/run inspection [--sections] [--blades N] [--threads N] [--no-times]\n");
    return 2;
  }
  return sixpoint::bench::Run(blades, threads, quiet);
}
