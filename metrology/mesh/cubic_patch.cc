#include "metrology/mesh/cubic_patch.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

constexpr double kLeastNormalAgreement = 0.2;
constexpr double kGreatestHeightRatio = 0.1;  // of the patch's height to the triangle's longest edge

void Put(const Vector3d& vector, double (&numbers)[3]) { std::copy_n(vector.data(), 3, numbers); }

}  // namespace

std::optional<CubicPatch> CubicPatch::Over(const std::array<Vector3d, 3>& corners_mm,
                                           const std::array<Vector3d, 3>& normals) {
  CubicPatch patch;
  PatchNumbers<double>& numbers = patch.numbers_;
  const Vector3d edge_1_mm = corners_mm[1] - corners_mm[0], edge_2_mm = corners_mm[2] - corners_mm[0];
  const Vector3d twice_area = edge_1_mm.cross(edge_2_mm), unit_normal = twice_area.normalized();
  const double inverse = 1 / twice_area.squaredNorm();
  Put(corners_mm[0], numbers.corner_mm);
  Put(edge_1_mm, numbers.edge_1_mm);
  Put(edge_2_mm, numbers.edge_2_mm);
  Put(unit_normal, numbers.unit_normal);
  Put(inverse * edge_2_mm.cross(twice_area), numbers.dual_1);
  Put(inverse * twice_area.cross(edge_1_mm), numbers.dual_2);
  const double longest = std::sqrt(
      std::max({edge_1_mm.squaredNorm(), edge_2_mm.squaredNorm(), (corners_mm[2] - corners_mm[1]).squaredNorm()}));
  double sum = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3;
    const Vector3d edge = corners_mm[j] - corners_mm[i];
    const double up_i = normals[i].dot(unit_normal), up_j = normals[j].dot(unit_normal);
    if (!(up_i > kLeastNormalAgreement && up_j > kLeastNormalAgreement)) return std::nullopt;
    numbers.height_mm[2 * i] = -normals[i].dot(edge) / (3 * up_i);
    numbers.height_mm[2 * i + 1] = normals[j].dot(edge) / (3 * up_j);
    for (const std::size_t k : {2 * i, 2 * i + 1}) {
      if (!(std::abs(numbers.height_mm[k]) <= kGreatestHeightRatio * longest)) return std::nullopt;
      sum += numbers.height_mm[k];
    }
  }
  numbers.height_mm[6] = sum / 4;  // reproduces every quadratic
  return patch;
}

}  // namespace sixpoint::metrology
