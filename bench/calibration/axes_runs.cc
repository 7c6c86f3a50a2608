#include <Eigen/LU>
#include <chrono>
#include <cmath>
#include <cstdio>

#include "bench/calibration/runs.h"
#include "metrology/calibration/rotation_calibration.h"
#include "metrology/frames/angles.h"
#include "simulator/machine.h"

namespace sixpoint::bench {
namespace {

using metrology::kRadPerDeg;
constexpr double kProbeNoise_um = 1;
using Vector8d = Eigen::Matrix<double, 8, 1>;

// The truth's lines as tangent coordinates at the lines found.
Vector8d ErrorOf(const metrology::RotaryAxes& found, const metrology::RotaryAxes& truth) {
  Vector8d error;
  int k = 0;
  for (const auto& [f, t] : {std::pair{found.a, truth.a}, {found.b, truth.b}}) {
    const Eigen::Matrix<double, 3, 2> across = metrology::TangentBasis(f.direction);
    const Eigen::Vector3d on_truth = t.point_mm + t.direction * t.direction.dot(f.point_mm - t.point_mm);
    error.segment<2>(k) = across.transpose() * (f.direction - t.direction);
    error.segment<2>(k + 2) = across.transpose() * (f.point_mm - on_truth);
    k += 4;
  }
  return error;
}

// Where the sphere stands: turned about B's line, then about A's. By Rodrigues' formula, apart from the kernel's own.
Eigen::Vector3d Turned(const metrology::AxisLine& axis, double angle, const Eigen::Vector3d& p) {
  const Eigen::Vector3d d = axis.direction.normalized(), r = p - axis.point_mm;
  return axis.point_mm + r * std::cos(angle) + d.cross(r) * std::sin(angle) + d * d.dot(r) * (1 - std::cos(angle));
}

// Inverse Fisher information of the fitted poses, by central differences about the truth, in tangent coordinates at
// `reference` (where the estimate's own error is told).
metrology::AxesCovariance BoundOf(const simulator::MachineTruth& truth, const std::vector<metrology::SpherePose>& poses,
                                  const metrology::RotaryAxes& reference) {
  metrology::RotaryAxes axes = truth.axes;  // its points moved to where the estimate has them
  for (const auto& [line, at] : {std::pair{&axes.a, reference.a.point_mm}, std::pair{&axes.b, reference.b.point_mm}})
    line->point_mm += line->direction * line->direction.dot(at - line->point_mm);
  const Eigen::Matrix<double, 3, 2> across[2] = {metrology::TangentBasis(axes.a.direction),
                                                 metrology::TangentBasis(axes.b.direction)};
  Eigen::Matrix<double, 11, 11> information = Eigen::Matrix<double, 11, 11>::Zero();
  for (const metrology::SpherePose& pose : poses) {
    if (pose.held_out) continue;
    Eigen::Matrix<double, 3, 11> slope;
    for (int k = 0; k < 11; ++k) {
      const double size = k < 8 && k % 4 < 2 ? 1e-6 : 1e-3;
      const auto at = [&](double step) {
        metrology::RotaryAxes moved = axes;
        Eigen::Vector3d sphere = truth.sphere_in_zero_mm;
        metrology::AxisLine& line = k < 4 ? moved.a : moved.b;
        if (k >= 8)
          sphere(k - 8) += step;
        else
          (k % 4 < 2 ? line.direction : line.point_mm) += step * across[k / 4].col(k % 2);
        return Turned(moved.a, pose.a_rad, Turned(moved.b, pose.b_rad, sphere));
      };
      slope.col(k) = (at(size) - at(-size)) / (2 * size);
    }
    information += slope.transpose() * slope;
  }
  const Eigen::Matrix<double, 11, 1> scale = information.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::Matrix<double, 11, 11> inverse =
      Eigen::Matrix<double, 11, 11>(scale.asDiagonal() * information * scale.asDiagonal()).inverse();
  return 1e-6 * kProbeNoise_um * kProbeNoise_um *
         (scale.asDiagonal() * inverse * scale.asDiagonal()).topLeftCorner<8, 8>();
}

}  // namespace

void RunAxes(const RunOptions& options, Figures* figures) {
  const simulator::MachineDesign design;
  const std::vector<std::string> names{"A direction e1", "A direction e2", "A point e1", "A point e2",
                                       "B direction e1", "B direction e2", "B point e1", "B point e2"};
  ErrorStatistics lines("rotary axes, LINES", names), point_c("rotary axes, POINT_C", names);
  double worst_s = 0, lines_check = 0, point_check = 0;
  for (int seed = 0; seed < options.seeds; ++seed) {
    const simulator::MachineTruth truth = simulator::MountedByHand(design, 5000 + seed);
    std::vector<metrology::SpherePose> poses;
    for (const simulator::ProbedSphere& p : simulator::ProbeSphere(truth, kProbeNoise_um, 9000 + seed))
      poses.push_back({p.a_deg * kRadPerDeg, p.b_deg * kRadPerDeg, p.centre_mm, p.held_out});
    metrology::RotationOptions rotation;  // the uncertainty is not stated: the residuals show it
    rotation.nominal.a.point_mm = rotation.nominal.b.point_mm = design.centre_mm;
    const auto begin = std::chrono::steady_clock::now();
    const auto found = metrology::CalibrateRotation(poses, rotation);
    worst_s = std::max(worst_s, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    const auto paper = metrology::CalibratePointC(poses, rotation);
    if (!found.ok() || !paper.ok()) Stop(found.ok() ? paper.status() : found.status());
    const metrology::AxesCovariance bound = BoundOf(truth, poses, found->axes);
    lines.Add(ErrorOf(found->axes, truth.axes), bound, found->covariance);
    point_c.Add(ErrorOf(paper->axes, truth.axes), bound, paper->covariance);
    lines_check += found->check_rms_mm / options.seeds;
    point_check += paper->check_rms_mm / options.seeds;
  }
  std::printf("\n-- rotary axes: %d runs, 36 poses of a sphere and 12 held out, touch %.0f um\n", options.seeds,
              kProbeNoise_um);
  lines.Print();
  point_c.Print();
  std::printf("held-out poses, mean rms: LINES %.2f um, POINT_C %.2f um; slowest fit %.4f s\n", 1e3 * lines_check,
              1e3 * point_check, worst_s);
  figures->kinds.push_back(lines);
  figures->values["axes_variance_over_bound"] = lines.variance_over_bound();
  figures->values["axes_reported_over_bound"] = lines.reported_over_bound();
  figures->values["axes_worst_bias_sigma"] = lines.worst_bias_sigma();
  figures->values["axes_held_out_rms_um"] = 1e3 * lines_check;
  figures->values["point_c_held_out_rms_um"] = 1e3 * point_check;
  figures->values["axes_seconds"] = worst_s;
}

}  // namespace sixpoint::bench
