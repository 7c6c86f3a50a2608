#include "metrology/inspection/plane_points.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "metrology/linear_algebra/symmetric.h"
#include "metrology/parallel/keep_going.h"
#include "metrology/parallel/loops.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kSampled = 2000;

struct Kept {
  std::uint32_t plane, point;
  Vector3d in_part_mm;
};

absl::Status TooMany(const char* what, std::int64_t count, std::int64_t most) {
  return absl::ResourceExhaustedError(std::string("scans: ") + std::to_string(count) + " points " + what +
                                      ", want at most " + std::to_string(most));
}

}  // namespace

PlanePoints::PlanePoints(PartMapping mapping, std::vector<Eigen::Isometry3d> part_from_section,
                         PlanePointsOptions options)
    : mapping_(std::move(mapping)),
      options_(std::move(options)),
      set_aside_(options_.set_aside),
      in_part_mm_(part_from_section.size()),
      in_sensor_mm_(part_from_section.size()) {
  for (const Eigen::Isometry3d& one : part_from_section) section_from_part_.push_back(one.inverse());
}

void PlanePoints::Begin(const LineScan& scan) {
  scans_.push_back(mapping_.PlaceOf(scan));
  first_of_scan_.emplace_back();
  for (const Points& points : in_part_mm_) first_of_scan_.back().push_back(points.size());
}

absl::Status PlanePoints::AddPoints(const Points& points_mm) {
  seen_count_ += static_cast<std::int64_t>(points_mm.size());
  if (seen_count_ > options_.greatest_point_count) return TooMany("in all", seen_count_, options_.greatest_point_count);
  const ScanPlace& place = scans_.back();
  KeepGoing keep_going(options_.keep_going);
  const auto pieces = OfEachChunk<std::vector<Kept>>(
      points_mm.size(), kMappedAtOnce, options_.threads, [&](std::size_t begin, std::size_t end) {
        std::vector<Kept> kept;
        if (!keep_going()) return kept;
        for (std::size_t i = begin; i < end; ++i) {
          const Vector3d in_part = mapping_.PartPoint(points_mm[i], place);
          for (std::size_t k = 0; k < section_from_part_.size(); ++k)
            if (std::abs((section_from_part_[k] * in_part).z()) <= options_.half_width_mm &&
                (set_aside_.size() == 0 || set_aside_.At(in_part) == set_aside_.size()))
              kept.push_back({static_cast<std::uint32_t>(k), static_cast<std::uint32_t>(i), in_part});
        }
        return kept;
      });
  if (keep_going.stopped()) return absl::CancelledError("sections: the caller is gone or its time is over");
  for (const std::vector<Kept>& piece : pieces)
    for (const Kept& one : piece) {
      in_part_mm_[one.plane].push_back(one.in_part_mm);
      in_sensor_mm_[one.plane].push_back(points_mm[one.point]);
      ++kept_count_;
    }
  if (kept_count_ > options_.greatest_kept_count)
    return TooMany("near the planes", kept_count_, options_.greatest_kept_count);
  return absl::OkStatus();
}

std::vector<PlanePoints::Sampled> PlanePoints::Sample() const {
  std::vector<Sampled> sampled;
  const std::size_t every = 1 + static_cast<std::size_t>(kept_count_) / kSampled;
  for (std::size_t k = 0; k < in_part_mm_.size(); ++k) {
    std::size_t scan = 0;
    for (std::size_t i = 0; i < in_part_mm_[k].size(); i += every) {
      while (scan + 1 < scans_.size() && i >= first_of_scan_[scan + 1][k]) ++scan;
      sampled.push_back({in_part_mm_[k][i], in_sensor_mm_[k][i], scan});
    }
  }
  return sampled;
}

PoseCovariance PlanePoints::Covariance() const {
  const std::vector<Sampled> sampled = Sample();
  Vector3d middle = Vector3d::Zero();
  for (const Sampled& one : sampled) middle += one.in_part_mm / static_cast<double>(sampled.size());
  PoseCovariance covariance(Matrix6d::Zero(), middle);
  if (sampled.size() < 3) return covariance;
  const RegisteredPose& pose = mapping_.pose();
  const auto angle_count = static_cast<Eigen::Index>(pose.angles.size());
  // Of a rigid motion, by least squares of the points' displacements.
  Matrix6d normal = Matrix6d::Zero();
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(6, kMappingInputs + angle_count);
  for (const Sampled& one : sampled) {
    const Eigen::Matrix<double, 3, 6> motion = PointJacobian(one.in_part_mm, middle);
    Eigen::MatrixXd moved(3, right.cols());
    moved << mapping_.Sensitivity(one.in_part_mm, one.in_sensor_mm, scans_[one.scan]),
        mapping_.AngleSensitivity(one.in_part_mm, scans_[one.scan]);
    normal += motion.transpose() * motion;
    right += motion.transpose() * moved;
  }
  const Eigen::MatrixXd motions = normal.completeOrthogonalDecomposition().solve(right);
  const auto add = [&covariance](const Eigen::MatrixXd& per_sigma) {
    covariance.values += per_sigma * per_sigma.transpose();
  };
  add(motions.leftCols<6>() * FactorOf(pose.noise.values));
  for (const ErrorSource& source : pose.sources)
    add(motions.leftCols<6>() * source.pose_per_sigma +
        motions.middleCols<kCalibrationParameterCount>(6) * source.parameters_per_sigma);
  if (angle_count > 0) add(motions.rightCols(angle_count) * FactorOf(ErrorCovariance(pose.angles)));
  return covariance;
}

}  // namespace sixpoint::metrology
