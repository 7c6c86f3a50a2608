// Many noise draws: the pose's errors against the Cramer-Rao bound, and against the covariance that each fit states.
#include <algorithm>
#include <cstdio>

#include "bench/calibration/error_statistics.h"
#include "bench/registration/runs.h"

namespace sixpoint::bench {
namespace {

constexpr std::size_t kPointCount = 100'000;

}  // namespace

void RunNoise(const PreparedBlade& prepared, const RunOptions& options, Figures* figures) {
  std::printf("\nnoise: %d draws of points and noise, %zu points each\n", options.noise_draws, kPointCount);
  double squares = 0, covered_percent = 0, worst_bias = 0;
  int values = 0;
  for (const CaseKind kind : {CaseKind::kWellHeld, CaseKind::kOneSide}) {
    const bool one_side = kind == CaseKind::kOneSide;
    ErrorStatistics statistics(one_side ? "A" : "C",
                               {"turn about x", "turn about y", "turn about z", "shift x", "shift y", "shift z"});
    for (int draw = 1; draw <= options.noise_draws; ++draw) {
      CaseScan scan = MakeScan(prepared.blade, kind, kPointCount, kNoiseMm, std::nullopt,
                               static_cast<std::uint64_t>(1000 * (one_side ? 2 : 1) + draw));
      const TimedFit timed = FitPortion(prepared, PortionOf(std::move(scan.scan_mm)), options.threads);
      if (!timed.converged) {
        ++figures->failures;
        std::printf("  did not converge: %s\n", timed.remark.c_str());
        continue;
      }
      const Eigen::Vector3d& reference_mm = timed.fit.covariance.reference_mm;
      statistics.Add(PoseError(timed.fit.zero_from_part, ScanFromPart(), reference_mm),
                     About(scan.bound, reference_mm).values, timed.fit.covariance.values);
    }
    if (statistics.count() == 0) continue;
    statistics.Print();
    const std::string prefix = one_side ? "noise_a_" : "noise_c_";
    figures->values[prefix + "variance_over_bound"] = statistics.variance_over_bound();
    figures->values[prefix + "coverage_percent"] = statistics.coverage_percent();
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
