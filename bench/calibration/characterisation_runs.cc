// How a rotary axis positions, from encoder runs, against the bound of its error's components.
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "bench/calibration/runs.h"
#include "metrology/parallel/loops.h"
#include "tests/metrology/calibration/encoder_bench.h"

namespace sixpoint::bench {

void RunCharacterisation(const RunOptions& options, Figures* figures) {
  constexpr double kNoise_rad = 5e-4 * M_PI / 180;
  const sixpoint::testing::Axis truth;
  const Eigen::MatrixXd information = truth.Information(sixpoint::testing::EncoderRun(truth, 0, nullptr), kNoise_rad);
  const Eigen::MatrixXd bound = information.ldlt().solve(Eigen::MatrixXd::Identity(10, 10));
  std::vector<absl::StatusOr<metrology::AxisCharacterisation>> found(static_cast<std::size_t>(options.seeds),
                                                                     absl::UnknownError("not run"));
  const auto characterise = [&](int seed) {
    std::mt19937_64 random(static_cast<std::uint64_t>(seed) + 1);
    return metrology::CharacteriseAxis(sixpoint::testing::EncoderRun(truth, kNoise_rad, &random));
  };
  metrology::ForEach(options.seeds, options.threads,
                     [&](int seed) { found[static_cast<std::size_t>(seed)] = characterise(seed); });
  ErrorStatistics axis("axis characterisation",
                       {"mean", "reversal", "cos 1", "sin 1", "cos 2", "sin 2", "cos 3", "sin 3", "cos 90", "sin 90"});
  int right = 0;
  for (const auto& run : found) {
    if (!run.ok()) Stop(run.status());
    const auto error = truth.ErrorOf(*run);
    if (!error) continue;  // other orders than the truth's: other parameters
    ++right;
    axis.Add(*error, bound, run->covariance_rad2.topLeftCorner(10, 10));
  }
  for (int seed = 0; seed < std::min(options.seeds, 20); ++seed) {
    const auto alone = characterise(seed);
    const auto& beside = found[static_cast<std::size_t>(seed)];
    figures->Compare(alone->covariance_rad2 == beside->covariance_rad2 &&
                     alone->table.forward_rad == beside->table.forward_rad &&
                     alone->table.backward_rad == beside->table.backward_rad);
  }
  std::printf("\n-- axis characterisation: %d runs of 1522 encoder readings, 0.0005 deg; orders found: %d\n",
              options.seeds, right);
  axis.Print();
  figures->values["characterisation_variance_over_bound"] = axis.variance_over_bound();
  figures->values["characterisation_worst_bias_sigma"] = axis.worst_bias_sigma();
  figures->values["characterisation_coverage_percent"] = axis.coverage_percent();
  figures->values["characterisation_orders_found_percent"] = 100.0 * right / options.seeds;
}

}  // namespace sixpoint::bench
