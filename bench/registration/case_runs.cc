// Time and error of the product's fit on cases A, C and D, and its bits on one thread and several.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "bench/registration/runs.h"
#include "metrology/statistics/ranks.h"

namespace sixpoint::bench {
namespace {

// Places and sizes that a casting may deviate at; the first is the generator's own.
constexpr Bump kBumps[] = {{4, 12, 0.3, 8, 1},   {-8, -20, 0.3, 12, -1}, {6, -10, -0.3, 8, 1}, {-4, 25, 0.1, 12, 1},
                           {0, 0, 0.02, 12, -1}, {8, 30, -0.1, 5, -1},   {-10, 5, 0.05, 8, 1}, {2, -30, 0.2, 3, -1},
                           {5, 20, -0.02, 5, 1}, {-6, -5, -0.2, 12, 1}};

void CountFailure(const TimedFit& timed, Figures* figures) {
  if (timed.converged) return;
  ++figures->failures;
  std::printf("  did not converge: %s\n", timed.remark.c_str());
}

void RunAgainstBound(const char* name, CaseKind kind, const PreparedBlade& prepared, const RunOptions& options,
                     Figures* figures) {
  std::vector<double> seconds, processor_s;
  double squares = 0, bound_squares = 0, worst_um = 0, stated_squares = 0, scatter = 0;
  int iterations = 0;
  for (int seed = 1; seed <= options.seeds; ++seed) {
    CaseScan scan =
        MakeScan(prepared.blade, kind, options.points, kNoiseMm, std::nullopt, static_cast<std::uint64_t>(seed));
    const TimedFit timed = FitPortion(prepared, PortionOf(std::move(scan.scan_mm)), options.threads);
    CountFailure(timed, figures);
    const double error_um = VertexDisplacementUm(prepared.blade, timed.stopped_at, ScanFromPart());
    const double stated_um =
        timed.fit.placed ? VertexDisplacementUm(prepared.blade, ScanFromPart(), timed.fit.placed->covariance) : 0;
    seconds.push_back(timed.seconds);
    processor_s.push_back(timed.processor_s);
    squares += error_um * error_um;
    bound_squares += scan.vertex_bound_um * scan.vertex_bound_um;
    stated_squares += stated_um * stated_um;
    worst_um = std::max(worst_um, error_um);
    scatter = 0.5 * scan.square_scatter / std::sqrt(options.seeds);  // of the ratio, a root
    iterations = std::max(iterations, timed.fit.evidence.iteration_count);
  }
  const double count = options.seeds, ratio = std::sqrt(squares / bound_squares);
  std::printf("%s   %8.3f s (%.3f to %.3f; of processors %.3f), at most %d iterations\n", name,
              metrology::Median(seconds), *std::min_element(seconds.begin(), seconds.end()),
              *std::max_element(seconds.begin(), seconds.end()), metrology::Median(processor_s), iterations);
  std::printf(
      "    error %.4f um rms, %.4f worst, bound %.4f; error/bound %.3f (at the bound 1 +- %.2f), stated/bound %.3f\n",
      std::sqrt(squares / count), worst_um, std::sqrt(bound_squares / count), ratio, scatter,
      std::sqrt(stated_squares / bound_squares));
  const std::string prefix = name[0] == 'A' ? "a_" : "c_";
  figures->values[prefix + "seconds"] = metrology::Median(seconds);
  figures->values[prefix + "processor_seconds"] = metrology::Median(processor_s);
  figures->values[prefix + "error_um"] = std::sqrt(squares / count);
  figures->values[prefix + "bound_um"] = std::sqrt(bound_squares / count);
  figures->values[prefix + "error_over_bound"] = ratio;
  figures->values[prefix + "stated_over_bound"] = std::sqrt(stated_squares / bound_squares);
}

void RunBumps(const PreparedBlade& prepared, const RunOptions& options, Figures* figures) {
  std::vector<double> seconds, processor_s;
  double squares = 0, worst_um = 0;
  std::uint64_t seed = 1;
  std::printf("D   bump at x, z    height    sigma  side\n");
  for (const Bump& bump : kBumps) {
    CaseScan scan = MakeScan(prepared.blade, CaseKind::kWellHeld, options.points, kNoiseMm, bump, seed++);
    const TimedFit timed = FitPortion(prepared, PortionOf(std::move(scan.scan_mm)), options.threads);
    CountFailure(timed, figures);
    const double error_um = VertexDisplacementUm(prepared.blade, timed.stopped_at, ScanFromPart());
    std::printf("    %5.0f %5.0f mm %6.2f mm %5.0f mm  %4d %8.3f s   error %8.4f um   sigma %.3f um   %2d iterations\n",
                bump.x_mm, bump.z_mm, bump.height_mm, bump.sigma_mm, bump.side, timed.seconds, error_um,
                1e3 * timed.fit.evidence.residual_sigma_mm, timed.fit.evidence.iteration_count);
    seconds.push_back(timed.seconds);
    processor_s.push_back(timed.processor_s);
    squares += error_um * error_um;
    worst_um = std::max(worst_um, error_um);
  }
  const double rms_um = std::sqrt(squares / static_cast<double>(seconds.size()));
  std::printf("D   %8.3f s (of processors %.3f)   error %8.4f um rms, %8.4f worst, of %zu bumps\n",
              metrology::Median(seconds), metrology::Median(processor_s), rms_um, worst_um, seconds.size());
  figures->values["d_seconds"] = metrology::Median(seconds);
  figures->values["d_processor_seconds"] = metrology::Median(processor_s);
  figures->values["d_rms_um"] = rms_um;
  figures->values["d_worst_um"] = worst_um;
}

}  // namespace

void RunCases(const PreparedBlade& prepared, const RunOptions& options, Figures* figures) {
  std::printf("\ncases: %zu points, %d seeds, %d threads; median time, the surface being ready\n", options.points,
              options.seeds, options.threads);
  RunAgainstBound("C", CaseKind::kWellHeld, prepared, options, figures);
  RunAgainstBound("A", CaseKind::kOneSide, prepared, options, figures);
  RunBumps(prepared, options, figures);
}

void RunThreads(const PreparedBlade& prepared, const RunOptions& options, Figures* figures) {
  bool same = true;
  for (const CaseKind kind : {CaseKind::kWellHeld, CaseKind::kOneSide}) {
    std::optional<Bump> bump;
    if (kind == CaseKind::kWellHeld) bump = kBumps[0];
    const metrology::ScanPortion portion =
        PortionOf(MakeScan(prepared.blade, kind, options.points, kNoiseMm, bump, 1).scan_mm);
    const metrology::PoseFit one = FitPortion(prepared, portion, 1).fit, two = FitPortion(prepared, portion, 2).fit;
    same =
        same && one.placed && two.placed &&
        std::memcmp(one.placed->zero_from_part.data(), two.placed->zero_from_part.data(), 16 * sizeof(double)) == 0 &&
        std::memcmp(one.placed->covariance.values.data(), two.placed->covariance.values.data(), 36 * sizeof(double)) ==
            0;
  }
  std::printf("\nthreads: pose and covariance on 1 and 2 threads have %s bits\n", same ? "the same" : "DIFFERENT");
  figures->values["same_bits"] = same ? 1 : 0;
  if (!same) ++figures->failures;
}

}  // namespace sixpoint::bench
