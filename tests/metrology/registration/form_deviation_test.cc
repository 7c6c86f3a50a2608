// What a part's smooth deviation from its CAD does to a pose, and what is said of it.
#include "metrology/registration/form_deviation.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "metrology/parallel/loops.h"
#include "tests/metrology/registration/sampled_blade.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

// The product of two places' draws of a length, added up, is the covariance that they stand for.
TEST(FormDraws, HaveTheCovarianceOfASmoothField) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> along(-40, 40);
  const auto unit = [&] { return Vector3d(along(random), along(random), along(random)).normalized(); };
  const std::array<double, 3> lengths_mm = {5, 10, 20};
  double squares = 0;
  int count = 0;
  for (const double apart_mm : {0.0, 3.0, 7.0, 15.0, 40.0})
    for (int i = 0; i < 200; ++i) {
      const Vector3d p(along(random), along(random), along(random)), q = p + apart_mm * unit();
      const Vector3d n = unit(), m = i % 2 == 0 ? n : unit();
      const auto product = FormDraws::At(p, n).cwiseProduct(FormDraws::At(q, m)).eval();
      for (int length = 0; length < 3; ++length) {
        const double ratio = apart_mm / lengths_mm[static_cast<std::size_t>(length)];
        double sum = 0;
        for (int k = length; k < FormDraws::kCount; k += 3) sum += product[k];
        const double error = sum - std::exp(-ratio * ratio / 2 - (n - m).squaredNorm() / 2);
        squares += error * error;
        ++count;
      }
    }
  // 64 waves leave 1 / sqrt(64) at most.
  EXPECT_LT(std::sqrt(squares / count), 0.125);
}

// Another field than the estimator's: few plane waves of one length.
double WavesAt(const Vector3d& part_mm, double wave_mm, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> phase(0, 2 * M_PI);
  std::normal_distribution<double> normal(0, 1);
  double sum = 0;
  constexpr int kWaves = 12;
  for (int k = 0; k < kWaves; ++k) {
    const double x = normal(random), y = normal(random), z = normal(random);
    sum += std::cos(2 * M_PI / wave_mm * Vector3d(x, y, z).normalized().dot(part_mm - kPartCentreMm) + phase(random));
  }
  return std::sqrt(2.0 / kWaves) * sum;
}

struct Seen {
  double off = 0, stated = 0;  // along the weakest direction, mm
};

// One side of the blade, which holds its span by its curvature alone.
Seen FitOneSide(double form_mm, double wave_mm, std::uint64_t seed) {
  SpreadSamples samples =
      Spread(*BladeSurface(), 15000, seed, [](const SurfacePoint& on) { return on.normal.y() > 0.2; });
  for (std::size_t i = 0; i < samples.points_mm.size(); ++i)
    samples.points_mm[i] += form_mm * WavesAt(samples.points_mm[i], wave_mm, seed) * samples.normals[i];
  FitOptions options;
  options.thread_count = 1;
  const auto fit = FitToSurface(*BladeSurface(), {PortionAtZero(Scanned(samples.points_mm, BladePose(), 2e-3, seed))},
                                StartPose(), MachineCalibration::Exact(), options);
  EXPECT_TRUE(fit.ok()) << fit.status();
  if (!fit.ok() || !fit->placed) return {};  // a few do not rest, and say so
  const PlacedPose& placed = *fit->placed;
  const double radius_mm = BladeSurface()->radius_of_gyration_mm();
  const Eigen::Isometry3d between = placed.zero_from_part * BladePose().inverse();
  const Vector3d centroid = placed.covariance.reference_mm;
  Vector6d error, scale = Vector6d::Ones();
  error << radius_mm * VectorFromRotation(between.linear()), between * centroid - centroid;
  scale.head<3>().setConstant(radius_mm);
  const Vector6d& weakest = fit->evidence.weakest_direction;
  const Matrix6d covariance = scale.asDiagonal() * placed.covariance.values * scale.asDiagonal();
  EXPECT_NEAR(fit->evidence.weakest_standard_uncertainty_mm, std::sqrt(weakest.dot(covariance * weakest)),
              1e-6 * fit->evidence.weakest_standard_uncertainty_mm);
  return {std::abs(weakest.dot(error)), fit->evidence.weakest_standard_uncertainty_mm};
}

// A smooth casting seen from one side, and a part whose form the patches do not show: 95 % holds the error, and not by size.
TEST(FormDeviation, IsInTheUncertaintyOfWhatItPulls) {
  struct Case {
    double form_mm, wave_mm;
  };
  // Waves that are correlated over 5.5, 11 and 18 mm.
  for (const Case& one : {Case{5e-3, 20}, Case{5e-3, 40}, Case{5e-3, 65}, Case{3e-4, 60}}) {
    constexpr std::size_t kDraws = 60;
    std::vector<Seen> seen(kDraws);
    ForEach(kDraws, 2, [&](std::size_t i) { seen[i] = FitOneSide(one.form_mm, one.wave_mm, 100 + i); });
    int inside = 0, count = 0;
    double squares = 0;
    for (const Seen& fit : seen) {
      if (!(fit.stated > 0)) continue;
      ++count;
      inside += fit.off <= 1.96 * fit.stated ? 1 : 0;
      squares += fit.off * fit.off / (fit.stated * fit.stated);
    }
    const double real_over_stated = std::sqrt(squares / count);
    std::printf("form %.1f um, waves of %.0f mm: %d converged, inside %.0f %%, real over stated %.2f\n",
                1e3 * one.form_mm, one.wave_mm, count, 100.0 * inside / count, real_over_stated);
    EXPECT_GE(count, 50);
    EXPECT_GE(inside, 0.85 * count);
    EXPECT_LT(real_over_stated, 1.25);
    EXPECT_GT(real_over_stated, 0.3);
  }
}

}  // namespace
}  // namespace sixpoint::metrology
