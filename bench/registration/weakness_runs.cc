// What "weakly held" is worth: condition, stated and real error along the weakest direction, the span's evidence getting less.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "bench/registration/machine_scans.h"
#include "bench/registration/runs.h"
#include "metrology/parallel/loops.h"
#include "metrology/statistics/ranks.h"

namespace sixpoint::bench {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kWeaklyHeldPoints = 50'000;
constexpr double kCoverageFactor = 1.96;
constexpr double kCastingUm = 5;  // rms; as a ground or cast airfoil deviates within its tolerance
constexpr double kCastingWaveMm = 12;
constexpr int kWaves = 24;

// A random smooth field over the part, the sum of many plane waves.
class Casting {
 public:
  explicit Casting(std::uint64_t seed) : random_(seed) {
    std::normal_distribution<double> normal(0, 2 * M_PI / kCastingWaveMm / std::sqrt(3.0));
    std::uniform_real_distribution<double> phase(0, 2 * M_PI);
    for (int k = 0; k < kWaves; ++k) {
      const double x = normal(random_), y = normal(random_), z = normal(random_);
      waves_.push_back({Vector3d(x, y, z), phase(random_)});
    }
  }
  double AtMm(const Vector3d& part_mm) const {
    double sum = 0;
    for (const auto& [wave, phase] : waves_) sum += std::cos(wave.dot(part_mm) + phase);
    return 1e-3 * kCastingUm * std::sqrt(2.0 / kWaves) * sum;
  }

 private:
  std::mt19937_64 random_;
  std::vector<std::pair<Vector3d, double>> waves_;
};

struct Kind {
  const char* words;
  CaseKind kind;
  bool other_side;      // is seen too
  int tip_every;        // of the tip's points, one in so many; 0: none
  double half_span_mm;  // points farther from the middle are left out
};
constexpr Kind kKinds[] = {{"C: both sides and the tip", CaseKind::kWellHeld, true, 1, 50},
                           {"C, a tenth of the tip's points", CaseKind::kWellHeld, true, 10, 50},
                           {"both sides, no tip", CaseKind::kWellHeld, true, 0, 50},
                           {"one side and the tip", CaseKind::kWellHeld, false, 1, 50},
                           {"one side, a tenth of the tip", CaseKind::kWellHeld, false, 10, 50},
                           {"one side, a hundredth of the tip", CaseKind::kWellHeld, false, 100, 50},
                           {"A: one side", CaseKind::kOneSide, false, 0, 50},
                           {"A, the middle 40 mm of the span", CaseKind::kOneSide, false, 0, 20},
                           {"A, the middle 10 mm", CaseKind::kOneSide, false, 0, 5}};

struct WeaknessOutcome {
  bool converged = false, weak = false;
  double condition = 0, stated_um = 0, off_um = 0, vertex_um = 0, noise_um = 0;
};

WeaknessOutcome RunOne(const PreparedBlade& prepared, const Kind& kind, bool cast, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, 1);
  const Casting casting(seed);
  CaseSampler sampler(prepared.blade, kind.kind, kNoiseMm, std::nullopt, seed);
  const Eigen::Isometry3d pose = ScanFromPart();
  metrology::Points points;
  for (int tip = 0; points.size() < kWeaklyHeldPoints;) {
    const CaseSampler::OnSurface on = sampler.NextOnSurface();
    if (std::abs(on.part_mm.z()) > kind.half_span_mm) continue;
    if (on.normal.z() > kTipNormal && (kind.tip_every == 0 || ++tip % kind.tip_every != 0)) continue;
    if (!kind.other_side && on.normal.y() < 0) continue;
    const double off_mm = cast ? casting.AtMm(on.part_mm) : 0, x = normal(random), y = normal(random),
                 z = normal(random);
    points.push_back(pose * (on.part_mm + off_mm * on.normal + kNoiseMm * Vector3d(x, y, z)));
  }
  metrology::FitOptions options;
  options.thread_count = 1;
  const auto fit = metrology::FitToSurface(*prepared.surface, {PortionOf(points)}, Displaced(pose, 0.2, 2e-3, seed),
                                           metrology::MachineCalibration::Exact(), options);
  WeaknessOutcome outcome;
  if (!fit.ok()) return outcome;
  outcome.converged = fit->outcome == metrology::Outcome::kConverged;
  outcome.condition = fit->evidence.condition_number;
  outcome.stated_um = 1e3 * fit->evidence.weakest_standard_uncertainty_mm;
  outcome.noise_um = 1e3 * fit->evidence.noise_sigma_mm;
  const Eigen::Isometry3d& found = *fit->evidence.stopped_at;
  metrology::Vector6d error = PoseError(found, pose, found * prepared.surface->centroid_mm());
  error.head<3>() *= prepared.surface->radius_of_gyration_mm();
  outcome.off_um = 1e3 * std::abs(error.dot(fit->evidence.weakest_direction));
  outcome.vertex_um = VertexDisplacementUm(prepared.blade, found, pose);
  return outcome;
}

}  // namespace

void RunWeakness(const PreparedBlade& prepared, const RunOptions& options, Figures* figures) {
  std::printf("\nweakly held: %zu points, %d draws each; um along the weakest direction, medians and rms\n",
              kWeaklyHeldPoints, options.weakness_draws);
  std::printf("%-34s %-10s %10s %10s %10s %12s %10s %10s\n", "", "casting", "condition", "stated", "real rms",
              "real/stated", "covered %", "converged");
  int row = 0;
  for (const Kind& kind : kKinds) {
    ++row;
    for (const bool cast : {false, true}) {
      std::vector<WeaknessOutcome> all(static_cast<std::size_t>(options.weakness_draws));
      metrology::ForEach(all.size(), options.threads,
                         [&](std::size_t i) { all[i] = RunOne(prepared, kind, cast, 1 + i); });
      std::vector<double> condition, stated;
      double squares = 0, ratios = 0, covered = 0, converged = 0;
      for (const WeaknessOutcome& one : all) {
        if (!one.converged) continue;
        converged += 1;
        condition.push_back(one.condition);
        stated.push_back(one.stated_um);
        squares += one.off_um * one.off_um;
        ratios += one.off_um * one.off_um / (one.stated_um * one.stated_um);
        covered += one.off_um < kCoverageFactor * one.stated_um ? 1 : 0;
      }
      if (converged == 0) {
        std::printf("%-34s %-10s none converged\n", kind.words, cast ? "5 um" : "none");
        continue;
      }
      std::printf("%-34s %-10s %10.1f %10.3f %10.3f %12.2f %10.1f %7.0f of %zu\n", kind.words, cast ? "5 um" : "none",
                  metrology::Median(condition), metrology::Median(stated), std::sqrt(squares / converged),
                  std::sqrt(ratios / converged), 100 * covered / converged, converged, all.size());
      const std::string key = "weak_" + std::to_string(row) + (cast ? "_cast_" : "_true_");
      figures->values[key + "condition"] = metrology::Median(condition);
      figures->values[key + "stated_um"] = metrology::Median(stated);
      figures->values[key + "real_um"] = std::sqrt(squares / converged);
      figures->values[key + "real_over_stated"] = std::sqrt(ratios / converged);
    }
  }
}

}  // namespace sixpoint::bench
