#include "metrology/studies/sphere_check.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "metrology/linear_algebra/least_squares.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

constexpr int kMostSphereIterations = 50;
constexpr double kOtherUnit = 0.1;
constexpr std::size_t kFewestOptical = 1000, kFewestOfPlane = 100;

absl::Status CheckNotBelowZero(const std::string& field, double value) {
  if (std::isfinite(value) && value >= 0) return absl::OkStatus();
  return Refuse(field, Rounded(value), "a finite number, at least 0");
}

absl::Status Check(const Points& points_mm, const std::vector<MeasuredLength>& lengths,
                   const SphereCheckOptions& options) {
  if (options.least_points < 5) return Refuse("least_points", std::to_string(options.least_points), "at least 5");
  if (static_cast<int>(points_mm.size()) < options.least_points)
    return Refuse("points_mm", std::to_string(points_mm.size()) + " of them",
                  "at least " + std::to_string(options.least_points));
  for (std::size_t i = 0; i < points_mm.size(); ++i)
    if (!points_mm[i].allFinite()) return Refuse("points_mm[" + std::to_string(i) + "]", "not finite", "a point");
  if (!options.plane_points_mm.empty() && options.plane_points_mm.size() < kFewestOfPlane)
    return Refuse("plane_points_mm", std::to_string(options.plane_points_mm.size()) + " of them",
                  "at least " + std::to_string(kFewestOfPlane));
  for (std::size_t i = 0; i < options.plane_points_mm.size(); ++i)
    if (!options.plane_points_mm[i].allFinite())
      return Refuse("plane_points_mm[" + std::to_string(i) + "]", "not finite", "a point");
  if (options.optical && points_mm.size() < kFewestOptical)
    return Refuse("points_mm", std::to_string(points_mm.size()) + " of them",
                  "at least " + std::to_string(kFewestOptical) + ", as optical says that a scanner saw the sphere");
  if (!std::isfinite(options.diameter_mm) || options.diameter_mm <= 0)
    return Refuse("diameter_mm", Rounded(options.diameter_mm), "> 0");
  for (const auto& [field, value] :
       {std::pair{"diameter_standard_uncertainty_um", options.diameter_standard_uncertainty_mm},
        {"sphere_form_um", options.sphere_form_mm},
        {"form_mpe_um", options.form_mpe_mm},
        {"size_mpe_um", options.size_mpe_mm},
        {"length_mpe_um", options.length_mpe_mm},
        {"dispersion_mpe_um", options.dispersion_mpe_mm},
        {"plane_form_um", options.plane_form_mm},
        {"flat_form_mpe_um", options.flat_form_mpe_mm},
        {"length_mpe_divisor", options.length_mpe_divisor}})
    if (absl::Status s = CheckNotBelowZero(field, value); !s.ok()) return s;
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    const std::string field = "lengths[" + std::to_string(i) + "]";
    const MeasuredLength& l = lengths[i];
    if (!std::isfinite(l.calibrated_mm) || l.calibrated_mm <= 0)
      return Refuse(field + ".calibrated_mm", Rounded(l.calibrated_mm), "> 0");
    if (absl::Status s =
            CheckNotBelowZero(field + ".calibrated_standard_uncertainty_um", l.calibrated_standard_uncertainty_mm);
        !s.ok())
      return s;
    if (!std::isfinite(l.measured_mm) || std::abs(l.measured_mm / l.calibrated_mm - 1) > kOtherUnit)
      return Refuse(field + ".measured_mm", Rounded(l.measured_mm),
                    "about " + Rounded(l.calibrated_mm) + " (both in millimetres)");
  }
  return absl::OkStatus();
}

CheckedError Judge(const std::string& quantity, double error_mm, double standard_uncertainty_mm, double mpe_mm) {
  return {quantity, error_mm, standard_uncertainty_mm, mpe_mm, JudgeAgainst(mpe_mm, error_mm, standard_uncertainty_mm)};
}

StudyVerdict WorstOf(const std::vector<CheckedError>& errors) {
  StudyVerdict worst = StudyVerdict::kReported;
  for (const CheckedError& e : errors) {
    if (e.verdict == StudyVerdict::kRejected) return e.verdict;
    if (e.verdict == StudyVerdict::kUndecidable || worst == StudyVerdict::kReported) worst = e.verdict;
  }
  return worst;
}

struct FittedSphere {
  Eigen::Vector3d centre_mm;
  double radius_mm = 0;
  Eigen::VectorXd off_mm;  // of each point, outwards
  Eigen::Matrix4d normal;  // of centre and radius
};

// About the points' middle: |p|^2 = 2 c . p + (r^2 - |c|^2) starts the geometric fit.
absl::StatusOr<FittedSphere> Fit(const Points& points_mm) {
  const auto n = static_cast<Eigen::Index>(points_mm.size());
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points_mm) middle += p / static_cast<double>(n);
  Eigen::MatrixX4d rows(n, 4);
  Eigen::VectorXd right(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Vector3d p = points_mm[i] - middle;
    rows.row(i) << 2 * p.transpose(), 1;
    right(i) = p.squaredNorm();
  }
  const Eigen::Vector4d start = LeastSquares(rows, right);
  Eigen::Vector3d centre = start.head<3>();
  double radius = std::sqrt(std::max(0.0, start(3) + centre.squaredNorm()));
  Eigen::VectorXd residual(n);
  Eigen::MatrixX4d jacobian(n, 4);
  bool settled = false;
  for (int iteration = 0; iteration < kMostSphereIterations && !settled; ++iteration) {
    for (Eigen::Index i = 0; i < n; ++i) {
      const Eigen::Vector3d d = points_mm[i] - middle - centre;
      residual(i) = d.norm() - radius;
      jacobian.row(i) << -d.normalized().transpose(), -1;
    }
    const Eigen::Vector4d step = LeastSquares(jacobian, -residual);
    centre += step.head<3>();
    radius += step(3);
    settled = step.norm() < 1e-12 * std::max(1.0, radius);
  }
  const Eigen::Matrix4d normal = jacobian.transpose() * jacobian;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> eigen(normal);
  if (!settled || !(eigen.eigenvalues()(0) > 1e-6 * eigen.eigenvalues()(3)))
    return absl::FailedPreconditionError(
        "points_mm: they do not determine a sphere, want points spread over half of it");
  return FittedSphere{middle + centre, radius, residual, normal};
}

double RangeOf(const Eigen::VectorXd& off_mm) { return off_mm.maxCoeff() - off_mm.minCoeff(); }

// Of the values, in the narrowest band.
double WidthOf95Percent(std::vector<double> off_mm) {
  std::sort(off_mm.begin(), off_mm.end());
  const auto inside = static_cast<std::size_t>(std::ceil(0.95 * static_cast<double>(off_mm.size())));
  double width = off_mm.back() - off_mm.front();
  for (std::size_t i = 0; i + inside <= off_mm.size(); ++i) width = std::min(width, off_mm[i + inside - 1] - off_mm[i]);
  return width;
}

// The pole of what is seen and rings of 4, 8 and 12 about it, out to where nine tenths of the points lie; each in its direction, as far out as
// the points about it are on the mean.
absl::StatusOr<Points> Representatives(const Points& points_mm, const FittedSphere& all) {
  constexpr std::array<int, 4> kRing = {1, 4, 8, 12};
  constexpr double kWithin = 0.9;
  constexpr std::size_t kFewest = 5;
  Points directions;
  Eigen::Vector3d pole = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points_mm) pole += directions.emplace_back((p - all.centre_mm).normalized());
  pole.normalize();
  std::vector<double> from_pole;
  for (const Eigen::Vector3d& d : directions) from_pole.push_back(std::acos(std::clamp(d.dot(pole), -1.0, 1.0)));
  const auto ninth = from_pole.begin() + static_cast<std::ptrdiff_t>(kWithin * static_cast<double>(from_pole.size()));
  std::nth_element(from_pole.begin(), ninth, from_pole.end());
  const double reach = *ninth, least_cosine = std::cos(reach / 8);
  const Eigen::Vector3d x = pole.unitOrthogonal(), y = pole.cross(x);
  Points representatives;
  for (std::size_t ring = 0; ring < kRing.size(); ++ring)
    for (int k = 0; k < kRing[ring]; ++k) {
      const double tilt = reach * static_cast<double>(ring) / 3, turn = 2 * M_PI * (k + 0.5 * (ring % 2)) / kRing[ring];
      const Eigen::Vector3d direction =
          std::cos(tilt) * pole + std::sin(tilt) * (std::cos(turn) * x + std::sin(turn) * y);
      double out_mm = 0;
      std::size_t count = 0;
      for (std::size_t i = 0; i < directions.size(); ++i) {
        if (directions[i].dot(direction) < least_cosine) continue;
        out_mm += (points_mm[i] - all.centre_mm).norm();
        ++count;
      }
      if (count < kFewest)
        return absl::FailedPreconditionError("points_mm: of 25 places spread over what is seen of the sphere one has " +
                                             std::to_string(count) + " points, want at least " +
                                             std::to_string(kFewest) + " at each: scan it evenly");
      representatives.push_back(all.centre_mm + out_mm / static_cast<double>(count) * direction);
    }
  return representatives;
}

// ISO 10360-8: of a plane's points.
absl::StatusOr<double> FlatForm(const Points& points_mm) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points_mm) middle += p / static_cast<double>(points_mm.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& p : points_mm) spread += (p - middle) * (p - middle).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(spread);
  if (!(eigen.eigenvalues()[1] > 1e-6 * eigen.eigenvalues()[2]))
    return absl::FailedPreconditionError("plane_points_mm: they do not determine a plane, want points spread over it");
  std::vector<double> off_mm;
  for (const Eigen::Vector3d& p : points_mm) off_mm.push_back(eigen.eigenvectors().col(0).dot(p - middle));
  return WidthOf95Percent(std::move(off_mm));
}

// Form and size of 25 places, dispersion and size of all.
absl::Status JudgeOptical(const Points& points_mm, const FittedSphere& all, const SphereCheckOptions& options,
                          std::vector<CheckedError>* errors) {
  const absl::StatusOr<Points> representatives = Representatives(points_mm, all);
  if (!representatives.ok()) return representatives.status();
  const absl::StatusOr<FittedSphere> of_25 = Fit(*representatives);
  if (!of_25.ok()) return of_25.status();
  const double of_size_mm = options.diameter_standard_uncertainty_mm, of_form_mm = options.sphere_form_mm / 2;
  errors->push_back(Judge("form", RangeOf(of_25->off_mm), of_form_mm, options.form_mpe_mm));
  errors->push_back(Judge("size", 2 * of_25->radius_mm - options.diameter_mm, of_size_mm, options.size_mpe_mm));
  const std::vector<double> off_mm(all.off_mm.begin(), all.off_mm.end());
  errors->push_back(Judge("dispersion", WidthOf95Percent(off_mm), of_form_mm, options.dispersion_mpe_mm));
  errors->push_back(
      Judge("size of all points", 2 * all.radius_mm - options.diameter_mm, of_size_mm, options.size_mpe_mm));
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<SphereCheck> CheckSphere(const Points& points_mm, const std::vector<MeasuredLength>& lengths,
                                        const SphereCheckOptions& options) {
  if (absl::Status s = Check(points_mm, lengths, options); !s.ok()) return s;
  const absl::StatusOr<FittedSphere> all = Fit(points_mm);
  if (!all.ok()) return all.status();
  if (std::abs(2 * all->radius_mm / options.diameter_mm - 1) > kOtherUnit)
    return Refuse("diameter_mm",
                  Rounded(options.diameter_mm) + " with points on a sphere of " + Rounded(2 * all->radius_mm),
                  "both in millimetres, of the same sphere");

  SphereCheck check;
  check.centre_mm = all->centre_mm;
  check.diameter_mm = 2 * all->radius_mm;
  const double variance = all->off_mm.squaredNorm() / static_cast<double>(points_mm.size() - 4);
  const Eigen::Matrix4d covariance = variance * all->normal.inverse();
  check.centre_covariance_mm2 = covariance.topLeftCorner<3, 3>();
  check.diameter_standard_uncertainty_mm = 2 * std::sqrt(covariance(3, 3));
  check.standard_deviation_mm = std::sqrt(variance);
  if (options.optical) {
    if (absl::Status s = JudgeOptical(points_mm, *all, options, &check.errors); !s.ok()) return s;
  } else {
    // ISO/TS 23165: the sphere's own form is part of the range that was probed, at most half of it on each side.
    check.errors.push_back(Judge("form", RangeOf(all->off_mm), options.sphere_form_mm / 2, options.form_mpe_mm));
    check.errors.push_back(Judge("size", check.diameter_mm - options.diameter_mm,
                                 options.diameter_standard_uncertainty_mm, options.size_mpe_mm));
  }
  if (!options.plane_points_mm.empty()) {
    const absl::StatusOr<double> flat_mm = FlatForm(options.plane_points_mm);
    if (!flat_mm.ok()) return flat_mm.status();
    check.errors.push_back(Judge("flat form", *flat_mm, options.plane_form_mm / 2, options.flat_form_mpe_mm));
  }
  for (const MeasuredLength& l : lengths) {
    const bool stated = options.length_mpe_mm > 0 || options.length_mpe_divisor > 0;
    const double growing = options.length_mpe_divisor > 0 ? l.calibrated_mm / options.length_mpe_divisor * 1e-3 : 0;
    check.errors.push_back(Judge(l.standard, l.measured_mm - l.calibrated_mm, l.calibrated_standard_uncertainty_mm,
                                 stated ? options.length_mpe_mm + growing : 0));
  }
  check.verdict = WorstOf(check.errors);
  return check;
}

}  // namespace sixpoint::metrology
