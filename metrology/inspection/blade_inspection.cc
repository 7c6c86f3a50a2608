#include "metrology/inspection/blade_inspection.h"

#include <absl/status/status.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>
#include <utility>

#include "metrology/parallel/keep_going.h"
#include "metrology/parallel/loops.h"
#include "metrology/statistics/ranks.h"

namespace sixpoint::metrology {
namespace {

constexpr std::size_t kChunk = 8192;  // fixed: sums do not depend on the number of threads
constexpr double kBelow_mm = 1;       // the pin region reaches this far under the start, along the axis
constexpr double kTo_um = 1e3;
constexpr int kInputs = 6 + kCalibrationParameterCount;  // the pose, then what maps a point

// A hole's region: a cylinder about the nominal axis in which its pin must stand. The square of the distance from that axis; none
// outside.
std::optional<double> InRegion(const InspectedHole& hole, const InspectionOptions& options,
                               const Eigen::Vector3d& point) {
  const Eigen::Vector3d from = point - hole.pin.start_mm;
  const double height = from.dot(hole.pin.axis);
  if (height < -kBelow_mm || height > options.longest_pin_mm) return std::nullopt;
  const double widest_mm =
      hole.pin.gauge ? hole.pin.gauge->diameter_mm : options.pin.greatest_diameter_ratio * hole.pin.hole_diameter_mm;
  const double radius = widest_mm / 2 + options.search_mm;
  const double square = (from - height * hole.pin.axis).squaredNorm();
  if (square >= radius * radius) return std::nullopt;
  return square;
}

std::string FartherThan(double reach_mm, double offset_mm) {
  char text[128];
  std::snprintf(text, sizeof text,
                "a pin stands %.3f mm from the hole's axis, want at most %.3f: another hole's, or none", offset_mm,
                reach_mm);
  return text;
}

// Half of the way to the nearest hole, across this one's axis, or as far as is searched.
double ReachOf(const std::vector<InspectedHole>& holes, std::size_t index, const InspectionOptions& options) {
  double reach = options.search_mm;
  const NominalPin& pin = holes[index].pin;
  for (std::size_t other = 0; other < holes.size(); ++other) {
    const Eigen::Vector3d from = holes[other].pin.start_mm - pin.start_mm;
    // One through the other wall has no pin here.
    const bool beside =
        std::abs(from.dot(pin.axis)) < options.longest_pin_mm && holes[other].pin.axis.dot(pin.axis) > 0.5;
    if (other == index || !beside) continue;
    reach = std::min(reach, (from - from.dot(pin.axis) * pin.axis).norm() / 2);
  }
  return reach;
}

}  // namespace

struct BladeInspection::Chunk {
  std::vector<float> deviations_mm;
  double square_sum_mm2 = 0;
  std::int64_t excluded_count = 0;
  std::vector<std::pair<std::uint32_t, PinPoint>> pin_points;  // hole, point
};

struct BladeInspection::Compared {
  Points in_part_mm;
  std::vector<double> deviations_mm;  // NaN where the surface is not within farthest_mm
};

BladeInspection::BladeInspection(std::shared_ptr<const Surface> surface, std::vector<InspectedHole> holes,
                                 RegisteredPose pose, SensorPose sensor, RotaryAxes axes, InspectionOptions options)
    : surface_(std::move(surface)),
      holes_(std::move(holes)),
      pose_(std::move(pose)),
      sensor_(std::move(sensor)),
      axes_(axes),
      options_(std::move(options)),
      pin_points_(holes_.size()) {
  for (std::size_t hole = 0; hole < holes_.size(); ++hole) reach_mm_.push_back(ReachOf(holes_, hole, options_));
}

std::size_t BladeInspection::HoleAt(const Eigen::Vector3d& in_part_mm) const {
  std::size_t nearest = holes_.size();
  double least = 0;
  for (std::size_t hole = 0; hole < holes_.size(); ++hole) {
    const std::optional<double> square = InRegion(holes_[hole], options_, in_part_mm);
    if (!square || (nearest < holes_.size() && *square >= least)) continue;
    nearest = hole;
    least = *square;
  }
  return nearest;
}

void BladeInspection::Sort(const Points& points_mm, std::size_t begin, std::size_t end, const Compared& compared,
                           Chunk* chunk) const {
  chunk->deviations_mm.reserve(end - begin);
  const auto scan_index = static_cast<std::uint32_t>(scans_.size() - 1);
  for (std::size_t i = begin; i < end; ++i) {
    const Eigen::Vector3d& in_part = compared.in_part_mm[i];
    const double deviation = compared.deviations_mm[i];
    const std::size_t hole = HoleAt(in_part);
    const bool in_region = hole < holes_.size();
    if (in_region) {
      // Beyond farthest_mm there is no distance; outside and far, since the region stands on the surface.
      const double off_mm = std::isfinite(deviation) ? deviation : std::numeric_limits<double>::infinity();
      const bool above = (in_part - holes_[hole].pin.start_mm).dot(holes_[hole].pin.axis) > 0;
      if (off_mm > options_.pin_clearances_mm.front() && above)
        chunk->pin_points.emplace_back(static_cast<std::uint32_t>(hole),
                                       PinPoint{in_part, points_mm[i], scan_index, static_cast<float>(off_mm)});
    }
    if (in_region || !std::isfinite(deviation)) {
      ++chunk->excluded_count;
      continue;
    }
    chunk->deviations_mm.push_back(static_cast<float>(deviation));
    chunk->square_sum_mm2 += deviation * deviation;
  }
}

absl::Status BladeInspection::Add(const LineScan& scan) {
  Begin(scan);
  return AddPoints(scan.points_mm);
}

void BladeInspection::Begin(const LineScan& scan) {
  ScanPlace& place = scans_.emplace_back();
  place.v0_mm = scan.v0_mm;
  place.a_rad = pose_.positioning.a.Reached(scan.a_rad);
  place.b_rad = pose_.positioning.b.Reached(scan.b_rad);
  place.commanded_a_rad = scan.a_rad;
  place.commanded_b_rad = scan.b_rad;
  place.part_from_machine = pose_.zero_from_part.inverse(Eigen::Isometry) * axes_.Growth(1 / scan.stretch) *
                            axes_.MachineFromZero(place.a_rad, place.b_rad).inverse(Eigen::Isometry);
}

BladeInspection::Compared BladeInspection::Compare(const Points& points_mm, KeepGoing* keep_going) const {
  const ScanPlace& place = scans_.back();
  Compared compared;
  compared.in_part_mm.resize(points_mm.size());
  ForEachChunk(points_mm.size(), kChunk, options_.threads, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      compared.in_part_mm[i] =
          place.part_from_machine * sensor_.MachineFromSensor(sensor_.WithoutField(points_mm[i]), place.v0_mm);
  });
  if (!(*keep_going)()) return compared;
  surface_->SignedDistances(compared.in_part_mm, options_.farthest_mm, options_.threads, &compared.deviations_mm);
  return compared;
}

absl::Status BladeInspection::AddPoints(const Points& points_mm) {
  seen_count_ += static_cast<std::int64_t>(points_mm.size());
  if (seen_count_ > options_.greatest_point_count) {
    return absl::ResourceExhaustedError("scans: " + std::to_string(seen_count_) + " points, want at most " +
                                        std::to_string(options_.greatest_point_count));
  }
  std::vector<Chunk> chunks(ChunkCount(points_mm.size(), kChunk));
  KeepGoing keep_going(options_.keep_going);
  const Compared compared = Compare(points_mm, &keep_going);
  ForEachChunk(points_mm.size(), kChunk, options_.threads, [&](std::size_t k, std::size_t begin, std::size_t end) {
    if (keep_going()) Sort(points_mm, begin, end, compared, &chunks[k]);
  });
  if (keep_going.stopped()) return absl::CancelledError("inspection stopped: the caller is gone or its time is over");
  for (const Chunk& chunk : chunks) {
    deviations_mm_.insert(deviations_mm_.end(), chunk.deviations_mm.begin(), chunk.deviations_mm.end());
    square_sum_mm2_ += chunk.square_sum_mm2;
    excluded_count_ += chunk.excluded_count;
    for (const auto& [hole, point] : chunk.pin_points) pin_points_[hole].push_back(point);
  }
  return absl::OkStatus();
}

Eigen::Matrix<double, 3, kInputs> BladeInspection::Sensitivity(const PinPoint& point) const {
  const ScanPlace& scan = scans_[point.scan];
  const Eigen::Matrix3d part_from_zero = pose_.zero_from_part.linear().transpose();
  const Eigen::Vector3d in_zero = pose_.zero_from_part * point.in_part_mm;
  // How the pose moves the point's place in the part, and how its place at `zero` follows what maps it: only their difference shows.
  Eigen::Matrix<double, 3, kInputs> sensitivity;
  sensitivity << -PointJacobian(in_zero, pose_.noise.reference_mm),
      ZeroPointSensitivity(point.in_sensor_mm, in_zero, scan.a_rad, scan.b_rad, sensor_, axes_);
  return part_from_zero * sensitivity;
}

Eigen::Matrix3Xd BladeInspection::AngleSensitivity(const PinPoint& point) const {
  const ScanPlace& scan = scans_[point.scan];
  const Eigen::Vector3d in_zero = pose_.zero_from_part * point.in_part_mm;
  const auto turned = ZeroPointAngleSensitivity(in_zero, scan.a_rad, scan.b_rad, axes_);
  Eigen::Matrix3Xd sensitivity(3, static_cast<Eigen::Index>(pose_.angles.size()));
  for (std::size_t k = 0; k < pose_.angles.size(); ++k) {
    const AngleInfluence& angle = pose_.angles[k];
    const bool on_a = angle.axis == AngleInfluence::Axis::kA;
    Eigen::Vector3d moved = -PointJacobian(in_zero, pose_.noise.reference_mm) * angle.pose_per_rad;
    const double command_rad = on_a ? scan.commanded_a_rad : scan.commanded_b_rad;
    if (std::abs(angle.commanded_rad - command_rad) < kSameCommandRad) moved += turned.col(on_a ? 0 : 1);
    sensitivity.col(static_cast<Eigen::Index>(k)) = moved;
  }
  return pose_.zero_from_part.linear().transpose() * sensitivity;
}

// An error lies within the difference, either way, as likely here as there: a standard uncertainty of difference / sqrt(3).
void BladeInspection::AddPositioning(const NominalPin& nominal, HoleFinding* finding) const {
  HoleError& error = finding->error;
  for (const Eigen::Isometry3d& other : options_.other_zero_from_part) {
    const Eigen::Isometry3d moved = other.inverse(Eigen::Isometry) * pose_.zero_from_part;
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
  Eigen::Matrix<double, 5, kInputs> sensitivity;
  sensitivity.setZero();
  for (std::size_t i = 0; i < fit.used.size(); ++i) sensitivity += fit.gain[i] * Sensitivity(points[fit.used[i]]);
  const Eigen::Matrix<double, 5, 6> per_pose = sensitivity.leftCols<6>();
  std::vector<Part> parts = {{"points of the pin", known, fit.noise_covariance},
                             {"noise of the scans", known, per_pose * pose_.noise.values * per_pose.transpose()},
                             {"how the pin stands", known, PlayCovariance(play)}};
  for (const ErrorSource& source : pose_.sources) {
    const Eigen::Matrix<double, 5, Eigen::Dynamic> per_sigma =
        per_pose * source.pose_per_sigma +
        sensitivity.rightCols<kCalibrationParameterCount>() * source.parameters_per_sigma;
    parts.push_back({source.name, source.degrees_of_freedom, per_sigma * per_sigma.transpose()});
  }
  if (pose_.angles.empty()) return parts;
  Eigen::Matrix<double, 5, Eigen::Dynamic> angles =
      Eigen::Matrix<double, 5, Eigen::Dynamic>::Zero(5, static_cast<Eigen::Index>(pose_.angles.size()));
  for (std::size_t i = 0; i < fit.used.size(); ++i) angles += fit.gain[i] * AngleSensitivity(points[fit.used[i]]);
  parts.push_back({"angles of the scans", known, angles * ErrorCovariance(pose_.angles) * angles.transpose()});
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

DeviationSummary BladeInspection::Summary() const {
  DeviationSummary summary;
  summary.point_count = static_cast<std::int64_t>(deviations_mm_.size());
  summary.excluded_count = excluded_count_;
  std::vector<float> sorted = deviations_mm_;
  const auto [low, high] = std::minmax_element(sorted.begin(), sorted.end());
  summary.minimum_um = kTo_um * *low;
  summary.maximum_um = kTo_um * *high;
  summary.rms_um = kTo_um * std::sqrt(square_sum_mm2_ / static_cast<double>(sorted.size()));
  const auto percentile = [&](double share) {
    return kTo_um * AtRank(static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1)), &sorted);
  };
  summary.p05_um = percentile(0.05);
  summary.p50_um = percentile(0.50);
  summary.p95_um = percentile(0.95);
  return summary;
}

absl::StatusOr<BladeFindings> BladeInspection::Finish() {
  if (deviations_mm_.empty())
    return absl::FailedPreconditionError("scans: no point within " + std::to_string(options_.farthest_mm) +
                                         " mm of the CAD, want scans of this blade");
  BladeFindings findings;
  findings.holes.resize(holes_.size());
  ForEach(holes_.size(), options_.threads, [&](std::size_t i) {
    for (const double clearance_mm : options_.pin_clearances_mm) {
      HoleFinding finding = Judged(i, clearance_mm);
      const bool first = clearance_mm == options_.pin_clearances_mm.front();
      const bool measured = finding.verdict != Verdict::kNotMeasured;
      // Why not is said of all its points.
      if (first || measured) findings.holes[i] = std::move(finding);
      if (measured) break;
    }
  });
  findings.verdict = holes_.empty() ? Verdict::kNotMeasured : Verdict::kConform;
  for (const HoleFinding& hole : findings.holes) findings.verdict = Worst(findings.verdict, hole.verdict);
  findings.deviation = Summary();
  return findings;
}

}  // namespace sixpoint::metrology
