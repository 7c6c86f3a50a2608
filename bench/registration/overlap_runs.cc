// Views merged by a wrong rotation centre: how far the scans' agreement shows it, and how often it cries wolf.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "bench/registration/machine_scans.h"
#include "bench/registration/runs.h"
#include "metrology/parallel/loops.h"
#include "metrology/registration/merged_views.h"
#include "metrology/statistics/ranks.h"

namespace sixpoint::bench {
namespace {

constexpr double kCentreErrorsUm[] = {0, 2, 5, 10, 15};
constexpr int kSides = 6;

struct OverlapOutcome {
  bool ok = false;
  bool beyond = false;
  double ratio = 0;  // difference over what noise alone explains, all pairs pooled
};

OverlapOutcome RunOne(const PreparedBlade& prepared, double centre_error_um, std::uint64_t seed) {
  std::mt19937_64 random(seed + 77);
  std::uniform_real_distribution<double> turn(0, 2 * M_PI);
  ViewScans scans;
  scans.views = ViewsAround(kSides, false);
  scans.seed = seed;
  const metrology::MachineCalibration truth = TrueMachine();
  metrology::MachineCalibration believed = Calibrated(truth, seed);
  const double at = turn(random);
  Eigen::Matrix<double, 8, 1> wrong = Eigen::Matrix<double, 8, 1>::Zero();
  wrong[6] = 1e-3 * centre_error_um * std::cos(at);
  wrong[7] = 1e-3 * centre_error_um * std::sin(at);
  believed.axes = believed.axes.Perturbed(wrong);
  const auto portions = ScansOf(prepared.blade, scans, truth, believed);
  metrology::FitOptions options;
  options.thread_count = 1;
  const auto fit = metrology::FitToSurface(*prepared.surface, portions,
                                           Displaced(scans.zero_from_part, 0.2, 2e-3, seed), believed, options);
  OverlapOutcome outcome;
  if (!fit.ok() || fit->outcome != metrology::Outcome::kConverged) return outcome;
  const auto test = metrology::TestMerge(*prepared.surface, portions, *fit, believed, options);
  if (!test.ok()) return outcome;
  outcome.beyond = test->beyond;
  double difference = 0, expected = 0, patches = 0;
  for (const metrology::PortionAgreement& pair : fit->evidence.agreements) {
    const auto n = static_cast<double>(pair.patch_count);
    difference += n * pair.difference_rms_mm * pair.difference_rms_mm / (pair.expected_rms_mm * pair.expected_rms_mm);
    expected += n;
    patches += n;
  }
  outcome.ok = patches > 0;
  outcome.ratio = std::sqrt(difference / std::max(1.0, expected));
  return outcome;
}

}  // namespace

void RunOverlap(const PreparedBlade& prepared, const RunOptions& options, Figures* figures) {
  std::printf(
      "\noverlap of %d views, %d draws each, calibrations drawn from their covariances; the second axis besides off\n",
      kSides, options.overlap_draws);
  std::printf("%8s %12s %40s %12s\n", "by um", "flagged %", "difference over noise: median (95 %)", "compared");
  double seen_um = std::numeric_limits<double>::infinity();
  for (const double um : kCentreErrorsUm) {
    const int draws = um == 0 ? 4 * options.overlap_draws : options.overlap_draws;
    std::vector<OverlapOutcome> all(static_cast<std::size_t>(draws));
    metrology::ForEach(all.size(), options.threads, [&](std::size_t i) { all[i] = RunOne(prepared, um, 1 + i); });
    std::vector<double> ratios;
    double flagged = 0;
    for (const OverlapOutcome& one : all) {
      flagged += one.beyond || !one.ok ? 1 : 0;
      if (one.ok) ratios.push_back(one.ratio);
    }
    const double percent = 100 * flagged / static_cast<double>(draws);
    std::sort(ratios.begin(), ratios.end());
    const double high = ratios.empty() ? NAN : ratios[static_cast<std::size_t>(0.95 * (ratios.size() - 1.0))];
    std::printf("%8g %12.1f %30.2f (%.2f) %12zu\n", um, percent, ratios.empty() ? NAN : metrology::Median(ratios), high,
                ratios.size());
    if (um == 0) figures->values["overlap_false_percent"] = percent;
    if (um > 0 && percent >= 95) seen_um = std::min(seen_um, um);
  }
  if (std::isfinite(seen_um)) figures->values["overlap_seen_um"] = seen_um;
}

}  // namespace sixpoint::bench
