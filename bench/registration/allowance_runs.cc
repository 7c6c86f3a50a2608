// Does the part lie in its blank? Blanks that contain it, or do not, by a margin known from how they were made.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "bench/registration/machine_scans.h"
#include "bench/registration/runs.h"
#include "metrology/parallel/loops.h"
#include "metrology/registration/allowance.h"

namespace sixpoint::bench {
namespace {

using Eigen::Vector3d;

const Vector3d kHalf(20, 10, 4);  // of the design, a box: what any pose can do between two faces is known exactly
constexpr std::size_t kAllowancePoints = 40'000;
constexpr double kPitMm = 3;           // half of its side; a patch lies wholly in it wherever patches fall
constexpr double kScannedPart = 0.95;  // of each face, from its middle
// Stock is the mean over patches of 1 mm: wherever they fall, the outermost whole one's middle is no farther from an edge.
constexpr double kPatchesMm = 1.5;
constexpr double kRightUm = 3;

std::shared_ptr<const metrology::Surface> Design() {
  metrology::TriangleMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.vertices_mm.push_back(kHalf.cwiseProduct(Vector3d(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1)));
  const std::array<std::array<std::uint32_t, 4>, 6> faces = {
      {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};
  for (const auto& f : faces) {
    mesh.triangles.push_back({f[0], f[1], f[2]});
    mesh.triangles.push_back({f[0], f[2], f[3]});
  }
  return *metrology::Surface::Prepare(mesh);
}

struct AllowanceOutcome {
  double margin_um = 0;  // truth: the least stock of the best pose over what is asked; negative: lacking
  double said_um = 0;    // lacking, where infeasible
  bool infeasible = false, converged = false;
  double kept_um = 0;  // true least stock at the pose found, over what is asked
};

// The box grown by a stock that differs from face to face, with two pits opposite each other in the large faces, so deep
// that the best pose leaves there just the stock asked for and `margin_um`; the whole turned and shifted.
AllowanceOutcome RunOne(const metrology::Surface& design, double margin_um, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::normal_distribution<double> normal(0, 1);
  std::array<double, 6> stock_mm{};
  for (double& stock : stock_mm) stock = 0.5 + 0.15 * unit(random);
  const double asked_mm = 0.1 + 0.05 * unit(random);
  const double share = 0.5 + 0.3 * unit(random);  // of what both pits take, by the upper
  const double pits_mm = stock_mm[4] + stock_mm[5] - 2 * (asked_mm + 1e-3 * margin_um);
  const Vector3d pit(unit(random) * (0.8 * kHalf.x() - kPitMm), unit(random) * (0.8 * kHalf.y() - kPitMm), 0);
  const std::array<double, 2> depth_mm{pits_mm * (1 - share), pits_mm * share};
  metrology::Vector6d off;
  for (int k = 0; k < 6; ++k) off[k] = (k < 3 ? 5e-3 : 0.2) * unit(random);
  const Eigen::Isometry3d zero_from_blank = metrology::Perturbed(Eigen::Isometry3d::Identity(), off, Vector3d::Zero());
  const Vector3d areas(kHalf.y() * kHalf.z(), kHalf.x() * kHalf.z(), kHalf.x() * kHalf.y());
  const auto in_pit = [&](const Vector3d& p) { return (p - pit).head<2>().cwiseAbs().maxCoeff() < kPitMm; };
  metrology::Points points;
  while (points.size() < kAllowancePoints) {
    const double pick = 0.5 * (unit(random) + 1) * areas.sum();
    const int axis = pick < areas.x() ? 0 : pick < areas.x() + areas.y() ? 1 : 2;
    const bool high = unit(random) > 0;
    const double x = unit(random), y = unit(random), z = unit(random);
    Vector3d p = kScannedPart * Vector3d(x, y, z).cwiseProduct(kHalf);
    double out_mm = stock_mm[static_cast<std::size_t>(2 * axis + high)];
    if (axis == 2 && in_pit(p)) out_mm -= depth_mm[high];
    p[axis] = (high ? 1 : -1) * (kHalf[axis] + out_mm + kNoiseMm * normal(random));
    points.push_back(zero_from_blank * p);
  }
  metrology::AllowanceOptions allowance;
  allowance.least_stock_mm = asked_mm;
  allowance.least_side_part = 0.8;  // 0.95 of its length and of its width were scanned
  metrology::FitOptions options;
  options.thread_count = 1;
  const auto found = metrology::FitWithAllowance(design, {PortionOf(points)}, Eigen::Isometry3d::Identity(), allowance,
                                                 metrology::MachineCalibration::Exact(), options);
  AllowanceOutcome outcome;
  outcome.margin_um = margin_um;
  if (!found.ok()) return outcome;
  outcome.infeasible = found->fit.outcome == metrology::Outcome::kInfeasible;
  outcome.converged = found->fit.outcome == metrology::Outcome::kConverged;
  outcome.said_um = 1e3 * found->stock.lacking_mm;
  // What the pose leaves in truth: the blank's own faces, without noise, within the faces and the pits.
  const Eigen::Isometry3d part_from_blank = found->fit.evidence.stopped_at->inverse(Eigen::Isometry) * zero_from_blank;
  double least_mm = 1e9;
  for (int axis = 0; axis < 3; ++axis)
    for (const bool high : {false, true})
      for (const bool inside : {false, true}) {
        if (inside && axis != 2) continue;
        const double out_mm = stock_mm[static_cast<std::size_t>(2 * axis + high)] - (inside ? depth_mm[high] : 0);
        for (int corner = 0; corner < 4; ++corner) {
          const double u = corner & 1 ? 1 : -1, v = corner & 2 ? 1 : -1;
          Vector3d p;
          p[(axis + 1) % 3] = u * (kScannedPart * kHalf[(axis + 1) % 3] - kPatchesMm);
          p[(axis + 2) % 3] = v * (kScannedPart * kHalf[(axis + 2) % 3] - kPatchesMm);
          if (inside) p = pit + (kPitMm - kPatchesMm) * Vector3d(u, v, 0);
          p[axis] = (high ? 1 : -1) * (kHalf[axis] + out_mm);
          least_mm = std::min(least_mm, (high ? 1 : -1) * (part_from_blank * p)[axis] - kHalf[axis]);
        }
      }
  outcome.kept_um = 1e3 * (least_mm - asked_mm);
  return outcome;
}

}  // namespace

void RunAllowance(const PreparedBlade&, const RunOptions& options, Figures* figures) {
  const auto design = Design();
  std::printf(
      "\nallowance: blanks with two pits opposite each other, %zu points, %d draws each; margin of the best pose\n",
      kAllowancePoints, options.allowance_draws);
  std::printf("%12s %10s %12s %28s %32s\n", "margin um", "contained", "infeasible", "lacking said less truth, um",
              "true stock over asked, um");
  int wrong = 0, runs = 0;
  double worst_depth_um = 0, worst_kept_um = 0;
  for (const double margin_um : {100.0, 20.0, 5.0, 1.0, -1.0, -5.0, -20.0, -100.0}) {
    std::vector<AllowanceOutcome> all(static_cast<std::size_t>(options.allowance_draws));
    metrology::ForEach(all.size(), options.threads, [&](std::size_t i) { all[i] = RunOne(*design, margin_um, 1 + i); });
    int contained = 0, infeasible = 0;
    double depth_rms = 0, depth_mean = 0, least_kept = 1e9;
    for (const AllowanceOutcome& one : all) {
      contained += one.converged;
      infeasible += one.infeasible;
      const double off_um = one.said_um + margin_um;
      depth_mean += off_um / static_cast<double>(all.size());
      depth_rms += off_um * off_um / static_cast<double>(all.size());
      least_kept = std::min(least_kept, one.kept_um);
      if (margin_um < 0 && one.infeasible) worst_depth_um = std::max(worst_depth_um, std::abs(off_um));
      if (std::abs(margin_um) >= kRightUm) {
        ++runs;
        wrong += margin_um > 0 ? !one.converged : !one.infeasible;
        if (margin_um > 0) worst_kept_um = std::min(worst_kept_um, one.kept_um);
      }
    }
    char depth[64] = "-";
    if (margin_um < 0) std::snprintf(depth, sizeof depth, "mean %.2f, rms %.2f", depth_mean, std::sqrt(depth_rms));
    std::printf("%12g %10d %12d %28s %26s %.2f\n", margin_um, contained, infeasible, depth, "least", least_kept);
  }
  std::printf("  wrong answers at margins of %g um and more: %d of %d\n", kRightUm, wrong, runs);
  figures->values["allowance_wrong"] = wrong;
  figures->values["allowance_worst_depth_um"] = worst_depth_um;
  figures->values["allowance_least_true_stock_over_asked_um"] = worst_kept_um;
}

}  // namespace sixpoint::bench
