// What a blade's inspection finds of each hole: from its pin's points to the verdict.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

#include "metrology/inspection/blade_inspection.h"

namespace sixpoint::metrology {
namespace {

constexpr int kInputs = 6 + kCalibrationParameterCount;  // the pose, then what maps a point

std::string FartherThan(double reach_mm, double offset_mm) {
  char text[128];
  std::snprintf(text, sizeof text,
                "a pin stands %.3f mm from the hole's axis, want at most %.3f: another hole's, or none", offset_mm,
                reach_mm);
  return text;
}

}  // namespace

// An error lies within the difference, either way, as likely here as there: a standard uncertainty of difference / sqrt(3).
void BladeInspection::AddPositioning(const NominalPin& nominal, HoleFinding* finding) const {
  HoleError& error = finding->error;
  for (const Eigen::Isometry3d& other : options_.other_zero_from_part) {
    const Eigen::Isometry3d moved = other.inverse(Eigen::Isometry) * mapping_.pose().zero_from_part;
    const Eigen::Vector3d axis = moved.linear() * error.axis_in_part;
    Eigen::Vector3d start = moved * error.start_in_part_mm;
    start += nominal.normal.dot(nominal.start_mm - start) / nominal.normal.dot(axis) * axis;  // onto the surface again
    finding->positioning_difference_mm =
        std::max(finding->positioning_difference_mm, (start - error.start_in_part_mm).norm());
    finding->positioning_difference_rad =
        std::max(finding->positioning_difference_rad,
                 std::atan2(axis.cross(error.axis_in_part).norm(), axis.dot(error.axis_in_part)));
  }
  const auto add = [](double difference, double* standard_uncertainty, double* coverage_factor) {
    const double own = *standard_uncertainty, more = difference / std::sqrt(3.0);
    if (!(more > 0)) return;
    *standard_uncertainty = std::hypot(own, more);
    *coverage_factor = std::hypot(*coverage_factor * own, 2 * more) / *standard_uncertainty;
  };
  add(finding->positioning_difference_mm, &error.position_standard_uncertainty_mm, &error.position_coverage_factor);
  add(finding->positioning_difference_rad, &error.inclination_standard_uncertainty_rad,
      &error.inclination_coverage_factor);
}

HoleFinding BladeInspection::Judged(std::size_t hole, double clearance_mm) const {
  const InspectedHole& wanted = holes_[hole];
  std::vector<PinPoint> points;
  for (const PinPoint& point : pin_points_[hole])
    if (point.deviation_mm > clearance_mm) points.push_back(point);
  Points in_part;
  in_part.reserve(points.size());
  for (const PinPoint& point : points) in_part.push_back(point.in_part_mm);
  PinFit fit = FitPin(wanted.pin, in_part, options_.pin);
  if (fit.measured && !(fit.offset_mm.norm() <= reach_mm_[hole])) {
    fit.measured = false;
    fit.reason = FartherThan(reach_mm_[hole], fit.offset_mm.norm());
  }

  HoleFinding finding;
  finding.point_count = static_cast<int>(fit.used.size());
  finding.pin_residual_rms_um = fit.residual_rms_um;
  finding.pin_radius_mm = fit.radius_mm;
  finding.reason = fit.reason;
  if (!fit.measured) return finding;

  const PinPlay play = PlayOf(wanted.pin, fit, options_.pin);
  finding.pin_half_play_mm = play.half_mm;
  const std::vector<Part> parts = PartsOf(fit, points, play);
  Eigen::Matrix<double, 5, 5> covariance = Eigen::Matrix<double, 5, 5>::Zero();
  for (const Part& part : parts) covariance += part.covariance;
  finding.error = HoleErrorOf(wanted.pin, fit, covariance);
  AddPositioning(wanted.pin, &finding);
  Expand(parts, &finding);
  Judge(wanted, play, &finding);
  return finding;
}

std::vector<BladeInspection::Part> BladeInspection::PartsOf(const PinFit& fit, const std::vector<PinPoint>& points,
                                                            const PinPlay& play) const {
  const double known = std::numeric_limits<double>::infinity();
  const RegisteredPose& pose = mapping_.pose();
  Eigen::Matrix<double, 5, kInputs> sensitivity;
  sensitivity.setZero();
  for (std::size_t i = 0; i < fit.used.size(); ++i) {
    const PinPoint& point = points[fit.used[i]];
    sensitivity += fit.gain[i] * mapping_.Sensitivity(point.in_part_mm, point.in_sensor_mm, scans_[point.scan]);
  }
  const Eigen::Matrix<double, 5, 6> per_pose = sensitivity.leftCols<6>();
  std::vector<Part> parts = {{"points of the pin", known, fit.noise_covariance},
                             {"noise of the scans", known, per_pose * pose.noise.values * per_pose.transpose()},
                             {"how the pin stands", known, PlayCovariance(play)}};
  for (const ErrorSource& source : pose.sources) {
    const Eigen::Matrix<double, 5, Eigen::Dynamic> per_sigma =
        per_pose * source.pose_per_sigma +
        sensitivity.rightCols<kCalibrationParameterCount>() * source.parameters_per_sigma;
    parts.push_back({source.name, source.degrees_of_freedom, per_sigma * per_sigma.transpose()});
  }
  if (pose.angles.empty()) return parts;
  Eigen::Matrix<double, 5, Eigen::Dynamic> angles =
      Eigen::Matrix<double, 5, Eigen::Dynamic>::Zero(5, static_cast<Eigen::Index>(pose.angles.size()));
  for (std::size_t i = 0; i < fit.used.size(); ++i) {
    const PinPoint& point = points[fit.used[i]];
    angles += fit.gain[i] * mapping_.AngleSensitivity(point.in_part_mm, scans_[point.scan]);
  }
  parts.push_back({"angles of the scans", known, angles * ErrorCovariance(pose.angles) * angles.transpose()});
  return parts;
}

void BladeInspection::Expand(const std::vector<Part>& parts, HoleFinding* finding) {
  constexpr double kUm2 = 1e6, kProbability = 0.95;
  const Eigen::Matrix<double, 1, 5>& along = finding->error.position_per_parameter;
  const auto add = [&](const std::string& source, double variance_mm2, double degrees_of_freedom) {
    if (variance_mm2 > 0) finding->components.push_back({source, kUm2 * variance_mm2, degrees_of_freedom});
  };
  for (const Part& part : parts) add(part.source, along * part.covariance * along.transpose(), part.degrees_of_freedom);
  add("other positionings", std::pow(finding->positioning_difference_mm, 2) / 3,
      std::numeric_limits<double>::infinity());
  std::stable_sort(finding->components.begin(), finding->components.end(),
                   [](const auto& one, const auto& other) { return one.variance > other.variance; });
  finding->degrees_of_freedom = EffectiveDegreesOfFreedom(finding->components);
  const double widening = WideningOf(kProbability, finding->degrees_of_freedom);
  const HoleError& error = finding->error;
  finding->position_expanded_uncertainty_mm =
      widening * error.position_coverage_factor * error.position_standard_uncertainty_mm;
  finding->inclination_expanded_uncertainty_rad =
      widening * error.inclination_coverage_factor * error.inclination_standard_uncertainty_rad;
}

// How wide a hole was drilled is not on the drawing: where nobody says how loosely its pin stands, none is passed, and none failed
// that the widest hole would excuse.
void BladeInspection::Judge(const InspectedHole& hole, const PinPlay& play, HoleFinding* finding) const {
  const auto judged = [&](double value, double u, double unstated, double tolerance) {
    const Verdict verdict = metrology::Judge(value, u, tolerance);
    if (metrology::Judge(value, u + unstated, tolerance) == verdict) return verdict;
    finding->reason = "how loosely the pin stands is not stated (gauge_pin of the part's hole group)";
    return Verdict::kUndecidable;
  };
  const double unstated_mm = play.unstated_half_mm / std::abs(hole.pin.normal.dot(hole.pin.axis));
  finding->position_verdict = judged(finding->error.position_mm, finding->position_expanded_uncertainty_mm, unstated_mm,
                                     hole.position_tolerance_mm);
  finding->inclination_verdict = judged(finding->error.inclination_rad, finding->inclination_expanded_uncertainty_rad,
                                        2 * play.unstated_half_mm / play.depth_mm, hole.inclination_tolerance_rad);
  finding->verdict = Worst(finding->position_verdict, finding->inclination_verdict);
}

}  // namespace sixpoint::metrology
