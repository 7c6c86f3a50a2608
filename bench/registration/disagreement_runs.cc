// How often SIX_POINT and LOCAL are said to disagree with BEST_FIT: on blades whose shape is true, and where a datum is not.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "bench/registration/machine_scans.h"
#include "bench/registration/runs.h"
#include "metrology/parallel/loops.h"
#include "metrology/registration/disagreement.h"
#include "metrology/registration/six_point.h"

namespace sixpoint::bench {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kTwoSidedPoints = 100'000;
constexpr double kShapeErrorsUm[] = {5, 10, 20, 50, 100};
constexpr double kShapeErrorSigmaMm = 3;
constexpr double kStartShiftMm = 0.2, kStartTurnRad = 3e-3;
constexpr double kLocalRadiusMm = 12;
constexpr int kMethodCount = 3;
const char* const kMethodNames[kMethodCount] = {"six points, pairs", "six points, 3-2-1", "local"};
const char* const kMethodKeys[kMethodCount] = {"pairs", "normals", "local"};

// 3-2-1: three on the suction side, two towards the leading edge, one at the tip.
std::vector<metrology::DatumPoint> Datums(const metrology::Surface& surface) {
  std::vector<metrology::DatumPoint> datums;
  for (const Vector3d& near : {Vector3d(-7, 8, -28), Vector3d(8, 8, -25), Vector3d(0, 8, 26), Vector3d(-16, 5, -22),
                               Vector3d(-12.5, 0, 22), Vector3d(-2, 1.5, 41)}) {
    const metrology::SurfacePoint on = surface.Closest(near);
    datums.push_back({"D" + std::to_string(datums.size() + 1), on.point_mm, on.normal});
  }
  return datums;
}

struct Ratios {
  double ratio[kMethodCount];
  bool beyond[kMethodCount];
  bool ok = false;
};

class Comparison {
 public:
  Comparison(const PreparedBlade& prepared, bool on_machine)
      : prepared_(prepared), on_machine_(on_machine), datums_(Datums(*prepared.surface)) {
    for (const metrology::DatumPoint& datum : datums_) places_.push_back(datum.point_mm);
    local_.thread_count = options_.thread_count = 1;
    local_.regions_in = {{metrology::Region::Shape::kBall, datums_[2].point_mm, Vector3d::Constant(kLocalRadiusMm)}};
  }

  // A blade that stands off by `shape_um` about its third datum, which the region of LOCAL holds too.
  Ratios Run(double shape_um, std::uint64_t seed) const {
    std::optional<Bump> bump;
    if (shape_um != 0) {
      bump = Bump{datums_[2].point_mm.x(), datums_[2].point_mm.z(), 1e-3 * shape_um, kShapeErrorSigmaMm, 1};
    }
    metrology::MachineCalibration believed = metrology::MachineCalibration::Exact();
    Eigen::Isometry3d pose = ScanFromPart();
    std::vector<metrology::ScanPortion> portions;
    if (on_machine_) {
      ViewScans scans;
      scans.views = ViewsAround(4, true);
      scans.dense_places_mm = places_;
      scans.seed = seed;
      if (bump) scans.bumps.push_back(*bump);
      const metrology::MachineCalibration truth = TrueMachine();
      believed = Calibrated(truth, seed);
      pose = scans.zero_from_part;
      portions = ScansOf(prepared_.blade, scans, truth, believed);
    } else {
      portions.push_back(
          PortionOf(MakeScan(prepared_.blade, CaseKind::kWellHeld, kTwoSidedPoints, kNoiseMm, bump, seed).scan_mm));
    }
    const Eigen::Isometry3d start = Displaced(pose, kStartShiftMm, kStartTurnRad, seed);
    const metrology::Surface& surface = *prepared_.surface;
    Ratios ratios;
    const auto best = metrology::FitToSurface(surface, portions, start, believed, options_);
    if (!best.ok()) return ratios;
    for (int m = 0; m < kMethodCount; ++m) {
      const metrology::FitOptions& options = m == 2 ? local_ : options_;
      const auto fit = m == 2 ? metrology::FitToSurface(surface, portions, start, believed, options)
                              : metrology::FitSixPoints(
                                    surface, portions, datums_, *best,
                                    m == 0 ? metrology::SixPointVariant::kPairs : metrology::SixPointVariant::kNormals,
                                    believed, options);
      if (!fit.ok()) return ratios;
      const auto found =
          metrology::DisagreementOf(surface, *fit, *best, believed, metrology::Matrix6d::Zero(), options);
      if (!found.ok()) return ratios;
      ratios.ratio[m] = found->ratio;
      ratios.beyond[m] = found->beyond;
    }
    ratios.ok = true;
    return ratios;
  }

 private:
  const PreparedBlade& prepared_;
  const bool on_machine_;
  std::vector<metrology::DatumPoint> datums_;
  metrology::Points places_;
  metrology::FitOptions options_, local_;
};

std::vector<Ratios> RunMany(const Comparison& comparison, double shape_um, int draws, std::uint64_t first_seed,
                            int threads, Figures* figures) {
  std::vector<Ratios> all(static_cast<std::size_t>(draws));
  metrology::ForEach(all.size(), threads, [&](std::size_t i) { all[i] = comparison.Run(shape_um, first_seed + i); });
  const auto failed = std::count_if(all.begin(), all.end(), [](const Ratios& one) { return !one.ok; });
  if (failed > 0) {
    figures->failures += static_cast<int>(failed);
    std::printf("  %d of %d draws without a comparison\n", static_cast<int>(failed), draws);
  }
  all.erase(std::remove_if(all.begin(), all.end(), [](const Ratios& one) { return !one.ok; }), all.end());
  return all;
}

double FlaggedPercent(const std::vector<Ratios>& all, int method) {
  const auto flagged =
      std::count_if(all.begin(), all.end(), [method](const Ratios& one) { return one.beyond[method]; });
  return 100.0 * static_cast<double>(flagged) / static_cast<double>(std::max<std::size_t>(1, all.size()));
}

}  // namespace

void RunDisagreement(const PreparedBlade& prepared, const RunOptions& options, Figures* figures) {
  std::printf("\ndisagreement with the best fit: flagged beyond %g standard uncertainties, %% of draws\n",
              metrology::kDisagreementLimit);
  double flagged_percents = 0;
  for (const bool on_machine : {false, true}) {
    const Comparison comparison(prepared, on_machine);
    const std::string setting = on_machine ? "views" : "sides";
    const std::vector<Ratios> straight =
        RunMany(comparison, 0, options.disagreement_draws, 1, options.threads, figures);
    std::printf("%s, a true blade, %zu draws (1 %% scatters by %.1f)\n",
                on_machine ? "four views and the tip, calibrations drawn" : "both sides in one scan", straight.size(),
                100 * std::sqrt(0.01 * 0.99 / static_cast<double>(std::max<std::size_t>(1, straight.size()))));
    for (int m = 0; m < kMethodCount; ++m) {
      std::vector<double> ratios;
      for (const Ratios& one : straight) ratios.push_back(one.ratio[m]);
      std::sort(ratios.begin(), ratios.end());
      if (ratios.empty()) continue;
      const auto quantile = [&](double part) {
        return ratios[static_cast<std::size_t>(part * static_cast<double>(ratios.size() - 1))];
      };
      std::printf("  %-20s %6.2f flagged; ratio: median %.2f, 95 %% below %.2f, 99 %% below %.2f, greatest %.2f\n",
                  kMethodNames[m], FlaggedPercent(straight, m), quantile(0.5), quantile(0.95), quantile(0.99),
                  ratios.back());
      figures->values["disagreement_" + setting + "_" + kMethodKeys[m] + "_false_percent"] =
          FlaggedPercent(straight, m);
      flagged_percents += FlaggedPercent(straight, m);
    }
    std::uint64_t seed = 100'000;
    std::printf("  shape error at D3, um %9s %17s %17s\n", kMethodNames[0], kMethodNames[1], kMethodNames[2]);
    for (const double shape_um : kShapeErrorsUm) {
      const std::vector<Ratios> bumped =
          RunMany(comparison, shape_um, options.power_draws, seed, options.threads, figures);
      seed += 10'000;
      std::printf("  %20g", shape_um);
      for (int m = 0; m < kMethodCount; ++m) {
        std::printf(" %17.1f", FlaggedPercent(bumped, m));
        figures->values["disagreement_" + setting + "_" + kMethodKeys[m] + "_seen_at_" +
                        std::to_string(static_cast<int>(shape_um)) + "_um_percent"] = FlaggedPercent(bumped, m);
      }
      std::printf("\n");
    }
  }
  figures->values["disagreement_false_percent"] = flagged_percents / (2 * kMethodCount);
}

}  // namespace sixpoint::bench
