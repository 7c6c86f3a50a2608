#include "metrology/measuring_plan/portion.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

// Of a ball about Point C, in which the part and its neighbours stay however they are turned: the first axis goes through C, the second one passes
// it.
double TurningRadius_mm(const PlanScene& scene) {
  const Vector3d centre_mm = scene.axes.PointC();
  const Vector3d from_b_mm = centre_mm - scene.axes.b.point_mm;
  const double apart_mm = scene.axes.b.direction.cross(from_b_mm).norm();
  std::vector<Eigen::Isometry3d> poses = {scene.zero_from_part};
  for (const Eigen::Isometry3d& neighbour_from_part : scene.neighbour_from_part)
    poses.push_back(scene.zero_from_part * neighbour_from_part.inverse(Eigen::Isometry));
  double radius_mm = 0;
  for (const TriangleCorners& corners : scene.surface.mesh().triangles)
    for (const std::uint32_t v : corners)
      for (const Eigen::Isometry3d& pose : poses)
        radius_mm = std::max(radius_mm, (pose * scene.surface.mesh().vertices_mm[v] - centre_mm).squaredNorm());
  return std::sqrt(radius_mm) + 2 * apart_mm;
}

// Of the body below the sensor frame's origin along machine Z; above it: negative.
double Below_mm(const SensorBody& body, const Eigen::Matrix3d& machine_from_sensor) {
  double low_mm = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 8; ++i) {
    const Vector3d corner_mm((i & 1) != 0 ? body.high_mm.x() : body.low_mm.x(),
                             (i & 2) != 0 ? body.high_mm.y() : body.low_mm.y(),
                             (i & 4) != 0 ? body.high_mm.z() : body.low_mm.z());
    low_mm = std::min(low_mm, machine_from_sensor.row(2).dot(corner_mm));
  }
  return -low_mm;
}

Vector3d AtHeight(const Vector3d& origin_mm, double z_mm) { return {origin_mm.x(), origin_mm.y(), z_mm}; }

bool StandAlike(const RotaryPose& one, const RotaryPose& other) {
  return one.a_rad == other.a_rad && one.b_rad == other.b_rad;
}

}  // namespace

absl::StatusOr<PortionPlacer> PortionPlacer::Make(const PlanScene& scene) {
  const SensorBody& body = scene.options.body;
  if (!((body.high_mm - body.low_mm).minCoeff() > 0 && body.low_mm.allFinite() && body.high_mm.allFinite()))
    return Refuse("body", "low and high corners out of order", "a box: each coordinate of its low corner less");
  PortionPlacer placer(scene);
  placer.safe_height_mm_ = scene.axes.PointC().z() + TurningRadius_mm(scene) + scene.options.clearance_mm +
                           scene.options.margin_mm + Below_mm(body, scene.view.machine_from_sensor());
  return placer;
}

Vector3d PortionPlacer::StartOrigin(const PlannedPortion& portion) const {
  return scene_.view.OriginAt(0, portion.v0_mm);
}
Vector3d PortionPlacer::EndOrigin(const PlannedPortion& portion) const {
  return scene_.view.OriginAt(portion.length_mm, portion.v0_mm);
}

// The scanner is a tool whose tip is the sensor frame's origin.
absl::StatusOr<Eigen::VectorXd> PortionPlacer::Positions(const RotaryPose& pose, const Vector3d& origin_mm) const {
  const Vector3d in_zero_mm = scene_.axes.MachineFromZero(pose.a_rad, pose.b_rad).inverse() * origin_mm;
  return scene_.solver.Place(in_zero_mm, {pose.b_rad, pose.a_rad}, Eigen::VectorXd::Zero(scene_.solver.chain().size()));
}

bool PortionPlacer::IsClear(const RotaryPose& pose, TurnedBox box) const {
  const Eigen::Isometry3d part_from_machine = scene_.MachineFromPart(pose).inverse();
  box.centre_mm = part_from_machine * box.centre_mm;
  box.axes = part_from_machine.linear() * box.axes;
  const auto is_clear_of = [&](const TurnedBox& in_part) {
    return metrology::IsClear(in_part, scene_.surface, scene_.options.clearance_mm + scene_.options.margin_mm);
  };
  return is_clear_of(box) && std::all_of(scene_.neighbour_from_part.begin(), scene_.neighbour_from_part.end(),
                                         [&](const Eigen::Isometry3d& neighbour_from_part) {
                                           return is_clear_of({neighbour_from_part * box.centre_mm,
                                                               neighbour_from_part.linear() * box.axes, box.half_mm});
                                         });
}

Obstacle PortionPlacer::Place(PlannedPortion* portion) const {
  const Vector3d start_mm = StartOrigin(*portion), end_mm = EndOrigin(*portion);
  const double height_mm = std::max(safe_height_mm_, start_mm.z());
  const Vector3d above_start_mm = AtHeight(start_mm, height_mm), above_end_mm = AtHeight(end_mm, height_mm);
  for (const auto& [origin_mm, positions] : {std::pair(&above_start_mm, &portion->enter),
                                             {&start_mm, &portion->start},
                                             {&end_mm, &portion->end},
                                             {&above_end_mm, &portion->leave}}) {
    auto reached = Positions(portion->pose, *origin_mm);
    if (!reached.ok()) return Obstacle::kTravel;
    *positions = *std::move(reached);
  }
  const Eigen::Matrix3d& axes = scene_.view.machine_from_sensor();
  const SensorBody& body = scene_.options.body;
  for (const auto& [from_mm, to_mm] :
       {std::pair(&start_mm, &end_mm), {&above_start_mm, &start_mm}, {&end_mm, &above_end_mm}})
    if (!IsClear(portion->pose, SweptBody(body, axes, *from_mm, *to_mm))) return Obstacle::kClearance;
  return Obstacle::kNone;
}

double PortionPlacer::TransferHeight_mm(const PlannedPortion& from, const PlannedPortion& to) const {
  const Vector3d end_mm = EndOrigin(from), start_mm = StartOrigin(to);
  const double level_mm = std::max(end_mm.z(), start_mm.z());
  const double safe_mm = std::max(safe_height_mm_, level_mm);
  if (!StandAlike(from.pose, to.pose)) return safe_mm;
  const TurnedBox box = BodyBetween(scene_.options.body, scene_.view.machine_from_sensor(), AtHeight(end_mm, level_mm),
                                    AtHeight(start_mm, level_mm));
  return IsClear(from.pose, box) ? level_mm : safe_mm;
}

double PortionPlacer::Travel_mm(const PlannedPortion& from, const PlannedPortion& to) const {
  const Vector3d end_mm = EndOrigin(from), start_mm = StartOrigin(to);
  const double height_mm = TransferHeight_mm(from, to);
  return (start_mm - end_mm).head<2>().norm() + (height_mm - end_mm.z()) + (height_mm - start_mm.z()) +
         scene_.options.rotary_travel_mm_per_rad *
             (std::abs(to.pose.a_rad - from.pose.a_rad) + std::abs(to.pose.b_rad - from.pose.b_rad));
}

void PortionPlacer::Join(PlannedPortion* from, PlannedPortion* to) const {
  const double height_mm = TransferHeight_mm(*from, *to);
  const auto set = [&](const RotaryPose& pose, const Vector3d& origin_mm, Eigen::VectorXd* positions) {
    auto reached = Positions(pose, AtHeight(origin_mm, height_mm));
    if (reached.ok()) *positions = *std::move(reached);  // else what it has: higher still
  };
  set(from->pose, EndOrigin(*from), &from->leave);
  set(to->pose, StartOrigin(*to), &to->enter);
}

}  // namespace sixpoint::metrology
