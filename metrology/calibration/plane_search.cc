#include "metrology/calibration/plane_search.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>

namespace sixpoint::metrology {
namespace {

constexpr std::size_t kFewCount = 2500;
constexpr std::uint64_t kTrials = 500;
constexpr double kNeighbourMm = 8;  // a triple this close together mostly lies on one face
constexpr double kLeastShare = 1.0 / 30;

// splitmix64: random picks without any state.
std::uint64_t Mix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

// Least squares through the points within the band, from the plane given.
Plane Refined(const Points& points, const Plane& start, double band_mm) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  double count = 0;
  for (const Eigen::Vector3d& p : points) {
    if (std::abs(start.HeightOf(p)) > band_mm) continue;
    const Eigen::Vector3d q = p - start.point;
    sum += q;
    squares += q * q.transpose();
    count += 1;
  }
  if (count < 3) return start;
  const Eigen::Vector3d mean = sum / count;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(squares / count - mean * mean.transpose());
  Plane plane;
  plane.normal = eigen.eigenvectors().col(0);
  if (plane.normal.z() < 0) plane.normal = -plane.normal;
  plane.point = start.point + mean;
  return plane;
}

// The plane through three neighbours with the most points in its band; how many.
std::size_t Consensus(const Points& few, std::uint64_t stream, double band_mm, Plane* best) {
  std::uint64_t state = stream << 32;
  const auto pick = [&] { return few[Mix(++state) % few.size()]; };
  const auto pick_near = [&](const Eigen::Vector3d& a) {
    Eigen::Vector3d b = pick();
    for (int attempt = 0; attempt < 12 && (b - a).norm() > kNeighbourMm; ++attempt) b = pick();
    return b;
  };
  std::size_t most = 0;
  for (std::uint64_t trial = 0; trial < kTrials; ++trial) {
    const Eigen::Vector3d a = pick(), b = pick_near(a), c = pick_near(a), normal = (b - a).cross(c - a);
    if (normal.norm() < 1.0 || std::abs(normal.z()) < std::cos(M_PI / 6) * normal.norm()) continue;
    const Plane plane{normal.normalized() * (normal.z() < 0 ? -1 : 1), a};
    std::size_t count = 0;
    for (const Eigen::Vector3d& p : few) count += std::abs(plane.HeightOf(p)) < band_mm;
    if (count > most) {
      most = count;
      *best = plane;
    }
  }
  return most;
}

}  // namespace

Points EvenSample(const Points& points, std::size_t count) {
  const std::size_t stride = std::max<std::size_t>(1, points.size() / count);
  Points sample;
  sample.reserve(points.size() / stride + 1);
  for (std::size_t i = 0; i + stride <= points.size(); i += stride) sample.push_back(points[i + Mix(i) % stride]);
  return sample;
}

std::vector<Plane> FlatFaces(const Points& sample, double band_mm, std::size_t most) {
  Points few = EvenSample(sample, kFewCount);
  const auto least = static_cast<std::size_t>(kLeastShare * static_cast<double>(few.size()));
  std::vector<Plane> faces;
  while (faces.size() < most && few.size() > least) {
    Plane plane;
    if (Consensus(few, faces.size(), band_mm, &plane) < std::max<std::size_t>(least, 10)) break;
    plane = Refined(sample, plane, band_mm);
    plane = Refined(sample, plane, band_mm / 2);
    faces.push_back(plane);
    few.erase(std::remove_if(few.begin(), few.end(),
                             [&](const Eigen::Vector3d& p) { return std::abs(plane.HeightOf(p)) < 2 * band_mm; }),
              few.end());
  }
  return faces;
}

}  // namespace sixpoint::metrology
