// A blade of constant section, whose tip alone holds the span: does the loss take the tip for foreign?
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "bench/registration/machine_scans.h"
#include "bench/registration/runs.h"
#include "metrology/parallel/loops.h"
#include "metrology/statistics/ranks.h"

namespace sixpoint::bench {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kTrapPoints = 50'000;
constexpr double kGreatestOffMm = 0.3;
// Beyond so many stated standard uncertainties a pose is wrong; chance takes one in 30,000 there.
constexpr double kTrappedInSigmas = 4;
constexpr double kTrappedUm = 0.5;  // and nobody minds less

struct TrapOutcome {
  double off_um = 0;  // along the span, at the end
  bool right = false, flagged = false;
};

// tip_every: of the points at the tip, how many are kept.
TrapOutcome RunOne(const Blade& blade, const metrology::Surface& surface, int tip_every, bool cast,
                   std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, 1);
  std::uniform_real_distribution<double> unit(-1, 1);
  const Bump bump{unit(random) * 8, unit(random) * 20, 0.2, 5, 1};
  CaseSampler sampler(blade, CaseKind::kWellHeld, kNoiseMm, std::nullopt, seed);
  metrology::Points points;
  for (int tip = 0; points.size() < kTrapPoints;) {
    CaseSampler::OnSurface on = sampler.NextOnSurface();
    if (on.normal.z() > kTipNormal && ++tip % tip_every != 0) continue;
    if (cast) on.part_mm += bump.At(on.part_mm, on.normal) * on.normal;
    const double x = normal(random), y = normal(random), z = normal(random);
    points.push_back(on.part_mm + kNoiseMm * Vector3d(x, y, z));
  }
  Eigen::Isometry3d start = Eigen::Isometry3d::Identity();
  start.translation().z() = kGreatestOffMm * unit(random);
  metrology::FitOptions options;
  options.thread_count = 1;
  const auto fit =
      metrology::FitToSurface(surface, {PortionOf(points)}, start, metrology::MachineCalibration::Exact(), options);
  TrapOutcome outcome;
  if (!fit.ok()) return outcome;
  outcome.off_um = 1e3 * std::abs((*fit->evidence.stopped_at * surface.centroid_mm() - surface.centroid_mm()).z());
  outcome.flagged = !fit->placed || !fit->evidence.remark.empty();
  if (!fit->placed) return outcome;
  const double stated_um = 1e3 * std::sqrt(fit->placed->covariance.values(5, 5));
  outcome.right = outcome.off_um < std::max(kTrappedUm, kTrappedInSigmas * stated_um);
  return outcome;
}

}  // namespace

void RunTrap(const PreparedBlade&, const RunOptions& options, Figures* figures) {
  const Blade prism = TwistedBlade(0), nearly = TwistedBlade(0.05);
  const auto of_prism = metrology::Surface::Prepare(prism.mesh), of_nearly = metrology::Surface::Prepare(nearly.mesh);
  if (!of_prism.ok() || !of_nearly.ok()) {
    ++figures->failures;
    return;
  }
  std::printf("\ntrap: %zu points, the tip holds the span; starts off by up to %g mm along it, %d draws each\n",
              kTrapPoints, kGreatestOffMm, options.trap_draws);
  std::printf("%-44s %14s %14s %9s %9s %18s\n", "", "median um", "worst um", "right", "flagged", "wrong and silent");
  const struct {
    const char* words;
    bool constant;
    int tip_every;
    bool cast;
  } kinds[] = {{"constant section", true, 1, false},
               {"constant section, a bump of 0.2 mm", true, 1, true},
               {"constant section, bump, a tenth of the tip", true, 10, true},
               {"5 % of the twist and taper, bump", false, 1, true}};
  int silent = 0, right = 0, runs = 0;
  double worst_um = 0;
  for (const auto& kind : kinds) {
    std::vector<TrapOutcome> all(static_cast<std::size_t>(options.trap_draws));
    metrology::ForEach(all.size(), options.threads, [&](std::size_t i) {
      all[i] = RunOne(kind.constant ? prism : nearly, kind.constant ? **of_prism : **of_nearly, kind.tip_every,
                      kind.cast, 1 + i);
    });
    std::vector<double> off_um;
    int here_right = 0, here_flagged = 0, here_silent = 0;
    for (const TrapOutcome& one : all) {
      off_um.push_back(one.off_um);
      here_right += one.right;
      here_flagged += one.flagged;
      here_silent += !one.right && !one.flagged;
    }
    const double worst = *std::max_element(off_um.begin(), off_um.end());
    std::printf("%-44s %14.4f %14.4f %9d %9d %18d\n", kind.words, metrology::Median(off_um), worst, here_right,
                here_flagged, here_silent);
    worst_um = std::max(worst_um, worst);
    silent += here_silent;
    right += here_right;
    runs += static_cast<int>(all.size());
  }
  figures->values["trap_worst_um"] = worst_um;
  figures->values["trap_right_percent"] = 100.0 * right / std::max(1, runs);
  figures->values["trap_wrong_and_silent"] = silent;
}

}  // namespace sixpoint::bench
