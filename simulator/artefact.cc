#include "simulator/artefact.h"

#include <cmath>

#include "metrology/frames/angles.h"

namespace sixpoint::simulator {
namespace {

using metrology::kRadPerDeg;

// The nearest hit beyond a distance and within the limit.
class Nearest {
 public:
  Nearest(double after_mm, double limit_mm) : after_mm_(after_mm), nearest_mm_(limit_mm) {}
  void Offer(double t, const Eigen::Vector3d& normal) {
    if (!(t > after_mm_ && t < nearest_mm_)) return;
    nearest_mm_ = t;
    normal_ = normal;
    found_ = true;
  }
  std::optional<Hit> hit() const { return found_ ? std::optional<Hit>(Hit{nearest_mm_, normal_}) : std::nullopt; }

 private:
  double after_mm_, nearest_mm_;
  Eigen::Vector3d normal_ = Eigen::Vector3d::Zero();
  bool found_ = false;
};

}  // namespace

double ArtefactGeometry::cone_depth_mm() const {
  return (cone_top_radius_mm - cone_bottom_radius_mm) / std::tan(cone_half_angle_deg * kRadPerDeg);
}

ArtefactShape::ArtefactShape(ArtefactGeometry geometry) : geometry_(std::move(geometry)) {
  for (const auto& [name, centre] : geometry_.cones_mm) cones_mm_.push_back(centre);
  for (const auto& [name, centre] : geometry_.slots_mm) slots_mm_.push_back(centre);
}

std::optional<Hit> ArtefactShape::Intersect(const Ray& ray, double limit_mm) const {
  const double half = geometry_.side_mm / 2;
  const Eigen::Vector3d& o = ray.origin_mm;
  const Eigen::Vector3d& d = ray.direction;
  if (d.z() >= 0 || o.z() <= 0) return std::nullopt;  // the scanner is always above the plate
  const double face_t = -o.z() / d.z();
  const Eigen::Vector2d at = (o + face_t * d).head<2>();

  if (std::abs(at.x()) > half || std::abs(at.y()) > half) {
    Nearest side(0, limit_mm);
    for (int k = 0; k < 2; ++k) {
      if (d[k] == 0) continue;
      const double sign = d[k] < 0 ? 1 : -1;
      const double t = (sign * half - o[k]) / d[k];
      const Eigen::Vector3d p = o + t * d;
      if (p.z() <= 0 && p.z() >= -geometry_.height_mm && std::abs(p[1 - k]) <= half)
        side.Offer(t, sign * Eigen::Vector3d::Unit(k));
    }
    return side.hit();
  }

  for (const Eigen::Vector2d& centre : cones_mm_) {
    if ((at - centre).norm() >= geometry_.cone_top_radius_mm) continue;
    Nearest inside(face_t, limit_mm);
    const double floor_t = (-geometry_.cone_depth_mm() - o.z()) / d.z();
    if (((o + floor_t * d).head<2>() - centre).norm() <= geometry_.cone_bottom_radius_mm)
      inside.Offer(floor_t, Eigen::Vector3d::UnitZ());
    // |p - centre|^2 = (top + slope z)^2 along the ray; slope = tan(half angle).
    const double slope = std::tan(geometry_.cone_half_angle_deg * kRadPerDeg);
    const Eigen::Vector2d from = o.head<2>() - centre;
    const double radius = geometry_.cone_top_radius_mm + slope * o.z();
    const double a = d.head<2>().squaredNorm() - slope * slope * d.z() * d.z();
    const double half_b = from.dot(d.head<2>()) - radius * slope * d.z();
    const double c = from.squaredNorm() - radius * radius;
    const double discriminant = half_b * half_b - a * c;
    if (discriminant >= 0) {
      // Both roots without cancellation; a may be near zero when the ray runs along the cone.
      const double q = -(half_b + std::copysign(std::sqrt(discriminant), half_b));
      for (const double t : {q / a, c / q}) {
        if (!std::isfinite(t)) continue;
        const Eigen::Vector3d p = o + t * d;
        if (p.z() > 0 || p.z() < -geometry_.cone_depth_mm()) continue;
        const Eigen::Vector2d outward = (p.head<2>() - centre).normalized();
        inside.Offer(t, Eigen::Vector3d(-outward.x(), -outward.y(), slope).normalized());
      }
    }
    return inside.hit();
  }

  for (const Eigen::Vector2d& centre : slots_mm_) {
    const double half_slot = geometry_.slot_width_mm / 2;
    const Eigen::Vector2d in_slot = at - centre;
    if (std::abs(in_slot.x()) >= half_slot || std::abs(in_slot.y()) >= half_slot) continue;
    Nearest inside(face_t, limit_mm);
    inside.Offer((-geometry_.slot_depth_mm - o.z()) / d.z(), Eigen::Vector3d::UnitZ());
    for (int k = 0; k < 2; ++k) {
      if (d[k] == 0) continue;
      const double sign = d[k] > 0 ? 1 : -1;
      inside.Offer((centre[k] + sign * half_slot - o[k]) / d[k], -sign * Eigen::Vector3d::Unit(k));
    }
    return inside.hit();
  }

  if (face_t >= limit_mm) return std::nullopt;
  return Hit{face_t, Eigen::Vector3d::UnitZ()};
}

TouchProbing ProbeArtefact(const ArtefactGeometry& geometry, const Eigen::Isometry3d& machine_from_artefact,
                           double noise_um, Random random) {
  const auto touch = [&](double x, double y, double z) -> Eigen::Vector3d {
    return machine_from_artefact * Eigen::Vector3d(x, y, z) + 1e-3 * noise_um * random.GaussianVector();
  };
  TouchProbing probing;
  for (const auto* features : {&geometry.cones_mm, &geometry.slots_mm})
    for (const auto& [name, centre] : *features) probing.centres_mm[name] = touch(centre.x(), centre.y(), 0);
  const double half = geometry.side_mm / 2;
  while (probing.plane_mm.size() < 16) {
    const Eigen::Vector2d at(random.Uniform(1 - half, half - 1), random.Uniform(1 - half, half - 1));
    // The ball of the probe must rest on the face alone.
    bool clear = true;
    for (const auto& [name, centre] : geometry.cones_mm)
      clear = clear && (at - centre).norm() > geometry.cone_top_radius_mm + 0.5;
    for (const auto& [name, centre] : geometry.slots_mm)
      clear = clear && (at - centre).cwiseAbs().maxCoeff() > geometry.slot_width_mm / 2 + 0.5;
    if (clear) probing.plane_mm.push_back(touch(at.x(), at.y(), 0));
  }
  for (int i = 0; i < 6; ++i) {
    const double along = -9 + 3.6 * i;
    probing.side_x_mm.push_back(touch(half, along, -3));
    probing.side_y_mm.push_back(touch(along, half, -3));
  }
  return probing;
}

}  // namespace sixpoint::simulator
