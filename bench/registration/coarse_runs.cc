// The part found from any turn and tens of millimetres away: how often, how quick, and what is said where it is not.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "bench/registration/machine_scans.h"
#include "bench/registration/runs.h"
#include "metrology/parallel/loops.h"
#include "metrology/statistics/ranks.h"

namespace sixpoint::bench {
namespace {

constexpr int kTimedDraws = 12;  // alone, on all threads
constexpr double kWrongInSigmas = 5, kWrongUm = 2;

struct CoarseOutcome {
  bool right = false, ambiguous = false, flagged = false;
  double off_um = 0, stated_um = 0, condition = 0, seconds = 0;
};

CoarseOutcome RunOne(const PreparedBlade& prepared, bool whole, int threads, std::uint64_t seed) {
  const CoarseCase posed = PosedAnywhere(prepared.blade, whole, seed);
  metrology::FitOptions options;
  options.thread_count = threads;
  options.coarse_start = true;
  CoarseOutcome outcome;
  const double begin = Seconds();
  const auto fit = metrology::FitToSurface(*prepared.surface, posed.portions, BladeOnMachine(), posed.machine, options);
  outcome.seconds = Seconds() - begin;
  if (!fit.ok()) {
    outcome.flagged = true;
    return outcome;
  }
  outcome.off_um = VertexDisplacementUm(prepared.blade, *fit->evidence.stopped_at, posed.zero_from_part);
  if (fit->placed)
    outcome.stated_um =
        VertexDisplacementUm(prepared.blade, fit->placed->zero_from_part, fit->placed->noise_covariance);
  outcome.condition = fit->evidence.condition_number;
  outcome.right = fit->outcome == metrology::Outcome::kConverged &&
                  outcome.off_um < std::max(kWrongUm, kWrongInSigmas * outcome.stated_um);
  outcome.ambiguous = fit->evidence.remark.find("two poses fit") != std::string::npos;
  outcome.flagged = fit->outcome != metrology::Outcome::kConverged || !fit->evidence.remark.empty();
  return outcome;
}

}  // namespace

void RunCoarse(const PreparedBlade& prepared, const RunOptions& options, Figures* figures) {
  std::printf("\ncoarse start: turned in any way, up to %g mm off along each axis, %d draws each\n", kPosedAnywhereMm,
              options.coarse_draws);
  std::printf("%-28s %8s %11s %9s %18s %12s %12s %12s\n", "", "found", "ambiguous", "flagged", "wrong and silent",
              "worst um", "median s", "slowest s");
  int silent = 0;
  for (const bool whole : {true, false}) {
    std::vector<CoarseOutcome> all(static_cast<std::size_t>(options.coarse_draws));
    std::vector<double> seconds;
    const std::size_t timed = std::min<std::size_t>(kTimedDraws, all.size());
    for (std::size_t i = 0; i < timed; ++i) {
      all[i] = RunOne(prepared, whole, options.threads, 1 + i);
      seconds.push_back(all[i].seconds);
    }
    metrology::ForEach(all.size() - timed, options.threads,
                       [&](std::size_t i) { all[timed + i] = RunOne(prepared, whole, 1, 1 + timed + i); });
    int found = 0, ambiguous = 0, flagged = 0, here_silent = 0;
    double worst_um = 0;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const CoarseOutcome& one = all[i];
      if (!one.right && !one.flagged)
        std::printf("  wrong and silent: seed %zu, %.1f um off, stated %.1f um, condition number %.0f\n", 1 + i,
                    one.off_um, one.stated_um, one.condition);
      found += one.right;
      ambiguous += one.ambiguous;
      flagged += one.flagged;
      here_silent += !one.right && !one.flagged;
      if (one.right) worst_um = std::max(worst_um, one.off_um);
    }
    const double slowest = *std::max_element(seconds.begin(), seconds.end());
    std::printf("%-28s %8d %11d %9d %18d %12.3f %12.3f %12.3f\n",
                whole ? "four sides and one tilted" : "one side, from anywhere", found, ambiguous, flagged, here_silent,
                worst_um, metrology::Median(seconds), slowest);
    silent += here_silent;
    const std::string key = whole ? "coarse_whole_" : "coarse_one_side_";
    figures->values[key + "found_percent"] = 100.0 * found / static_cast<double>(all.size());
    figures->values[key + "ambiguous_percent"] = 100.0 * ambiguous / static_cast<double>(all.size());
    figures->values[key + "seconds"] = metrology::Median(seconds);
    figures->values[key + "slowest_seconds"] = slowest;
  }
  figures->values["coarse_wrong_and_silent"] = silent;
}

}  // namespace sixpoint::bench
