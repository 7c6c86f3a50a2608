#include "metrology/mesh/cubic_patch.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

constexpr double kLeastNormalAgreement = 0.2;
constexpr double kGreatestHeightRatio = 0.1;  // of the patch's height to the triangle's longest edge

}  // namespace

std::optional<CubicPatch> CubicPatch::Over(const std::array<Vector3d, 3>& corners_mm,
                                           const std::array<Vector3d, 3>& normals) {
  CubicPatch patch;
  patch.corner_mm_ = corners_mm[0];
  patch.edge_1_mm_ = corners_mm[1] - corners_mm[0];
  patch.edge_2_mm_ = corners_mm[2] - corners_mm[0];
  const Vector3d twice_area = patch.edge_1_mm_.cross(patch.edge_2_mm_);
  patch.unit_normal_ = twice_area.normalized();
  const double inverse = 1 / twice_area.squaredNorm();
  patch.dual_1_ = inverse * patch.edge_2_mm_.cross(twice_area);
  patch.dual_2_ = inverse * twice_area.cross(patch.edge_1_mm_);
  const double longest = std::sqrt(std::max(
      {patch.edge_1_mm_.squaredNorm(), patch.edge_2_mm_.squaredNorm(), (corners_mm[2] - corners_mm[1]).squaredNorm()}));
  double sum = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3;
    const Vector3d edge = corners_mm[j] - corners_mm[i];
    const double up_i = normals[i].dot(patch.unit_normal_), up_j = normals[j].dot(patch.unit_normal_);
    if (!(up_i > kLeastNormalAgreement && up_j > kLeastNormalAgreement)) return std::nullopt;
    patch.height_mm_[2 * i] = -normals[i].dot(edge) / (3 * up_i);
    patch.height_mm_[2 * i + 1] = normals[j].dot(edge) / (3 * up_j);
    for (const std::size_t k : {2 * i, 2 * i + 1}) {
      if (!(std::abs(patch.height_mm_[k]) <= kGreatestHeightRatio * longest)) return std::nullopt;
      sum += patch.height_mm_[k];
    }
  }
  patch.height_mm_[6] = sum / 4;  // reproduces every quadratic
  return patch;
}

double CubicPatch::Height(const Vector3d& b, double* slope_1, double* slope_2) const {
  const double b0 = b[0], b1 = b[1], b2 = b[2];
  const auto& h = height_mm_;
  const double d0 =
      3 * (2 * b0 * b1 * h[0] + b1 * b1 * h[1] + b2 * b2 * h[4] + 2 * b0 * b2 * h[5] + 2 * b1 * b2 * h[6]);
  const double d1 =
      3 * (b0 * b0 * h[0] + 2 * b0 * b1 * h[1] + 2 * b1 * b2 * h[2] + b2 * b2 * h[3] + 2 * b0 * b2 * h[6]);
  const double d2 =
      3 * (b1 * b1 * h[2] + 2 * b1 * b2 * h[3] + 2 * b2 * b0 * h[4] + b0 * b0 * h[5] + 2 * b0 * b1 * h[6]);
  *slope_1 = d1 - d0;
  *slope_2 = d2 - d0;
  return 3 * (b0 * b0 * b1 * h[0] + b0 * b1 * b1 * h[1] + b1 * b1 * b2 * h[2] + b1 * b2 * b2 * h[3] +
              b2 * b2 * b0 * h[4] + b2 * b0 * b0 * h[5] + 2 * b0 * b1 * b2 * h[6]);
}

}  // namespace sixpoint::metrology
