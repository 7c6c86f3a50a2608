// Scans of a blade whose pose is known: points on its surface, with noise, as a calibrated machine would have them.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <random>
#include <vector>

#include "metrology/registration/best_fit.h"
#include "tests/metrology/mesh/shapes.h"

namespace sixpoint::metrology {

inline const Eigen::Vector3d kPartCentreMm(6350.123, -12.7, 331.6);  // real CAD stands metres from its origin
// Of a scanner.
inline constexpr double kNoiseMm = 2e-3;

inline std::shared_ptr<const Surface> BladeSurface() {
  static const auto* surface =
      new std::shared_ptr<const Surface>(*Surface::Prepare(shapes::Blade(160, 80, kPartCentreMm)));
  return *surface;
}

inline Eigen::Isometry3d BladePose() {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = RotationFromVector({0.3, -1.2, 0.5});
  pose.translation() = Eigen::Vector3d(20, 50, -190) - pose.linear() * kPartCentreMm;
  return pose;
}

// Off by 0.9 mm and 1 degree.
inline Eigen::Isometry3d StartPose() {
  Vector6d off;
  off << 0.012, -0.009, 0.01, 0.6, -0.5, 0.45;
  return Perturbed(BladePose(), off, BladePose() * kPartCentreMm);
}

// Points spread over the surface by area, in the part frame, and the normals there.
struct SpreadSamples {
  Points points_mm;
  Points normals;
};
inline SpreadSamples Spread(const Surface& surface, std::size_t count, std::uint64_t seed,
                            const std::function<bool(const SurfacePoint&)>& wanted = nullptr) {
  const TriangleMesh& mesh = surface.mesh();
  std::vector<double> areas;
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d &a = mesh.vertices_mm[t[0]], &b = mesh.vertices_mm[t[1]], &c = mesh.vertices_mm[t[2]];
    areas.push_back((b - a).cross(c - a).norm());
  }
  std::mt19937_64 random(seed);
  std::discrete_distribution<std::size_t> pick(areas.begin(), areas.end());
  std::uniform_real_distribution<double> unit(0, 1);
  SpreadSamples samples;
  while (samples.points_mm.size() < count) {
    const auto& t = mesh.triangles[pick(random)];
    const double r = std::sqrt(unit(random)), s = unit(random);
    const SurfacePoint on = surface.Closest((1 - r) * mesh.vertices_mm[t[0]] + r * (1 - s) * mesh.vertices_mm[t[1]] +
                                            r * s * mesh.vertices_mm[t[2]]);
    if (on.feature != SurfaceFeature::kFace || (wanted && !wanted(on))) continue;
    samples.points_mm.push_back(on.point_mm);
    samples.normals.push_back(on.normal);
  }
  return samples;
}

// A machine whose sensor and axes stand as they nominally should, so that sensor and zero coordinates agree at A = B = 0.
inline ScanPortion PortionAtZero(const Points& zero_mm) {
  ScanPortion portion;
  portion.id = "scan";
  portion.scan_point_count = static_cast<std::int64_t>(zero_mm.size());
  for (const Eigen::Vector3d& p : zero_mm)
    if (!portion.sensor.Add(p)) ++portion.out_of_reach_count;
  return portion;
}

inline Points Scanned(const Points& part_mm, const Eigen::Isometry3d& zero_from_part, double noise_mm,
                      std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0, 1);
  Points zero;
  for (const Eigen::Vector3d& p : part_mm) {
    const double x = noise(random), y = noise(random), z = noise(random);
    zero.push_back(zero_from_part * p + noise_mm * Eigen::Vector3d(x, y, z));
  }
  return zero;
}

inline PoseFit FitToBlade(const std::vector<ScanPortion>& portions, const FitOptions& options = {},
                          const Eigen::Isometry3d& start = StartPose(),
                          const MachineCalibration& calibration = MachineCalibration::Exact()) {
  auto fit = FitToSurface(*BladeSurface(), portions, start, calibration, options);
  EXPECT_TRUE(fit.ok()) << fit.status();
  return fit.ok() ? *fit : PoseFit();
}

// Greatest displacement between two poses over the part.
inline double GreatestDisplacement(const Surface& surface, const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  double greatest = 0;
  for (const Eigen::Vector3d& v : surface.mesh().vertices_mm) greatest = std::max(greatest, (a * v - b * v).norm());
  return greatest;
}

// Of a fit that converged; a test whose fit did not fails here (std::bad_optional_access).
inline const PlacedPose& Placed(const PoseFit& fit) { return fit.placed.value(); }

}  // namespace sixpoint::metrology
