#include "metrology/repair/section_deviation.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "metrology/linear_algebra/least_squares.h"
#include "metrology/repair/outline_sides.h"
#include "metrology/sections/profile.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector2d;

constexpr double kReach_mm = 3;
constexpr double kEndCosine = 0.5;  // 60 deg: an end's normals are no farther from its direction

Outline MovedBy(const Eigen::Isometry2d& motion, const Outline& outline) {
  std::vector<OutlineNode> nodes = outline.nodes();
  for (OutlineNode& node : nodes) {
    node.point_mm = motion * node.point_mm;
    node.normal = motion.linear() * node.normal;
  }
  return Outline(std::move(nodes));
}

// From tip to tip.
std::vector<Vector2d> WholeLine(const CamberProfile& profile, const Eigen::Isometry2d& motion) {
  std::vector<Vector2d> line(profile.leading.points_mm.rbegin(), profile.leading.points_mm.rend());
  for (const CamberStation& station : profile.stations) line.push_back(station.centre_mm);
  line.insert(line.end(), profile.trailing.points_mm.begin(), profile.trailing.points_mm.end());
  for (Vector2d& point_mm : line) point_mm = motion * point_mm;
  return line;
}

// How far along `across` the line passes; of several places the nearest. Beyond its ends it goes straight on.
std::optional<double> PassesAt(const std::vector<Vector2d>& line, const Vector2d& from_mm, const Vector2d& across) {
  const Vector2d along(across.y(), -across.x());
  std::optional<double> nearest;
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    const double one = along.dot(line[i] - from_mm), other = along.dot(line[i + 1] - from_mm);
    const bool first = i == 0 && one > 0 && other > one, last = i + 2 == line.size() && other < 0 && one < other;
    if (!first && !last && (one > 0) == (other > 0)) continue;
    const double off = across.dot(line[i] + one / (one - other) * (line[i + 1] - line[i]) - from_mm);
    if (std::abs(off) <= kReach_mm && (!nearest || std::abs(off) < std::abs(*nearest))) nearest = off;
  }
  return nearest;
}

// How far an end reaches beyond the nominal one, along its direction: of the nominal end moved by a vector and grown along its normals, so that it
// fits the outline best. One place at the tip would be as uncertain as the outline is there.
double EndOutward(const Outline& outline, const BladeSection& nominal, const CamberExtension& tip) {
  const auto& nodes = nominal.outline.nodes();
  std::vector<Eigen::Vector4d> rows;  // the last: how far out, each weighted by the length that it stands for
  const double near_mm = 3 * (tip.points_mm.front() - tip.tip_mm).norm();
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if ((nodes[i].point_mm - tip.tip_mm).norm() > near_mm || nodes[i].normal.dot(tip.outward) < kEndCosine) continue;
    const double length_mm =
        (nodes[nominal.outline.Next(i)].point_mm - nodes[nominal.outline.Previous(i)].point_mm).norm();
    const double outward_mm = -SignedDistance(outline, nodes[i].point_mm, nullptr);
    rows.push_back(std::sqrt(length_mm) * Eigen::Vector4d(nodes[i].normal.x(), nodes[i].normal.y(), 1, outward_mm));
  }
  if (rows.size() < 6) return -SignedDistance(outline, tip.tip_mm, nullptr);
  Eigen::MatrixXd matrix(static_cast<Eigen::Index>(rows.size()), 3);
  Eigen::VectorXd right(matrix.rows());
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    matrix.row(i) = rows[static_cast<std::size_t>(i)].head<3>();
    right[i] = rows[static_cast<std::size_t>(i)][3];
  }
  return LeastSquares(matrix, right).dot(Eigen::Vector3d(tip.outward.x(), tip.outward.y(), 1));
}

}  // namespace

Eigen::Isometry2d PlaneMotion::About(const Vector2d& pivot_mm) const {
  Eigen::Isometry2d motion = Eigen::Isometry2d::Identity();
  motion.linear() = Eigen::Rotation2Dd(turn_rad).toRotationMatrix();
  motion.translation() = pivot_mm + shift_mm - motion.linear() * pivot_mm;
  return motion;
}

absl::StatusOr<SectionDeviation> DeviationOf(const BladeSection& nominal, const BladeSection& measured,
                                             const Vector2d& pivot_mm) {
  const Eigen::Isometry2d nominal_from_measured =
      DeviationFrom(nominal.outline, measured.outline).nominal_from_measured;
  const Eigen::Isometry2d measured_from_nominal = nominal_from_measured.inverse();
  SectionDeviation deviation;
  deviation.moved.turn_rad = Eigen::Rotation2Dd(measured_from_nominal.linear()).smallestAngle();
  deviation.moved.shift_mm = measured_from_nominal * pivot_mm - pivot_mm;
  const Outline outline = MovedBy(nominal_from_measured, measured.outline);
  const std::vector<Vector2d> line = WholeLine(measured.profile, nominal_from_measured);
  const auto& stations = nominal.profile.stations;
  const OutlineSides sides(outline, outline.At(outline.Nearest(line.front())),
                           outline.At(outline.Nearest(line.back())));
  deviation.camber_mm.resize(static_cast<Eigen::Index>(stations.size()));
  deviation.radius_mm.resize(static_cast<Eigen::Index>(stations.size()));
  for (std::size_t j = 0; j < stations.size(); ++j) {
    const Vector2d across = LeftOf(stations[j].along);
    const auto off = PassesAt(line, stations[j].centre_mm, across);
    if (!off)
      return Refuse("outline", "no camber line beside nominal station " + std::to_string(j),
                    "an airfoil within " + NumberText(kReach_mm) + " mm of the nominal one");
    const Vector2d near_mm = stations[j].centre_mm + *off * across;
    const auto middle = sides.MiddleNear(near_mm, across, stations[j].radius_mm / 2);
    const Vector2d centre_mm = middle ? middle->centre_mm : near_mm;
    const double radius_mm = middle ? middle->radius_mm : sides.FromFirst(near_mm).distance_mm;
    deviation.camber_mm[static_cast<Eigen::Index>(j)] = across.dot(centre_mm - stations[j].centre_mm);
    deviation.radius_mm[static_cast<Eigen::Index>(j)] = radius_mm - stations[j].radius_mm;
  }
  deviation.leading_mm = EndOutward(outline, nominal, nominal.profile.leading);
  deviation.trailing_mm = EndOutward(outline, nominal, nominal.profile.trailing);
  deviation.in_place = outline;
  return deviation;
}

}  // namespace sixpoint::metrology
