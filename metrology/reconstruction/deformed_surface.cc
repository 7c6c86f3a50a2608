#include "metrology/reconstruction/deformed_surface.h"

#include <Eigen/LU>
#include <string>
#include <utility>

namespace sixpoint::metrology {

Eigen::Vector3d DeformedNormal(const Eigen::Matrix3d& jacobian, const Eigen::Vector3d& normal) {
  return (jacobian.inverse().transpose() * normal).normalized();
}

absl::StatusOr<std::shared_ptr<const Surface>> DeformedSurface(const Surface& design,
                                                               const FreeFormDeformation& deformation) {
  TriangleMesh mesh = design.mesh();
  std::vector<Eigen::Matrix3d> jacobians(mesh.vertices_mm.size(), Eigen::Matrix3d::Identity());
  std::vector<std::uint8_t> is_moved(mesh.vertices_mm.size(), 0);
  // A vertex that no triangle has may lie anywhere.
  for (const TriangleCorners& corners : mesh.triangles)
    for (const std::uint32_t v : corners) {
      if (is_moved[v] != 0) continue;
      const auto local = deformation.At("vertices_mm[" + std::to_string(v) + "]", mesh.vertices_mm[v]);
      if (!local.ok()) return local.status();
      mesh.vertices_mm[v] += local->displacement_mm;
      jacobians[v] = local->Jacobian();
      is_moved[v] = 1;
    }
  for (std::size_t t = 0; t < mesh.corner_normals.size(); ++t)
    for (std::size_t i = 0; i < 3; ++i) {
      Eigen::Vector3f& normal = mesh.corner_normals[t][i];
      normal = DeformedNormal(jacobians[mesh.triangles[t][i]], normal.cast<double>()).cast<float>();
    }
  return Surface::Prepare(std::move(mesh));
}

}  // namespace sixpoint::metrology
