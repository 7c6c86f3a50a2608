// The part found from any turn and tens of millimetres away: our turns tried one by one, and PCL's features.
#include <cmath>
#include <cstdio>

#include "bench/pcl/pcl_start.h"
#include "bench/pcl/runs.h"
#include "bench/registration/our_fit.h"
#include "metrology/registration/coarse_start.h"

namespace sixpoint::bench {
namespace {

constexpr double kWrongInSigmas = 5, kWrongUm = 2;
constexpr double kNoLimitMm = 1e3;

// A start is right where the fit that goes on from it comes to rest at the truth; its own error is how far that fit must go.
Result Judge(const PreparedBlade& prepared, const CoarseCase& posed, const std::optional<Eigen::Isometry3d>& start) {
  if (!start) return {};
  metrology::FitOptions options;
  options.thread_count = 1;
  const auto fit = metrology::FitToSurface(*prepared.surface, posed.portions, *start, posed.machine, options);
  if (!fit.ok() || fit->outcome != metrology::Outcome::kConverged || !fit->placed) return {};
  const double stated_um =
      VertexDisplacementUm(prepared.blade, fit->placed->zero_from_part, fit->placed->noise_covariance);
  const double off_um = VertexDisplacementUm(prepared.blade, fit->placed->zero_from_part, posed.zero_from_part);
  const bool right = off_um < std::max(kWrongUm, kWrongInSigmas * stated_um);
  return {true, right ? 1e-3 * VertexDisplacementUm(prepared.blade, *start, posed.zero_from_part) : 2 * kNoLimitMm, 0};
}

}  // namespace

void RunStart(const RunOptions& options, Figures* figures) {
  const PreparedBlade prepared = PrepareBlade(options.threads);
  const PclStart pcl(prepared.blade);
  const int draws = std::max(2, options.seeds / 8);
  for (const bool whole : {true, false}) {
    std::vector<Result> ours, prerejection, sac_ia;
    for (int seed = 1; seed <= draws; ++seed) {
      const CoarseCase posed = PosedAnywhere(prepared.blade, whole, static_cast<std::uint64_t>(seed));
      const auto add = [&](std::vector<Result>* results, const auto& find) {
        const double begin = ThreadSeconds();
        const std::optional<Eigen::Isometry3d> start = find();
        const double seconds = ThreadSeconds() - begin;
        results->push_back(Judge(prepared, posed, start));
        results->back().seconds = seconds;
      };
      add(&ours, [&]() -> std::optional<Eigen::Isometry3d> {
        metrology::FitOptions alone;
        alone.thread_count = 1;
        const auto start = metrology::FindCoarseStart(*prepared.surface, posed.portions, BladeOnMachine(), alone);
        if (!start.ok()) return std::nullopt;
        return start->zero_from_part;
      });
      add(&prerejection, [&] { return pcl.Find(posed.portions, StartBy::kPrerejection); });
      add(&sac_ia, [&] { return pcl.Find(posed.portions, StartBy::kSacIa); });
    }
    std::printf("\n-- coarse start, turned in any way, up to %g mm off: %d draws\n", kPosedAnywhereMm, draws);
    figures->Add(whole ? "start_whole" : "start_one_side",
                 PrintTallies(whole ? "four sides and one tilted" : "one side, from anywhere", "mm",
                              {Tally("ours, 576 turns", ours, kNoLimitMm),
                               Tally("PCL FPFH, prerejection, ICP", prerejection, kNoLimitMm),
                               Tally("PCL FPFH, SAC-IA, ICP", sac_ia, kNoLimitMm)}));
  }
}

}  // namespace sixpoint::bench
