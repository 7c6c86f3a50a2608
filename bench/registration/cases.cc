#include "bench/registration/cases.h"

#include <algorithm>
#include <cmath>

#include "metrology/frames/angles.h"

namespace sixpoint::bench {
namespace {

using Eigen::Vector3d;
using metrology::Matrix6d;

constexpr std::uint32_t kAround = 400, kAlong = 250;
using metrology::kRadPerDeg;
constexpr double kFacing = 0.35;  // least part of a normal towards the scanner

// Section of unit chord, trailing edge first: thickness and camber as the four-digit aerofoils have them.
std::vector<Eigen::Vector2d> Section() {
  constexpr double kCamber = 0.08, kCamberAt = 0.4, kThickness = 0.14;
  std::vector<Eigen::Vector2d> section;
  for (std::uint32_t j = 0; j < kAround; ++j) {
    const double u = 2 * M_PI * j / kAround;
    const double x = 0.5 * (1 + std::cos(u)), side = u <= M_PI ? 1 : -1;
    const double half =
        5 * kThickness *
        (0.2969 * std::sqrt(x) - 0.1260 * x - 0.3516 * x * x + 0.2843 * x * x * x - 0.1036 * x * x * x * x);
    const double p = kCamberAt;
    const double line = x < p ? kCamber / (p * p) * (2 * p * x - x * x)
                              : kCamber / ((1 - p) * (1 - p)) * ((1 - 2 * p) + 2 * p * x - x * x);
    const double slope =
        std::atan(x < p ? 2 * kCamber / (p * p) * (p - x) : 2 * kCamber / ((1 - p) * (1 - p)) * (p - x));
    section.emplace_back(x - side * half * std::sin(slope) - 0.45, line + side * half * std::cos(slope) - 0.04);
  }
  return section;
}

// A perturbation (w_r, w_t) about reference + by is (w_r, w_t + by x w_r) about reference.
Matrix6d Shift(const Vector3d& by_mm) {
  Matrix6d shift = Matrix6d::Identity();
  shift.bottomLeftCorner<3, 3>() = metrology::Skew(by_mm);
  return shift;
}

// w^T form w: mean square displacement of the vertices by a perturbation w of the pose.
Matrix6d MeanSquareForm(const Blade& blade, const Eigen::Isometry3d& pose, const Vector3d& reference_mm) {
  Matrix6d form = Matrix6d::Zero();
  for (const Vector3d& vertex : blade.mesh.vertices_mm) {
    const auto jacobian = metrology::PointJacobian(pose * vertex, reference_mm);
    form += jacobian.transpose() * jacobian;
  }
  return form / static_cast<double>(blade.mesh.vertices_mm.size());
}

}  // namespace

double Bump::At(const Vector3d& part_mm, const Vector3d& normal) const {
  if (normal.y() * side <= kFacing) return 0;
  const double dx = part_mm.x() - x_mm, dz = part_mm.z() - z_mm;
  return height_mm * std::exp(-(dx * dx + dz * dz) / (2 * sigma_mm * sigma_mm));
}

Blade TwistedBlade(double shape) {
  constexpr double kSpanMm = 80, kChordMm = 40;
  const std::vector<Eigen::Vector2d> section = Section();
  metrology::Points vertices;
  for (std::uint32_t i = 0; i <= kAlong; ++i) {
    const double v = static_cast<double>(i) / kAlong;
    const Eigen::Rotation2Dd twist((-12 + 30 * shape * v) * kRadPerDeg);
    for (const Eigen::Vector2d& point : section) {
      const Eigen::Vector2d at =
          twist * (kChordMm * (1 - 0.3 * shape * v) * point) + shape * Eigen::Vector2d(1.5 * v * v, v * v);
      vertices.emplace_back(at.x(), at.y(), kSpanMm * (v - 0.5));
    }
  }
  const std::uint32_t tip = kAlong * kAround, root_centre = tip + kAround, tip_centre = root_centre + 1;
  for (const std::uint32_t first : {0U, tip}) {
    Vector3d centre = Vector3d::Zero();
    for (std::uint32_t j = 0; j < kAround; ++j) centre += vertices[first + j];
    vertices.push_back(centre / kAround);
  }
  for (Vector3d& vertex : vertices) vertex = vertex.cast<float>().cast<double>();

  // In the generator's order: one half of every quadrangle, the other half, the root's fan, the tip's.
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (const bool second : {false, true})
    for (std::uint32_t i = 0; i < kAlong; ++i)
      for (std::uint32_t j = 0; j < kAround; ++j) {
        const std::uint32_t a = i * kAround + j, b = i * kAround + (j + 1) % kAround, c = a + kAround, d = b + kAround;
        triangles.push_back(second ? std::array{b, d, c} : std::array{a, b, c});
      }
  for (const bool at_tip : {false, true})
    for (std::uint32_t j = 0; j < kAround; ++j) {
      const std::uint32_t next = (j + 1) % kAround;
      triangles.push_back(at_tip ? std::array{tip_centre, tip + j, tip + next} : std::array{root_centre, next, j});
    }

  Blade blade;
  for (std::uint32_t i = 0; i <= kAlong; ++i) blade.trailing_edge.push_back(i * kAround);
  for (const auto& t : triangles) {
    const Vector3d cross = (vertices[t[1]] - vertices[t[0]]).cross(vertices[t[2]] - vertices[t[0]]);
    const double area = cross.norm() / 2;
    if (area <= 1e-9) continue;
    blade.mesh.triangles.push_back(t);
    blade.normals.push_back(cross / (2 * area));
    blade.areas_mm2.push_back(area);
  }
  blade.mesh.vertices_mm = std::move(vertices);
  blade.mesh.closed = true;
  return blade;
}

Eigen::Isometry3d ScanFromPart() {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() =
      (Eigen::AngleAxisd(0.9 * kRadPerDeg, Vector3d::UnitX()) *
       Eigen::AngleAxisd(-0.7 * kRadPerDeg, Vector3d::UnitY()) * Eigen::AngleAxisd(0.5 * kRadPerDeg, Vector3d::UnitZ()))
          .toRotationMatrix();
  pose.translation() << 0.6, -0.4, 0.3;
  return pose;
}

CaseSampler::CaseSampler(const Blade& blade, CaseKind kind, double noise_mm, const std::optional<Bump>& bump,
                         std::uint64_t seed)
    : blade_(blade), noise_mm_(noise_mm), bump_(bump), random_(seed) {
  double area = 0;
  for (std::uint32_t t = 0; t < blade.normals.size(); ++t) {
    const Vector3d& n = blade.normals[t];
    const bool seen = kind == CaseKind::kOneSide    ? n.y() > kFacing
                      : kind == CaseKind::kWellHeld ? std::abs(n.y()) > kFacing || n.z() > kFacing
                                                    : true;
    if (!seen) continue;
    triangles_.push_back(t);
    area_up_to_mm2_.push_back(area += blade.areas_mm2[t]);
  }
}

CaseSampler::OnSurface CaseSampler::NextOnSurface() {
  const auto found =
      std::upper_bound(area_up_to_mm2_.begin(), area_up_to_mm2_.end() - 1, NextUniform() * area_up_to_mm2_.back());
  const std::uint32_t t = triangles_[static_cast<std::size_t>(found - area_up_to_mm2_.begin())];
  const auto& corners = blade_.mesh.triangles[t];
  const double r = std::sqrt(NextUniform()), q = NextUniform();
  const Vector3d on = (1 - r) * blade_.mesh.vertices_mm[corners[0]] +
                      r * (1 - q) * blade_.mesh.vertices_mm[corners[1]] + r * q * blade_.mesh.vertices_mm[corners[2]];
  metrology::Vector6d row;
  row << on.cross(blade_.normals[t]), blade_.normals[t];
  information_.selfadjointView<Eigen::Lower>().rankUpdate(row);
  return {on, blade_.normals[t]};
}

Vector3d CaseSampler::NextScanned() {
  static const Eigen::Isometry3d scan_from_part = ScanFromPart();
  OnSurface on = NextOnSurface();
  if (bump_) on.part_mm += bump_->At(on.part_mm, on.normal) * on.normal;
  const double x = normal_(random_), y = normal_(random_), z = normal_(random_);
  return scan_from_part * (on.part_mm + noise_mm_ * Vector3d(x, y, z));
}

Matrix6d CaseSampler::Information(const Vector3d& reference_mm) const {
  const Eigen::Isometry3d scan_from_part = ScanFromPart();
  const Vector3d reference_part_mm = scan_from_part.inverse(Eigen::Isometry) * reference_mm;
  Matrix6d turn = Matrix6d::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = scan_from_part.linear();
  const Matrix6d about_origin = Matrix6d(information_.selfadjointView<Eigen::Lower>()) / (noise_mm_ * noise_mm_);
  const Matrix6d shift = Shift(reference_part_mm);
  return turn * (shift.transpose() * about_origin * shift) * turn.transpose();
}

CaseScan MakeScan(const Blade& blade, CaseKind kind, std::size_t count, double noise_mm,
                  const std::optional<Bump>& bump, std::uint64_t seed) {
  CaseSampler sampler(blade, kind, noise_mm, bump, seed);
  metrology::Points scan_mm;
  scan_mm.reserve(count);
  for (std::size_t i = 0; i < count; ++i) scan_mm.push_back(sampler.NextScanned());
  const Vector3d middle_mm = ScanFromPart().translation();  // the part's origin stands in its middle
  CaseScan scan{std::move(scan_mm), {sampler.Information(middle_mm).inverse(), middle_mm}};
  const Matrix6d squares = MeanSquareForm(blade, ScanFromPart(), scan.bound.reference_mm) * scan.bound.values;
  scan.vertex_bound_um = 1e3 * std::sqrt(squares.trace());
  scan.square_scatter = std::sqrt(2 * (squares * squares).trace()) / squares.trace();
  return scan;
}

double VertexDisplacementUm(const Blade& blade, const Eigen::Isometry3d& one, const Eigen::Isometry3d& other) {
  double squares = 0;
  for (const Vector3d& vertex : blade.mesh.vertices_mm) squares += (one * vertex - other * vertex).squaredNorm();
  return 1e3 * std::sqrt(squares / static_cast<double>(blade.mesh.vertices_mm.size()));
}

double VertexDisplacementUm(const Blade& blade, const Eigen::Isometry3d& pose,
                            const metrology::PoseCovariance& covariance) {
  return 1e3 * std::sqrt((MeanSquareForm(blade, pose, covariance.reference_mm) * covariance.values).trace());
}

metrology::PoseCovariance About(const metrology::PoseCovariance& covariance, const Vector3d& reference_mm) {
  const Matrix6d shift = Shift(covariance.reference_mm - reference_mm);
  return {shift * covariance.values * shift.transpose(), reference_mm};
}

metrology::Vector6d PoseError(const Eigen::Isometry3d& found, const Eigen::Isometry3d& truth,
                              const Vector3d& reference_mm) {
  metrology::Vector6d error;
  error << metrology::VectorFromRotation(found.linear() * truth.linear().transpose()),
      found * (truth.inverse(Eigen::Isometry) * reference_mm) - reference_mm;
  return error;
}

}  // namespace sixpoint::bench
