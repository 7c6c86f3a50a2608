// Fewer points of a scan: every k-th, as the product thins for a fit and for a preview, and PCL's filters. For a fit: how far
// off the pose is. For a preview: what is left uncovered.
#include <cmath>
#include <cstdio>
#include <functional>

#include "bench/pcl/pcl_points.h"
#include "bench/pcl/runs.h"
#include "bench/registration/our_fit.h"
#include "metrology/parallel/loops.h"
#include "metrology/registration/machine_calibration.h"

namespace sixpoint::bench {
namespace {

using metrology::Points;

constexpr std::size_t kScanCount = 300'000, kKeptCount = 25'000;
constexpr double kNoiseMm = 2e-3, kStrays = 0.02;
constexpr double kCellMm = 0.5;  // leaves about as many
constexpr double kThinnedLimitUm = 100;

struct ThinningContender {
  const char* name;
  std::function<Points(const Points&)> thin;
};

Points EveryKth(const Points& points) {
  metrology::LineScan scan;
  scan.points_mm = points;
  metrology::Thinning thinning;
  thinning.target_count = static_cast<std::int64_t>(kKeptCount);
  return PointsOf(metrology::Thin(scan, {}, thinning));
}

std::vector<ThinningContender> ThinningContenders() {
  return {{"ours: every k-th", EveryKth},
          {"PCL VoxelGrid (centres)", [](const Points& p) { return PclVoxelGrid(p, kCellMm); }},
          {"PCL UniformSampling", [](const Points& p) { return PclUniformSampling(p, kCellMm); }},
          {"PCL RandomSample", [](const Points& p) { return PclRandomSample(p, kKeptCount); }},
          {"every k-th, PCL outlier removal", [](const Points& p) { return PclWithoutOutliers(EveryKth(p), 2); }}};
}

}  // namespace

void RunThinning(const RunOptions& options, Figures* figures) {
  const PreparedBlade prepared = PrepareBlade(options.threads);
  const std::vector<ThinningContender> contenders = ThinningContenders();
  for (const double strays : {0.0, kStrays}) {
    // Chance moves the ratio of two errors by 20 % over 20 scans: many where it is judged.
    const auto seeds = static_cast<std::size_t>(std::max(4, strays > 0 ? options.seeds / 5 : 3 * options.seeds / 5));
    std::vector<std::vector<Result>> results(contenders.size(), std::vector<Result>(seeds));
    std::vector<std::size_t> kept(contenders.size());
    metrology::ForEach(seeds, options.threads, [&](std::size_t seed) {
      Points scan = MakeScan(prepared.blade, CaseKind::kWellHeld, kScanCount, kNoiseMm, std::nullopt, 1 + seed).scan_mm;
      std::mt19937_64 random(seed);
      std::uniform_real_distribution<double> unit(-1, 1);
      for (Eigen::Vector3d& p : scan)
        if (unit(random) < 2 * strays - 1)
          for (int k = 0; k < 3; ++k) p[k] += 2 * unit(random);
      for (std::size_t c = 0; c < contenders.size(); ++c) {
        const double begin = ThreadSeconds();
        const Points few = contenders[c].thin(scan);
        const double seconds = ThreadSeconds() - begin;
        const TimedFit fit = FitPortion(prepared, PortionOf(few), 1);
        const double off_um = fit.converged ? VertexDisplacementUm(prepared.blade, fit.stopped_at, ScanFromPart()) : 0;
        // As if all had kept as many: an error falls with the root of the count.
        const double scale = std::sqrt(static_cast<double>(few.size()) / static_cast<double>(kKeptCount));
        results[c][seed] = {fit.converged, scale * off_um, seconds};
        if (seed == 0) kept[c] = few.size();
      }
    });
    std::vector<Tally> tallies;
    for (std::size_t c = 0; c < contenders.size(); ++c) {
      tallies.emplace_back(contenders[c].name + (" (" + std::to_string(kept[c]) + ")"), results[c], kThinnedLimitUm);
    }
    std::printf("\n-- thinning %zu points, %zu scans, %g %% strays: vertices after the fit\n", kScanCount, seeds,
                100 * strays);
    figures->Add(strays > 0 ? "thinning_soiled" : "thinning_clean", PrintTallies("", "um", tallies));
  }
}

}  // namespace sixpoint::bench
