#include "metrology/calibration/feature_centres.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace sixpoint::metrology {
namespace {

constexpr double kMarginMm = 0.15;
constexpr int kFewestUpperPoints = 1000;

// In-plane bounds on a slot's centre along one direction, from points on the upper face beside it and readings in it.
struct Bounds {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  void AtLeast(double v) { low = std::max(low, v); }
  void AtMost(double v) { high = std::min(high, v); }
  // A point of the upper face beside the slot, or a ray that went into it, `along` from the nominal centre.
  void Outside(double along, double half_width) {
    if (along < 0)
      AtLeast(along + half_width);
    else
      AtMost(along - half_width);
  }
  void Inside(double along, double half_width) {
    AtLeast(along - half_width);
    AtMost(along + half_width);
  }
  bool known() const { return std::isfinite(low) && std::isfinite(high) && high - low < 0.2; }
  double middle() const { return (low + high) / 2; }
};

}  // namespace

FaceHit HitFace(const Artefact& artefact, const Eigen::Vector3d& p, double margin_mm) {
  FaceHit hit;
  const double edge = artefact.side_mm / 2 - margin_mm;
  if (std::abs(p.x()) > edge || std::abs(p.y()) > edge) return hit;
  for (size_t k = 0; k < artefact.cones.size(); ++k) {
    const Eigen::Vector2d d = p.head<2>() - artefact.cones[k].centre_mm;
    const double squared = d.squaredNorm(), outer = artefact.cone_top_radius_mm + margin_mm;
    if (squared >= outer * outer) continue;
    const double inner = artefact.cone_bottom_radius_mm + margin_mm, top = artefact.cone_top_radius_mm - margin_mm;
    if (squared <= inner * inner || squared >= top * top) return hit;
    const double r = std::sqrt(squared), c = std::cos(artefact.cone_half_angle_rad),
                 s = std::sin(artefact.cone_half_angle_rad);
    hit.face = FaceHit::Face::kCone;
    hit.cone = static_cast<int>(k);
    // Out of the material is towards the cone's axis.
    hit.distance_mm = p.z() * s - (r - artefact.cone_top_radius_mm) * c;
    hit.normal << -c * d.x() / r, -c * d.y() / r, s;
    return hit;
  }
  for (const PlaneFeature& slot : artefact.slots)
    if ((p.head<2>() - slot.centre_mm).cwiseAbs().maxCoeff() < artefact.slot_width_mm / 2 + margin_mm) return hit;
  hit.face = FaceHit::Face::kUpper;
  hit.distance_mm = p.z();
  return hit;
}

ArtefactFromSensor::ArtefactFromSensor(const Eigen::Isometry3d& machine_from_artefact, const SensorPose& sensor,
                                       const Eigen::Vector3d& v0_mm) {
  const Eigen::Isometry3d artefact_from_machine = machine_from_artefact.inverse();
  Eigen::Matrix3d machine_from_sensor;
  machine_from_sensor << Eigen::Vector3d::UnitX(), sensor.rotation.col(1), sensor.rotation.col(2);
  linear = artefact_from_machine.linear() * machine_from_sensor;
  offset = artefact_from_machine * (sensor.t_sm_mm - v0_mm);
}

namespace {

struct Wall {
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  int count = 0;
};

// A point near a feature, and the ray that saw it; artefact frame.
struct Kept {
  Eigen::Vector3d at;
  Eigen::Vector3d ray;
};

struct Sorted {
  Eigen::Vector3d upper = Eigen::Vector3d::Zero();  // the upper face's height = upper . (x, y, 1)
  std::vector<std::vector<Kept>> walls, slots;      // of each cone, near each slot

  double HeightOver(const Eigen::Vector3d& at) const { return at.z() - upper.dot(Eigen::Vector3d(at.x(), at.y(), 1)); }
};

// One pass keeps what the features need; the upper face as sums of (x, y, 1) and height, twice: wide, then trimmed.
absl::StatusOr<Sorted> SortPoints(const LineScan& scan, const Artefact& artefact, const ArtefactFromSensor& map,
                                  const LineSensorOptics& optics) {
  const double half_slot = artefact.slot_width_mm / 2;
  Sorted sorted;
  sorted.walls.resize(artefact.cones.size());
  sorted.slots.resize(artefact.slots.size());
  for (const double band : {0.25, 0.02}) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    int upper_count = 0;
    for (const Eigen::Vector3d& p : scan.points_mm) {
      const Eigen::Vector3d at = map * p;
      const FaceHit hit = HitFace(artefact, at, kMarginMm);
      if (hit.face == FaceHit::Face::kUpper) {
        const Eigen::Vector3d row(at.x(), at.y(), 1);
        if (std::abs(at.z() - sorted.upper.dot(row)) > band) continue;
        normal.noalias() += row * row.transpose();
        right += at.z() * row;
        ++upper_count;
      }
      if (band > 0.1) continue;
      if (hit.face == FaceHit::Face::kCone) {
        if (std::abs(hit.distance_mm) < 0.25)
          sorted.walls[hit.cone].push_back({at, (map.linear * optics.RayAt(p)).normalized()});
        continue;
      }
      for (size_t k = 0; k < sorted.slots.size(); ++k)
        if ((at.head<2>() - artefact.slots[k].centre_mm).cwiseAbs().maxCoeff() < half_slot + 0.4)
          sorted.slots[k].push_back({at, (map.linear * optics.RayAt(p)).normalized()});
    }
    if (upper_count < kFewestUpperPoints)
      return absl::FailedPreconditionError("scan " + scan.id + ": " + std::to_string(upper_count) +
                                           " points on the artefact's upper face, want at least " +
                                           std::to_string(kFewestUpperPoints));
    sorted.upper = normal.ldlt().solve(right);
  }
  return sorted;
}

// The cone's centre on the upper face, from its wall.
absl::StatusOr<Eigen::Vector2d> ConeCentre(const std::string& scan_id, const Artefact& artefact, const Sorted& sorted,
                                           size_t k) {
  const double c = std::cos(artefact.cone_half_angle_rad), s = std::sin(artefact.cone_half_angle_rad);
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();
  int count = 0;
  double gate = 0.25;
  for (int iteration = 0; iteration < 6; ++iteration) {
    Wall wall;
    double squares = 0;
    for (const Kept& w : sorted.walls[k]) {
      const Eigen::Vector2d d = w.at.head<2>() - artefact.cones[k].centre_mm - shift;
      const double r = d.norm();
      const double distance = sorted.HeightOver(w.at) * s - (r - artefact.cone_top_radius_mm) * c;
      if (std::abs(distance) > gate) continue;
      const Eigen::Vector2d row = c * d / r;  // change of distance per shift of the centre
      const double along_ray = w.ray.dot(Eigen::Vector3d(-row.x(), -row.y(), s));
      const double weight = 1 / (along_ray * along_ray);
      wall.normal += weight * row * row.transpose();
      wall.right -= weight * distance * row;
      squares += distance * distance;
      ++wall.count;
    }
    count = wall.count;
    if (count < kFewestConePoints) break;
    shift += wall.normal.ldlt().solve(wall.right);
    gate = std::max(6 * std::sqrt(squares / count), 0.008);
  }
  if (count < kFewestConePoints || !shift.allFinite() || shift.norm() > 0.6)
    return absl::FailedPreconditionError("scan " + scan_id + ": " + std::to_string(count) + " points on cone " +
                                         artefact.cones[k].name + "'s wall, want at least " +
                                         std::to_string(kFewestConePoints) + " that agree with the artefact's record");
  return Eigen::Vector2d(artefact.cones[k].centre_mm + shift);
}

// The slot's centre, where its edges were seen on all four sides.
std::optional<Eigen::Vector2d> SlotCentre(const Artefact& artefact, const Sorted& sorted, size_t k) {
  const double half_slot = artefact.slot_width_mm / 2;
  Bounds along_x, along_y;
  for (const Kept& w : sorted.slots[k]) {
    const double height = sorted.HeightOver(w.at);
    const bool outside = std::abs(height) < 0.012, inside = height < -0.05;
    if (!outside && !inside) continue;
    // A ray that went in is carried back to the height of the upper face, where its edge is.
    const Eigen::Vector3d at = inside ? Eigen::Vector3d(w.at - w.ray * (height / w.ray.z())) : w.at;
    const Eigen::Vector2d d = at.head<2>() - artefact.slots[k].centre_mm;
    if (std::abs(d.y()) < half_slot - 0.2)
      inside ? along_x.Inside(d.x(), half_slot) : along_x.Outside(d.x(), half_slot);
    if (std::abs(d.x()) < half_slot - 0.2)
      inside ? along_y.Inside(d.y(), half_slot) : along_y.Outside(d.y(), half_slot);
  }
  if (!along_x.known() || !along_y.known()) return std::nullopt;
  return Eigen::Vector2d(artefact.slots[k].centre_mm + Eigen::Vector2d(along_x.middle(), along_y.middle()));
}

}  // namespace

absl::StatusOr<std::vector<FeatureCentre>> MeasureCentres(const LineScan& scan, const Artefact& artefact,
                                                          const Eigen::Isometry3d& machine_from_artefact,
                                                          const SensorPose& sensor, const LineSensorOptics& optics) {
  const ArtefactFromSensor map(machine_from_artefact, sensor, scan.v0_mm);
  const absl::StatusOr<Sorted> sorted = SortPoints(scan, artefact, map, optics);
  if (!sorted.ok()) return sorted.status();
  std::vector<FeatureCentre> centres;
  const auto add = [&](const std::string& name, const Eigen::Vector2d& at, bool slot) {
    const Eigen::Vector3d in_artefact(at.x(), at.y(), sorted->upper.dot(Eigen::Vector3d(at.x(), at.y(), 1)));
    centres.push_back(
        {name, machine_from_artefact * in_artefact, map.linear.inverse() * (in_artefact - map.offset), slot});
  };
  for (size_t k = 0; k < artefact.cones.size(); ++k) {
    const absl::StatusOr<Eigen::Vector2d> centre = ConeCentre(scan.id, artefact, *sorted, k);
    if (!centre.ok()) return centre.status();
    add(artefact.cones[k].name, *centre, false);
  }
  for (size_t k = 0; k < artefact.slots.size(); ++k)
    if (const auto centre = SlotCentre(artefact, *sorted, k)) add(artefact.slots[k].name, *centre, true);
  return centres;
}

}  // namespace sixpoint::metrology
