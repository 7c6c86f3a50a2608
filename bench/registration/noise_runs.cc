// Many noise draws: the pose's errors against the Cramer-Rao bound, and against the covariance that each fit states.
#include <algorithm>
#include <cstdio>
#include <optional>

#include "bench/calibration/error_statistics.h"
#include "bench/registration/runs.h"
#include "metrology/parallel/loops.h"

namespace sixpoint::bench {
namespace {

constexpr std::size_t kNoisyPoints = 100'000;
constexpr std::uint64_t kSeedsOfC = 1'000'001, kSeedsOfA = 2'000'001;

}  // namespace

void RunNoise(const PreparedBlade& prepared, const RunOptions& options, Figures* figures) {
  std::printf("\nnoise: %d draws of points and noise, %zu points each\n", options.noise_draws, kNoisyPoints);
  double squares = 0, covered_percent = 0, worst_bias = 0;
  int values = 0;
  for (const CaseKind kind : {CaseKind::kWellHeld, CaseKind::kOneSide}) {
    const bool one_side = kind == CaseKind::kOneSide;
    ErrorStatistics statistics(one_side ? "A" : "C",
                               {"turn about x", "turn about y", "turn about z", "shift x", "shift y", "shift z"});
    struct Draw {
      TimedFit timed;
      std::optional<metrology::PoseCovariance> bound;
    };
    std::vector<Draw> drawn(static_cast<std::size_t>(options.noise_draws));
    metrology::ForEach(drawn.size(), options.threads, [&](std::size_t i) {
      CaseScan scan = MakeScan(prepared.blade, kind, kNoisyPoints, kNoiseMm, std::nullopt,
                               (one_side ? kSeedsOfA : kSeedsOfC) + static_cast<std::uint64_t>(i));
      drawn[i] = {FitPortion(prepared, PortionOf(std::move(scan.scan_mm)), 1), scan.bound};
    });
    for (const Draw& draw : drawn) {
      if (!draw.timed.converged) {
        ++figures->failures;
        std::printf("  did not converge: %s\n", draw.timed.remark.c_str());
        continue;
      }
      const metrology::PlacedPose& placed = *draw.timed.fit.placed;
      const Eigen::Vector3d& reference_mm = placed.covariance.reference_mm;
      statistics.Add(PoseError(placed.zero_from_part, ScanFromPart(), reference_mm),
                     About(*draw.bound, reference_mm).values, placed.noise_covariance.values);
    }
    if (statistics.count() == 0) continue;
    statistics.Print();
    const std::string prefix = one_side ? "noise_a_" : "noise_c_";
    figures->values[prefix + "variance_over_bound"] = statistics.variance_over_bound();
    figures->values[prefix + "coverage_percent"] = statistics.coverage_percent();
    figures->values[prefix + "coverage_scatter_percent"] = statistics.coverage_scatter();
    figures->values[prefix + "axes_coverage_percent"] = statistics.axes_coverage_percent();
    squares += statistics.whitened_squares();
    covered_percent += statistics.coverage_percent() * statistics.values();
    worst_bias = std::max(worst_bias, statistics.worst_bias_sigma());
    values += statistics.values();
  }
  if (values == 0) return;
  figures->values["noise_variance_over_bound"] = squares / values;
  figures->values["noise_coverage_percent"] = covered_percent / values;
  figures->values["noise_worst_bias_sigma"] = worst_bias;
}

}  // namespace sixpoint::bench
