#include "tests/metrology/calibration/artefact_sampler.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace sixpoint::testing {
namespace {

using metrology::Artefact;
using metrology::LineScan;
using metrology::Matrix6d;
using metrology::PlaneFeature;

}  // namespace

ArtefactBench ArtefactBench::Usual(double turn_deg) {
  ArtefactBench b;
  b.artefact.side_mm = 24;
  b.artefact.cones = {{"C1", {-3.5, 0}}, {"C2", {3.5, 3.5}}, {"C3", {3.5, -3.5}}};
  b.artefact.cone_half_angle_rad = M_PI / 4;
  b.artefact.cone_top_radius_mm = 2;
  b.artefact.cone_bottom_radius_mm = 0.5;
  b.artefact.slots = {{"Q1", {-3.5, 6.5}}, {"Q2", {-3.5, -6.5}}, {"Q3", {9, 0}}};
  b.artefact.slot_width_mm = 2.4;
  b.artefact.slot_depth_mm = 0.8;
  constexpr double kDeg = M_PI / 180;
  b.sensor.rotation = metrology::RotationFromCardan({0.21 * kDeg, -0.37 * kDeg, 0.52 * kDeg});
  b.sensor.t_sm_mm = {14.77, -41.74, 85.38};
  b.machine_from_artefact = Eigen::Translation3d(204.8, 137.1, -179.9) *
                            Eigen::AngleAxisd(turn_deg * kDeg, Eigen::Vector3d::UnitZ()) *
                            Eigen::AngleAxisd(0.27 * kDeg, Eigen::Vector3d::UnitY()) *
                            Eigen::AngleAxisd(-0.15 * kDeg, Eigen::Vector3d::UnitX());
  return b;
}

ArtefactBench::Ray ArtefactBench::RayAt(double x_mm, double angle_rad, const Eigen::Vector3d& v0_mm) const {
  const Eigen::Vector3d along(0, std::sin(angle_rad), -std::cos(angle_rad));
  return {sensor.rotation.col(2) * optics.mid_range_mm + Eigen::Vector3d(x_mm, 0, 0) - v0_mm + sensor.t_sm_mm,
          sensor.rotation * along};
}

std::optional<double> ArtefactBench::Range(const Ray& ray, Face* face) const {
  const Eigen::Isometry3d artefact_from_machine = machine_from_artefact.inverse();
  const Eigen::Vector3d o = artefact_from_machine * ray.origin, d = artefact_from_machine.linear() * ray.direction;
  const double to_plane = -o.z() / d.z();
  const Eigen::Vector3d p = o + to_plane * d;
  if (p.head<2>().cwiseAbs().maxCoeff() > artefact.side_mm / 2) return std::nullopt;
  for (const PlaneFeature& cone : artefact.cones) {
    const Eigen::Vector2d u = p.head<2>() - cone.centre_mm;
    if (u.norm() >= artefact.cone_top_radius_mm) continue;
    // |u + s d_xy| = top + z tan(half angle), z = s d_z, s beyond the plane.
    const double slope = std::tan(artefact.cone_half_angle_rad), top = artefact.cone_top_radius_mm;
    const double a = d.head<2>().squaredNorm() - d.z() * d.z() * slope * slope;
    const double h = u.dot(d.head<2>()) - top * d.z() * slope, c = u.squaredNorm() - top * top;
    // a s^2 + 2 h s + c = 0 with c < 0: the smallest positive root.
    const double root = std::sqrt(std::max(0.0, h * h - a * c));
    double s = -1;
    for (const double candidate : {c / (-h - root), c / (-h + root)})
      if (candidate > 0 && (s < 0 || candidate < s)) s = candidate;
    const double z = s * d.z();
    if (s < 0 || z < -artefact.ConeDepth()) return std::nullopt;  // through the bottom
    *face = Face::kCone;
    return to_plane + s;
  }
  for (const PlaneFeature& slot : artefact.slots) {
    if ((p.head<2>() - slot.centre_mm).cwiseAbs().maxCoeff() >= artefact.slot_width_mm / 2) continue;
    const double s = -artefact.slot_depth_mm / d.z();
    const Eigen::Vector2d floor = p.head<2>() + s * d.head<2>() - slot.centre_mm;
    if (floor.cwiseAbs().maxCoeff() >= artefact.slot_width_mm / 2) return std::nullopt;  // a wall
    *face = Face::kFloor;
    return to_plane + s;
  }
  *face = Face::kUpper;
  return to_plane;
}

Eigen::Vector3d ArtefactBench::StartAt(double z_sensor_mm) const {
  return sensor.rotation.col(2) * z_sensor_mm + sensor.t_sm_mm - machine_from_artefact.translation();
}

LineScan ArtefactBench::Scan(const std::string& id, double z_sensor_mm, double noise_mm,
                             std::mt19937_64* random) const {
  LineScan scan;
  scan.id = id;
  scan.v0_mm = StartAt(z_sensor_mm);
  scan.profile_pitch_mm = pitch_mm;
  std::normal_distribution<double> noise(0, 1);
  Face face{};
  for (double x = -artefact.side_mm / 2 - 0.2; x < artefact.side_mm / 2 + 0.2; x += pitch_mm)
    for (int column = 0; column < columns; ++column) {
      const double angle = line_half_angle_rad * (2.0 * column / (columns - 1) - 1);
      const std::optional<double> range = Range(RayAt(x, angle, scan.v0_mm), &face);
      if (!range) continue;
      const double read = *range + (noise_mm > 0 ? noise_mm * noise(*random) : 0);
      scan.points_mm.emplace_back(x, read * std::sin(angle), optics.mid_range_mm - read * std::cos(angle));
    }
  return scan;
}

metrology::ArtefactTouch ArtefactBench::Touch(double noise_mm, std::mt19937_64* random) const {
  std::normal_distribution<double> noise(0, 1);
  const auto touched = [&](double x, double y, double z) {
    Eigen::Vector3d p = machine_from_artefact * Eigen::Vector3d(x, y, z);
    if (noise_mm > 0) p += noise_mm * Eigen::Vector3d(noise(*random), noise(*random), noise(*random));
    return p;
  };
  metrology::ArtefactTouch touch;
  for (const std::vector<PlaneFeature>* features : {&artefact.cones, &artefact.slots})
    for (const PlaneFeature& f : *features)
      touch.centres.push_back({f.name, touched(f.centre_mm.x(), f.centre_mm.y(), 0)});
  for (int i = 0; i < 16; ++i) touch.plane_mm.push_back(touched(-10.5 + 7.0 * (i % 4), -10.5 + 7.0 * (i / 4.0), 0));
  for (int i = 0; i < 6; ++i) touch.side_x_mm.push_back(touched(12, -9 + 3.6 * i, -3));
  for (int i = 0; i < 6; ++i) touch.side_y_mm.push_back(touched(-9 + 3.6 * i, 12, -3));
  return touch;
}

Matrix6d ArtefactBench::CramerRaoBound() const {
  using Matrix12d = Eigen::Matrix<double, 12, 12>;
  using Vector12d = Eigen::Matrix<double, 12, 1>;
  constexpr double kStep = 1e-5;
  std::vector<std::pair<ArtefactBench, ArtefactBench>> moved;
  for (int k = 0; k < 12; ++k) {
    const auto by = [&](double step) {
      ArtefactBench b = *this;
      metrology::Vector6d w = metrology::Vector6d::Zero();
      w(k % 6) = step;
      if (k < 6) {
        b.sensor.rotation = metrology::RotationFromVector(w.head<3>()) * sensor.rotation;
        b.sensor.t_sm_mm += w.tail<3>();
      } else {
        b.machine_from_artefact = metrology::Perturbed(machine_from_artefact, w, machine_from_artefact.translation());
      }
      return b;
    };
    moved.emplace_back(by(kStep), by(-kStep));
  }
  Matrix12d information = Matrix12d::Zero();
  for (const double z : {10.0, -10.0}) {
    const Eigen::Vector3d v0 = StartAt(z);
    for (double x = -artefact.side_mm / 2; x < artefact.side_mm / 2; x += pitch_mm)
      for (int column = 0; column < columns; ++column) {
        const double angle = line_half_angle_rad * (2.0 * column / (columns - 1) - 1);
        Face face{}, up_face{}, down_face{};
        if (!Range(RayAt(x, angle, v0), &face) || face == Face::kFloor) continue;
        Vector12d row;
        bool whole = true;  // a ray that changes its face with the step has no derivative
        for (int k = 0; k < 12 && whole; ++k) {
          const auto up = moved[k].first.Range(moved[k].first.RayAt(x, angle, v0), &up_face);
          const auto down = moved[k].second.Range(moved[k].second.RayAt(x, angle, v0), &down_face);
          whole = up && down && up_face == face && down_face == face;
          if (whole) row(k) = (*up - *down) / (2 * kStep);
        }
        if (whole) information += row * row.transpose() / (optics.noise_mm * optics.noise_mm);
      }
  }
  // Touched coordinates: centres whole, face points along their normal; by differences too.
  const auto coordinates = [](const ArtefactBench& b, const ArtefactBench& truth) {
    std::vector<double> values;
    for (const PlaneFeature& c : b.artefact.cones) {
      const Eigen::Vector3d p = b.machine_from_artefact * Eigen::Vector3d(c.centre_mm.x(), c.centre_mm.y(), 0);
      values.insert(values.end(), {p.x(), p.y(), p.z()});
    }
    const metrology::ArtefactTouch touched = truth.Touch(0, nullptr);
    const Eigen::Isometry3d back = b.machine_from_artefact.inverse();
    for (const Eigen::Vector3d& p : touched.plane_mm) values.push_back((back * p).z());
    for (const Eigen::Vector3d& p : touched.side_x_mm) values.push_back((back * p).x());
    for (const Eigen::Vector3d& p : touched.side_y_mm) values.push_back((back * p).y());
    return values;
  };
  std::vector<std::vector<double>> up, down;
  for (const auto& [a, b] : moved) {
    up.push_back(coordinates(a, *this));
    down.push_back(coordinates(b, *this));
  }
  for (size_t i = 0; i < up[0].size(); ++i) {
    Vector12d row;
    for (int k = 0; k < 12; ++k) row(k) = (up[k][i] - down[k][i]) / (2 * kStep);
    information += row * row.transpose() / (touch_noise_mm * touch_noise_mm);
  }
  // Scaled, for rad and mm differ by orders of magnitude.
  const Vector12d scale = information.diagonal().cwiseSqrt().cwiseInverse();
  const Matrix12d inverse = Matrix12d(scale.asDiagonal() * information * scale.asDiagonal()).inverse();
  return (scale.asDiagonal() * inverse * scale.asDiagonal()).topLeftCorner<6, 6>();
}

}  // namespace sixpoint::testing
