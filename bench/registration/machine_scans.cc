#include "bench/registration/machine_scans.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <string>

namespace sixpoint::bench {
namespace {

using Eigen::Vector3d;

constexpr double kSeen = 0.35;  // least cosine between a normal and the way to the scanner
constexpr double kDenseRadiusMm = 1.6;
constexpr double kDensePerMm2 = 100;
// What calibrations at their bound leave: of the sensor's turns and place, of the axes' directions and places.
constexpr double kSensorRad = 1e-5, kSensorMm = 5e-4, kAxisRad = 5e-6, kAxisMm = 4e-4;

Vector3d AnyDirection(std::mt19937_64* random) {
  std::normal_distribution<double> normal(0, 1);
  const double x = normal(*random), y = normal(*random), z = normal(*random);
  return Vector3d(x, y, z).normalized();
}

// Points spread by area over triangles, moved by the casting, in the part frame.
class FaceSampler {
 public:
  FaceSampler(const Blade& blade, std::vector<std::uint32_t> triangles, const ViewScans& scans)
      : blade_(blade), scans_(scans), triangles_(std::move(triangles)) {
    double area = 0;
    for (const std::uint32_t t : triangles_) area_up_to_mm2_.push_back(area += blade.areas_mm2[t]);
  }
  double area_mm2() const { return area_up_to_mm2_.empty() ? 0 : area_up_to_mm2_.back(); }
  Vector3d Next(std::mt19937_64* random) const {
    std::uniform_real_distribution<double> uniform(0, 1);
    const auto found =
        std::upper_bound(area_up_to_mm2_.begin(), area_up_to_mm2_.end() - 1, uniform(*random) * area_mm2());
    const std::uint32_t t = triangles_[static_cast<std::size_t>(found - area_up_to_mm2_.begin())];
    const auto& corners = blade_.mesh.triangles[t];
    const double r = std::sqrt(uniform(*random)), q = uniform(*random);
    const Vector3d on = (1 - r) * blade_.mesh.vertices_mm[corners[0]] +
                        r * (1 - q) * blade_.mesh.vertices_mm[corners[1]] + r * q * blade_.mesh.vertices_mm[corners[2]];
    double off_mm = scans_.deviation_mm ? scans_.deviation_mm(on) : 0;
    for (const Bump& bump : scans_.bumps) off_mm += bump.At(on, blade_.normals[t]);
    return on + off_mm * blade_.normals[t];
  }

 private:
  const Blade& blade_;
  const ViewScans& scans_;
  std::vector<std::uint32_t> triangles_;
  std::vector<double> area_up_to_mm2_;
};

}  // namespace

metrology::MachineCalibration TrueMachine() {
  metrology::MachineCalibration machine = metrology::MachineCalibration::Exact();
  machine.sensor.rotation = metrology::RotationFromVector({0.01, -0.02, 0.015});
  machine.sensor.t_sm_mm = {3, -2, 150};
  machine.axes.a = {Vector3d(1e-3, 1, -2e-3).normalized(), {10, 40, -230}};
  machine.axes.b = {Vector3d(1, -1e-3, 3e-3).normalized(), {12, 42, -228}};
  metrology::Vector6d sensor;
  sensor << Vector3d::Constant(kSensorRad), Vector3d::Constant(kSensorMm);
  machine.sensor.covariance = sensor.cwiseAbs2().asDiagonal();
  Eigen::Matrix<double, 8, 1> axes;
  axes << kAxisRad, kAxisRad, kAxisMm, kAxisMm, kAxisRad, kAxisRad, kAxisMm, kAxisMm;
  machine.axes_covariance = axes.cwiseAbs2().asDiagonal();
  return machine;
}

metrology::MachineCalibration Calibrated(const metrology::MachineCalibration& truth, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, 1);
  const auto drawn = [&](const auto& covariance) {
    auto errors = covariance.diagonal().cwiseSqrt().eval();
    for (Eigen::Index k = 0; k < errors.size(); ++k) errors[k] *= normal(random);
    return errors;
  };
  metrology::MachineCalibration believed = truth;
  const metrology::Vector6d sensor = drawn(truth.sensor.covariance);
  believed.sensor.rotation = metrology::RotationFromVector(sensor.head<3>()) * truth.sensor.rotation;
  believed.sensor.t_sm_mm += sensor.tail<3>();
  believed.axes = truth.axes.Perturbed(drawn(truth.axes_covariance));
  return believed;
}

Eigen::Isometry3d BladeOnMachine() {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = metrology::RotationFromVector({0.02, -0.01, 0.03}) *
                  Eigen::AngleAxisd(M_PI / 2, Vector3d::UnitY()).toRotationMatrix();
  pose.translation() << 70, 45, -220;
  return pose;
}

std::vector<View> ViewsAround(int count, bool tip) {
  std::vector<View> views;
  for (int i = 0; i < count; ++i) views.push_back({0, 2 * M_PI * i / count});
  if (tip) views.push_back({-M_PI / 3, 0});  // turns the span's end up to the scanner
  return views;
}

std::vector<metrology::ScanPortion> ScansOf(const Blade& blade, const ViewScans& scans,
                                            const metrology::MachineCalibration& truth,
                                            const metrology::MachineCalibration& believed) {
  std::mt19937_64 random(scans.seed);
  std::normal_distribution<double> normal(0, 1);
  Eigen::Matrix3d machine_from_sensor;
  machine_from_sensor << Vector3d::UnitX(), truth.sensor.rotation.col(1), truth.sensor.rotation.col(2);
  const Eigen::Matrix3d sensor_from_machine = machine_from_sensor.inverse();
  metrology::Points dense_zero_mm;
  for (const Vector3d& place : scans.dense_places_mm) dense_zero_mm.push_back(scans.zero_from_part * place);
  std::vector<metrology::ScanPortion> portions;
  for (std::size_t v = 0; v < scans.views.size(); ++v) {
    metrology::LineScan scan;
    scan.id = "view " + std::to_string(v + 1);
    scan.a_rad = scans.views[v].a_rad;
    scan.b_rad = scans.views[v].b_rad;
    const Eigen::Isometry3d machine_from_part =
        truth.axes.MachineFromZero(scan.a_rad, scan.b_rad) * scans.zero_from_part;
    const auto read = [&](const Vector3d& part_mm) -> Vector3d {
      const double x = normal(random), y = normal(random), z = normal(random);
      return sensor_from_machine *
             (machine_from_part * part_mm + scans.noise_mm * Vector3d(x, y, z) - truth.sensor.t_sm_mm);
    };
    std::vector<std::uint32_t> seen, close;
    const Vector3d to_scanner = machine_from_part.linear().transpose() * truth.sensor.rotation.col(2);
    for (std::uint32_t t = 0; t < blade.normals.size(); ++t) {
      if (!(blade.normals[t].dot(to_scanner) > kSeen)) continue;
      seen.push_back(t);
      const auto& corners = blade.mesh.triangles[t];
      const Vector3d& corner = blade.mesh.vertices_mm[corners[0]];
      const double reach_mm = kDenseRadiusMm + std::max((blade.mesh.vertices_mm[corners[1]] - corner).norm(),
                                                        (blade.mesh.vertices_mm[corners[2]] - corner).norm());
      if (std::any_of(scans.dense_places_mm.begin(), scans.dense_places_mm.end(),
                      [&](const Vector3d& place) { return (corner - place).norm() < reach_mm; }))
        close.push_back(t);
    }
    const FaceSampler faces(blade, seen, scans);
    for (std::size_t i = 0; i < scans.points; ++i) scan.points_mm.push_back(read(faces.Next(&random)));
    metrology::Thinning all;
    all.target_count = static_cast<std::int64_t>(scans.points);
    portions.push_back(metrology::Thin(scan, believed, all));
    if (close.empty()) continue;
    const FaceSampler near_places(blade, close, scans);
    scan.points_mm.clear();
    for (double i = 0; i < kDensePerMm2 * near_places.area_mm2(); ++i)
      scan.points_mm.push_back(read(near_places.Next(&random)));
    all.dense_places_mm = dense_zero_mm;
    metrology::ScanPortion dense = metrology::Thin(scan, believed, all);
    portions.back().dense_sensor_mm = std::move(dense.dense_sensor_mm);
    portions.back().dense_zero_mm = std::move(dense.dense_zero_mm);
  }
  return portions;
}

Eigen::Isometry3d Displaced(const Eigen::Isometry3d& pose, double shift_mm, double turn_rad, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  metrology::Vector6d change;
  const Vector3d turn = turn_rad * AnyDirection(&random);
  change << turn, shift_mm * AnyDirection(&random);
  return metrology::Perturbed(pose, change, pose.translation());
}

Eigen::Matrix3d AnyTurn(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, 1);
  const double w = normal(random), x = normal(random), y = normal(random), z = normal(random);
  return Eigen::Quaterniond(w, x, y, z).normalized().toRotationMatrix();
}

CoarseCase PosedAnywhere(const Blade& blade, bool whole, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  ViewScans scans;
  scans.zero_from_part.linear() = AnyTurn(seed);
  for (int k = 0; k < 3; ++k) scans.zero_from_part.translation()[k] += kPosedAnywhereMm * unit(random);
  scans.views = whole ? ViewsAround(4, true) : std::vector<View>{View()};
  scans.points = 6'000;
  scans.seed = seed;
  CoarseCase posed;
  posed.zero_from_part = scans.zero_from_part;
  posed.machine = TrueMachine();
  posed.portions = ScansOf(blade, scans, posed.machine, posed.machine);
  return posed;
}

}  // namespace sixpoint::bench
