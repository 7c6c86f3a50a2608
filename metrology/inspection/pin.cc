#include "metrology/inspection/pin.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "metrology/frames/angles.h"
#include "metrology/inspection/largest_cluster.h"
#include "metrology/kinematics/rotary_axes.h"
#include "metrology/linear_algebra/least_squares.h"
#include "metrology/statistics/ranks.h"

namespace sixpoint::metrology {
namespace {

constexpr double kTukey = 4.685;           // 95 % efficiency on normal noise
constexpr double kTopMargin_mm = 0.1;      // below the pin's top: its edge is not the cylinder
constexpr double kLeastSigma_mm = 0.5e-3;  // below any scanner's noise
using Parameters = Eigen::Matrix<double, 5, 1>;

// Distance from the axis of the parameters, and its derivative by c1, c2, s1, s2.
struct Radial {
  double distance_mm;
  Eigen::Vector3d outward;  // unit, from the axis to the point
  double along;             // axis parameter of the foot
};
Radial RadialOf(const Parameters& p, const Eigen::Vector3d& local) {
  const Eigen::Vector3d direction(p[2], p[3], 1);
  const Eigen::Vector3d from(local.x() - p[0], local.y() - p[1], local.z());
  const double along = from.dot(direction) / direction.squaredNorm();
  const Eigen::Vector3d out = from - along * direction;
  const double distance = out.norm();
  return {distance, distance > 0 ? Eigen::Vector3d(out / distance) : Eigen::Vector3d::UnitX(), along};
}
Parameters RowOf(const Radial& radial) {
  Parameters row;
  row << -radial.outward.x(), -radial.outward.y(), -radial.along * radial.outward.x(),
      -radial.along * radial.outward.y(), -1;
  return row;
}

// Kasa's circle through the points seen along the nominal axis: x^2 + y^2 = 2 c x + 2 d y + e.
Parameters AlgebraicCircle(const Points& local) {
  Eigen::MatrixXd left(local.size(), 3);
  Eigen::VectorXd right(local.size());
  for (std::size_t i = 0; i < local.size(); ++i) {
    left.row(i) << 2 * local[i].x(), 2 * local[i].y(), 1;
    right[i] = local[i].head<2>().squaredNorm();
  }
  const Eigen::Vector3d solution = LeastSquares(left, right);
  Parameters p;
  p << solution[0], solution[1], 0, 0, std::sqrt(std::max(0.0, solution[2] + solution.head<2>().squaredNorm()));
  return p;
}

struct Normal {
  Eigen::Matrix<double, 5, 5> matrix = Eigen::Matrix<double, 5, 5>::Zero();
  Parameters right = Parameters::Zero();
};
double WeightOf(double residual, double sigma) {
  const double u = residual / (kTukey * sigma);
  return std::abs(u) < 1 ? (1 - u * u) * (1 - u * u) : 0;
}
Normal NormalOf(const Parameters& p, const Points& local, double sigma) {
  Normal normal;
  for (const Eigen::Vector3d& point : local) {
    const Radial radial = RadialOf(p, point);
    const double residual = radial.distance_mm - p[4], weight = WeightOf(residual, sigma);
    if (weight == 0) continue;
    const Parameters row = RowOf(radial);
    normal.matrix += weight * row * row.transpose();
    normal.right -= weight * residual * row;
  }
  return normal;
}

double SigmaOf(const Parameters& p, const Points& local) {
  std::vector<double> absolute(local.size());
  for (std::size_t i = 0; i < local.size(); ++i) absolute[i] = std::abs(RadialOf(p, local[i]).distance_mm - p[4]);
  return std::max(kLeastSigma_mm, RobustSigmaOfMagnitudes(std::move(absolute)));
}

// Degrees of the circumference in cells of 10 deg that hold at least three points.
double ArcOf(const Points& local, const Parameters& p, const std::vector<std::size_t>& used) {
  std::array<int, 36> cells{};
  for (const std::size_t i : used) {
    const Eigen::Vector3d out = RadialOf(p, local[i]).outward;
    const int cell = static_cast<int>(std::floor((std::atan2(out.y(), out.x()) + kPi) / (2 * kPi) * 36));
    ++cells[std::clamp(cell, 0, 35)];
  }
  return 10.0 * std::count_if(cells.begin(), cells.end(), [](int count) { return count >= 3; });
}

// The cylinder through the points, and their scale about it; why there is none, or nothing. The scale shrinks from the first
// guess's spread to the noise, so that the loss rejects no part of the pin too early.
std::string Settle(const Points& local, int held_step_count, Parameters* p, double* sigma) {
  constexpr int kSteps = 60;
  *sigma = std::max(0.03, SigmaOf(*p, local));
  for (int iteration = 0; iteration < kSteps + held_step_count; ++iteration) {
    const Normal normal = NormalOf(*p, local, *sigma);
    const Parameters step = normal.matrix.ldlt().solve(normal.right);
    if (!step.allFinite() || step.head<2>().norm() > 1) return "the points do not determine a cylinder";
    *p += step;
    // Scale and cylinder may go round and round each other, by nanometres: in the steps beyond it is held.
    const double wanted = iteration < kSteps ? SigmaOf(*p, local) : *sigma;
    const bool shrinking = *sigma > 1.02 * wanted;
    *sigma = shrinking ? std::max(wanted, *sigma / 2) : wanted;
    if (!shrinking && step.head<4>().norm() < 1e-9) return "";
  }
  return "the cylinder fit did not converge";
}

// How well a pin was seen.
struct PinSight {
  double sigma_mm, used_share, height_mm, arc_deg;
};

// Why a fitted cylinder is not taken for the hole's pin; nothing where it is.
std::string Unfit(const PinSight& seen, const PinFit& fit, const NominalPin& nominal, const PinLimits& limits) {
  if (seen.sigma_mm * 1e3 > limits.greatest_sigma_um)
    return ReasonText("residuals of the cylinder spread by %.1f um, want at most %g", seen.sigma_mm * 1e3,
                      limits.greatest_sigma_um);
  if (seen.used_share < limits.least_used_share)
    return ReasonText("%.2f of the points lie on the cylinder, want at least %g", seen.used_share,
                      limits.least_used_share);
  const double ratio = 2 * fit.radius_mm / nominal.hole_diameter_mm;
  if (nominal.gauge) {
    const double allowed_mm =
        limits.greatest_diameter_difference_um / 1e3 +
        2 * std::hypot(nominal.gauge->diameter_standard_uncertainty_mm, 2 * std::sqrt(fit.noise_covariance(4, 4)));
    if (!(std::abs(2 * fit.radius_mm - nominal.gauge->diameter_mm) <= allowed_mm))
      return ReasonText("fitted diameter %.4f mm, want the gauge pin's %g mm: another pin, or none", 2 * fit.radius_mm,
                        nominal.gauge->diameter_mm);
  } else if (!(ratio >= limits.least_diameter_ratio && ratio <= limits.greatest_diameter_ratio))
    return ReasonText("fitted diameter %.4f mm does not fit the hole's %g mm", 2 * fit.radius_mm,
                      nominal.hole_diameter_mm);
  if (seen.height_mm < limits.least_height_mm)
    return ReasonText("seen over %.2f mm of its length, want at least %g", seen.height_mm, limits.least_height_mm);
  if (seen.arc_deg < limits.least_arc_deg)
    return ReasonText("%.0f deg of the circumference seen, want at least %g", seen.arc_deg, limits.least_arc_deg);
  return fit.noise_covariance.allFinite() ? "" : "the points do not determine a cylinder";
}

// The diameter is known beside the points: an observation of one parameter (Kalman's update). Where a pin shines or its edge is
// blurred the scanner sees another diameter than the certificate's, anywhere within what is let pass.
void TakeDiameter(const GaugePin& gauge, const PinLimits& limits, PinFit* fit) {
  const double seen_otherwise_mm = limits.greatest_diameter_difference_um / 1e3 / 2;
  const double variance =
      std::pow(gauge.diameter_standard_uncertainty_mm / 2, 2) + seen_otherwise_mm * seen_otherwise_mm / 3;
  const Parameters weight = fit->noise_covariance.col(4) / (fit->noise_covariance(4, 4) + variance);
  const Parameters change = weight * (gauge.diameter_mm / 2 - fit->radius_mm);
  fit->radius_kept = 1 - weight[4];
  fit->offset_mm += change.head<2>();
  fit->slope += change.segment<2>(2);
  for (Eigen::Matrix<double, 5, 3>& gain : fit->gain) gain -= weight * gain.row(4).eval();
  Eigen::Matrix<double, 5, 5> kept = Eigen::Matrix<double, 5, 5>::Identity();
  kept.col(4) -= weight;
  fit->noise_covariance = kept * fit->noise_covariance * kept.transpose() + variance * weight * weight.transpose();
}

// The points that settle the cylinder, how it follows each of them, and its noise. How much of the height they span.
double Influence(const Points& local, const Parameters& p, double sigma, const Eigen::Matrix3d& local_from_part,
                 PinFit* fit) {
  // With psi = weight * residual, curvature = sum psi' row row'.
  Eigen::Matrix<double, 5, 5> curvature = Eigen::Matrix<double, 5, 5>::Zero(), scatter = curvature;
  std::vector<double> slopes;
  std::vector<Radial> radials;
  double squares = 0, lowest = 0, highest = 0;
  for (std::size_t i = 0; i < local.size(); ++i) {
    const Radial radial = RadialOf(p, local[i]);
    const double residual = radial.distance_mm - p[4], weight = WeightOf(residual, sigma);
    if (weight == 0) continue;
    if (fit->used.empty()) lowest = highest = local[i].z();
    lowest = std::min(lowest, local[i].z());
    highest = std::max(highest, local[i].z());
    squares += residual * residual;
    fit->used.push_back(i);
    radials.push_back(radial);
    fit->residuals.push_back({residual, std::atan2(radial.outward.y(), radial.outward.x()), local[i].z(),
                              local_from_part.transpose() * radial.outward});
    const double root = std::sqrt(weight);
    slopes.push_back(root * (5 * root - 4));  // (1 - u^2) (1 - 5 u^2)
    const Parameters row = RowOf(radial);
    curvature += slopes.back() * row * row.transpose();
    scatter += weight * weight * residual * residual * row * row.transpose();
  }
  const Eigen::Matrix<double, 5, 5> inverse = curvature.ldlt().solve(Eigen::Matrix<double, 5, 5>::Identity());
  for (std::size_t i = 0; i < radials.size(); ++i) {
    const Parameters pull = -slopes[i] * (inverse * RowOf(radials[i]));
    fit->gain.push_back(pull * (radials[i].outward.transpose() * local_from_part));
  }
  fit->residual_rms_um = fit->used.empty() ? 0 : 1e3 * std::sqrt(squares / static_cast<double>(fit->used.size()));
  fit->noise_covariance = inverse * scatter * inverse;
  return highest - lowest;
}

// The cylinder through all of them.
PinFit FitAll(const NominalPin& nominal, const Points& points_in_part_mm, const PinLimits& limits) {
  PinFit fit;
  fit.across = TangentBasis(nominal.axis);
  fit.point_count = static_cast<int>(points_in_part_mm.size());
  const auto refuse = [&](const std::string& reason) {
    fit.reason = reason;
    return fit;
  };
  if (fit.point_count < limits.least_point_count)
    return refuse(ReasonText("%.0f points off the surface at the hole, want at least %.0f", fit.point_count,
                             limits.least_point_count));

  // Local frame: across the nominal axis, and along it.
  Eigen::Matrix3d local_from_part;
  local_from_part << fit.across.transpose(), nominal.axis.transpose();
  Points all;
  std::vector<double> heights;
  for (const Eigen::Vector3d& point : points_in_part_mm) {
    all.push_back(local_from_part * (point - nominal.start_mm));
    heights.push_back(all.back().z());
  }
  // The 98th percentile is the top or a little below it; a few stray points above do not move it.
  const double top = AtRank(heights.size() * 98 / 100, &heights) - kTopMargin_mm;
  Points local;
  std::vector<std::size_t> index;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].z() > top) continue;
    local.push_back(all[i]);
    index.push_back(i);
  }
  if (static_cast<int>(local.size()) < limits.least_point_count)
    return refuse(ReasonText("%.0f points on its side, want at least %.0f", static_cast<double>(local.size()),
                             limits.least_point_count));

  Parameters p = AlgebraicCircle(local);
  double sigma = 0;
  if (std::string why = Settle(local, limits.held_step_count, &p, &sigma); !why.empty()) return refuse(why);

  const double height_mm = Influence(local, p, sigma, local_from_part, &fit);
  const double arc = ArcOf(local, p, fit.used);
  for (std::size_t& i : fit.used) i = index[i];
  fit.offset_mm = p.head<2>();
  fit.slope = p.segment<2>(2);
  fit.radius_mm = p[4];
  fit.seen_radius_variance_mm2 = fit.noise_covariance(4, 4);

  const PinSight seen{sigma, static_cast<double>(fit.used.size()) / static_cast<double>(local.size()), height_mm, arc};
  if (std::string why = Unfit(seen, fit, nominal, limits); !why.empty()) return refuse(why);
  if (nominal.gauge) TakeDiameter(*nominal.gauge, limits, &fit);
  fit.measured = true;
  return fit;
}

}  // namespace

std::string ReasonText(const char* format, double found, double wanted) {
  char buffer[160];
  std::snprintf(buffer, sizeof buffer, format, found, wanted);
  return buffer;
}

PinFit FitPin(const NominalPin& nominal, const Points& points_in_part_mm, const PinLimits& limits) {
  PinFit all = FitAll(nominal, points_in_part_mm, limits);
  if (all.measured || !(limits.apart_mm > 0)) return all;
  const std::vector<std::size_t> largest = LargestCluster(points_in_part_mm, limits.apart_mm);
  Points together;
  for (const std::size_t i : largest) together.push_back(points_in_part_mm[i]);
  PinFit fit = FitAll(nominal, together, limits);
  if (!fit.measured) return all;
  for (std::size_t& i : fit.used) i = largest[i];
  return fit;
}

PinPlay PlayOf(const NominalPin& nominal, const PinFit& fit, const PinLimits& limits) {
  if (nominal.standing) return {0, nominal.hole_depth_mm, 0, *nominal.standing};
  const double seen_mm = 2 * fit.radius_mm, hole_mm = nominal.hole_diameter_mm;
  if (!nominal.gauge)
    return {std::max(0.0, hole_mm - seen_mm) / 2,
            nominal.hole_depth_mm,
            std::max(0.0, limits.greatest_diameter_ratio * hole_mm - seen_mm) / 2,
            {}};
  const GaugePin& gauge = *nominal.gauge;
  // The certificate may err, and of a pin that is seen thinner, beyond what both may err, the play is more by as much.
  const double pin_u_mm = 2 * gauge.diameter_standard_uncertainty_mm;
  const double err_mm = std::hypot(pin_u_mm, 4 * std::sqrt(fit.noise_covariance(4, 4)));
  const double thinner_mm = gauge.diameter_mm - seen_mm;
  return {(gauge.greatest_play_mm + std::max(pin_u_mm, thinner_mm > err_mm ? thinner_mm : 0)) / 2,
          gauge.least_depth_mm.value_or(nominal.hole_depth_mm),
          0,
          {}};
}

// At the surface the pin's axis lies at m from the hole's, at its foot at b, each half the play long where it touches, and each in a
// direction that nobody knows; the slope is (m - b) / depth.
Eigen::Matrix<double, 5, 5> PlayCovariance(const PinPlay& play) {
  Eigen::Matrix<double, 5, 5> covariance = Eigen::Matrix<double, 5, 5>::Zero();
  covariance.diagonal().head<2>().setConstant(std::pow(play.standing.clearance_standard_uncertainty_mm, 2));
  covariance.diagonal().segment<2>(2).setConstant(std::pow(play.standing.tilt_standard_uncertainty_rad, 2));
  if (!(play.half_mm > 0)) return covariance;
  const double variance = play.half_mm * play.half_mm / 2;
  for (int k = 0; k < 2; ++k) {
    covariance(k, k) += variance;
    covariance(k, 2 + k) = covariance(2 + k, k) = variance / play.depth_mm;
    covariance(2 + k, 2 + k) += 2 * variance / (play.depth_mm * play.depth_mm);
  }
  return covariance;
}

}  // namespace sixpoint::metrology
