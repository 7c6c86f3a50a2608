// Without OpenCASCADE: an octant of a sphere and a cylinder's half, by their formulas.
#include "metrology/cad/refinement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "metrology/frames/angles.h"
#include "metrology/mesh/mesh_bytes.h"
#include "metrology/mesh/volume.h"
#include "metrology/mesh/weld.h"

namespace sixpoint::metrology {
namespace {

using ::testing::HasSubstr;

constexpr double kRadiusMm = 10, kHeightMm = 30;

// Two half cylinders (faces 0 and 1; u: angle, v: height) that meet along two straight lines and are open at the ends.
class TwoHalves : public ShapeGeometry {
 public:
  explicit TwoHalves(double gap_mm = 0) : gap_mm_(gap_mm) {}
  Eigen::Vector3d FacePoint(std::uint16_t, const Eigen::Vector2d& uv) const override {
    return {kRadiusMm * std::cos(uv.x()), kRadiusMm * std::sin(uv.x()), uv.y()};
  }
  Eigen::Vector3d FaceNormal(std::uint16_t, const Eigen::Vector2d& uv) const override {
    return {std::cos(uv.x()), std::sin(uv.x()), 0};
  }
  // Curve 0 at angle 0, curve 1 at angle pi; each `gap` outside the faces.
  Eigen::Vector3d CurvePoint(std::uint32_t curve, double parameter) const override {
    return {(curve == 0 ? 1 : -1) * (kRadiusMm + gap_mm_), 0, parameter};
  }
  // 0, 1: curves 0 and 1 on face 0; 2, 3: on face 1, where the angle runs from pi to 2 pi.
  Eigen::Vector2d CurveUv(std::uint32_t curve_on_face, double parameter) const override {
    const double angles[4] = {0, kPi, 2 * kPi, kPi};
    return {angles[curve_on_face], parameter};
  }

 private:
  double gap_mm_;
};

// Each half as two triangles a third of the angle wide, thrice.
CoarseMesh CoarseHalves(const TwoHalves& shape) {
  CoarseMesh mesh;
  Points points;
  for (std::uint16_t face = 0; face < 2; ++face) {
    const auto first = static_cast<std::uint32_t>(mesh.nodes.size());
    for (int i = 0; i <= 3; ++i) {
      for (const double v : {0.0, kHeightMm}) {
        const Eigen::Vector2d uv(kPi * (face + i / 3.0), v);
        const bool on_curve = i == 0 || i == 3;
        const std::uint32_t curve = (face == 0) == (i == 0) ? 0 : 1;
        points.push_back(on_curve ? shape.CurvePoint(curve, v) : shape.FacePoint(face, uv));
        mesh.nodes.push_back({static_cast<std::uint32_t>(points.size() - 1), face, uv, -1});
      }
    }
    for (std::uint32_t i = 0; i < 3; ++i) {
      const std::uint32_t low = first + 2 * i, high = low + 1;
      mesh.triangles.push_back({low, low + 2, high + 2});
      mesh.triangles.push_back({low, high + 2, high});
    }
    const std::uint32_t curve_at_start = face == 0 ? 0 : 1, curve_at_end = 1 - curve_at_start;
    mesh.borders.push_back({{first, first + 1}, curve_at_start, face == 0 ? 0u : 3u});
    mesh.borders.push_back({{first + 6, first + 7}, curve_at_end, face == 0 ? 1u : 2u});
  }
  mesh.chords = {{0, 0.0, kHeightMm}, {1, 0.0, kHeightMm}};
  const std::vector<std::uint32_t> welded = Weld(1e-9, &points);
  for (CoarseMesh::Node& node : mesh.nodes) node.vertex = welded[node.vertex];
  mesh.vertices_mm = points;
  return mesh;
}

RefinementOptions Within(double chordal_error_mm) {
  RefinementOptions options;
  options.chordal_error_mm = chordal_error_mm;
  return options;
}

TEST(Refinement, BringsATubeWithinTheAskedErrorAndKeepsItWhole) {
  const TwoHalves shape;
  const RefinementOptions options = Within(1e-3);
  const auto mesh = Refine(CoarseHalves(shape), shape, options);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_LE(mesh->chordal_error_um, 1.0);
  EXPECT_GT(mesh->chordal_error_um, 0.2);  // not finer than needed by more than a halving of every edge
  // The inscribed tube is short of the cylinder by less than the error over its whole side.
  const double volume = kPi * kRadiusMm * kRadiusMm * kHeightMm, side = 2 * kPi * kRadiusMm * kHeightMm;
  EXPECT_LT(SignedVolume(*mesh), volume);
  EXPECT_GT(SignedVolume(*mesh), volume - 1e-3 * side);
  // No cracks along the seams: the only open edges are those of the two ends.
  std::size_t end_edges = 0;
  for (const auto& triangle : mesh->triangles) {
    for (int c = 0; c < 3; ++c) {
      const double z[2] = {mesh->vertices_mm[triangle[c]].z(), mesh->vertices_mm[triangle[(c + 1) % 3]].z()};
      end_edges += z[0] == z[1] && (z[0] == 0 || z[0] == kHeightMm);
    }
  }
  // Euler: V - E + F = 0 for a tube, with E = (3 F + open) / 2.
  const auto v = static_cast<double>(mesh->vertices_mm.size()), f = static_cast<double>(mesh->triangles.size());
  EXPECT_EQ(v - (3 * f + static_cast<double>(end_edges)) / 2 + f, 0);
}

TEST(Refinement, NormalsAreThoseOfTheSurfaceAndEveryFacetFacesOut) {
  const TwoHalves shape;
  const auto mesh = Refine(CoarseHalves(shape), shape, Within(4e-3));
  ASSERT_TRUE(mesh.ok());
  for (std::size_t i = 0; i < mesh->triangles.size(); ++i) {
    const auto& [a, b, c] = mesh->triangles[i];
    const Eigen::Vector3d& corner = mesh->vertices_mm[a];
    const Eigen::Vector3d outward(corner.x() / kRadiusMm, corner.y() / kRadiusMm, 0);
    ASSERT_LT((mesh->corner_normals[i][0].cast<double>() - outward).norm(), 1e-6);
    const Eigen::Vector3d facet = (mesh->vertices_mm[b] - corner).cross(mesh->vertices_mm[c] - corner).normalized();
    ASSERT_GT(facet.dot(outward), 0.95);
  }
}

TEST(Refinement, EqualInputsGiveEqualBytes) {
  const TwoHalves shape;
  const auto first = Refine(CoarseHalves(shape), shape, Within(4e-3)),
             second = Refine(CoarseHalves(shape), shape, Within(4e-3));
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_EQ(MeshBytes(*first), MeshBytes(*second));
}

TEST(Refinement, EdgesOffTheirFacesArePutOntoThemAndToldAndWideOnesRefused) {
  const RefinementOptions options = Within(1e-3);
  for (const double off_mm : {5e-3, 50e-3}) {
    const TwoHalves shape(off_mm);
    const auto mesh = Refine(CoarseHalves(shape), shape, options);
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    EXPECT_LE(mesh->chordal_error_um, 1.0);
    // Told from 10 um on.
    EXPECT_NEAR(mesh->healed_mm, off_mm > 10e-3 ? off_mm : 0, 1e-12);
    EXPECT_TRUE(mesh->face_gaps_mm.empty());
  }
  const TwoHalves wide(0.12);
  const auto refused = Refine(CoarseHalves(wide), wide, options);
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(refused.status().message()), HasSubstr("cad.faces: an edge 0.12 mm off its face at (10.12"));
}

TEST(Refinement, StopsAtTheTriangleLimit) {
  const TwoHalves shape;
  RefinementOptions options;
  options.greatest_triangle_count = 100;
  EXPECT_EQ(Refine(CoarseHalves(shape), shape, options).status().code(), absl::StatusCode::kResourceExhausted);
}

}  // namespace
}  // namespace sixpoint::metrology
