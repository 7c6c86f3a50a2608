#include "metrology/surface/mesh_topology.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/metrology/surface/tetrahedron.h"

namespace sixpoint::metrology {
namespace {

using ::testing::HasSubstr;

// An open tube of square section, 2 x 2 x 3 mm, far from its origin; seen from outside.
TriangleMesh SquareTube() {
  TriangleMesh mesh;
  const Eigen::Vector3d origin(6350, -20, 320);
  const double xy[4][2] = {{0, 0}, {2, 0}, {2, 2}, {0, 2}};
  for (const double z : {0.0, 3.0})
    for (const auto& corner : xy) mesh.vertices_mm.push_back(origin + Eigen::Vector3d(corner[0], corner[1], z));
  for (std::uint32_t i = 0; i < 4; ++i) {
    const std::uint32_t next = (i + 1) % 4;
    mesh.triangles.push_back({i, next, next + 4});
    mesh.triangles.push_back({i, next + 4, i + 4});
  }
  return mesh;
}

TEST(MeshTopology, ATetrahedronIsClosedAndHasItsVolume) {
  for (const Eigen::Vector3d& origin : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(6350, -20, 320)}) {
    const TriangleMesh mesh = Tetrahedron(origin);
    EXPECT_TRUE(IsClosed(mesh));
    EXPECT_NEAR(SignedVolume(mesh), 1.0 / 6, 1e-12);
  }
}

TEST(MeshTopology, TurningOverChangesTheSignOnly) {
  TriangleMesh mesh = Tetrahedron();
  mesh.corner_normals.assign(4, {Eigen::Vector3f::UnitX(), Eigen::Vector3f::UnitY(), Eigen::Vector3f::UnitZ()});
  TurnOver(&mesh);
  EXPECT_TRUE(IsClosed(mesh));
  EXPECT_NEAR(SignedVolume(mesh), -1.0 / 6, 1e-12);
  EXPECT_EQ(mesh.corner_normals[0][1], -Eigen::Vector3f::UnitZ());  // the normal goes with its corner
}

TEST(MeshTopology, AMissingOrTurnedTriangleOpensTheMesh) {
  TriangleMesh missing = Tetrahedron(), turned = Tetrahedron();
  missing.triangles.pop_back();
  std::swap(turned.triangles[0][0], turned.triangles[0][1]);
  EXPECT_FALSE(IsClosed(missing));
  EXPECT_FALSE(IsClosed(turned));
  EXPECT_FALSE(IsClosed(TriangleMesh{}));
}

TEST(MeshTopology, NamesEdgesThatNoBoundaryOfABodyHas) {
  EXPECT_TRUE(CheckOneSided(Tetrahedron()).ok());
  EXPECT_TRUE(CheckOneSided(SquareTube()).ok()) << "open ends are allowed";
  TriangleMesh fin = Tetrahedron(), turned = Tetrahedron();
  fin.vertices_mm.emplace_back(0, -1, -1);
  fin.triangles.push_back({0, 1, 4});  // a third triangle along the edge from the corner to x = 1
  std::swap(turned.triangles[0][0], turned.triangles[0][1]);
  EXPECT_THAT(std::string(CheckOneSided(fin).message()),
              HasSubstr("mesh.edges: 1 with more than two triangles, the first at (0.5, 0, 0) mm"));
  EXPECT_THAT(std::string(CheckOneSided(turned).message()),
              HasSubstr("mesh.edges: 3 between triangles turned against"));
}

TEST(MeshTopology, CountsWhatKeepsASurfaceFromBeingWhole) {
  const MeshGaps whole = GapsOf(Tetrahedron()), tube = GapsOf(SquareTube());
  EXPECT_EQ(whole.degenerate_triangle_count, 0);
  EXPECT_EQ(whole.open_rim_count, 0);
  EXPECT_EQ(whole.open_rim_length_mm, 0);
  EXPECT_EQ(tube.open_rim_count, 2);  // its ends
  EXPECT_NEAR(tube.open_rim_length_mm, 16, 1e-9);
  TriangleMesh lidded = SquareTube();
  lidded.triangles.push_back({4, 5, 6});  // half a lid; and a triangle in a line along an edge
  lidded.vertices_mm.push_back((lidded.vertices_mm[0] + lidded.vertices_mm[1]) / 2);
  lidded.triangles.push_back({0, 1, 8});
  const MeshGaps half = GapsOf(lidded);
  EXPECT_EQ(half.degenerate_triangle_count, 1);
  EXPECT_EQ(half.open_rim_count, 2);
  EXPECT_NEAR(half.open_rim_length_mm, 8 + 4 + 2 * std::sqrt(2.0), 1e-9);
  // Two triangles away that meet in a corner: one rim.
  TriangleMesh holes = SquareTube();
  holes.triangles = {holes.triangles.begin() + 1, holes.triangles.end() - 1};
  EXPECT_EQ(GapsOf(holes).open_rim_count, 1);
  EXPECT_EQ(GapsOf(TriangleMesh{}).open_rim_count, 0);
}

TEST(MeshTopology, AnOpenTubeHasTheVolumeBetweenItsEnds) {
  TriangleMesh mesh = SquareTube();
  EXPECT_FALSE(IsClosed(mesh));
  EXPECT_NEAR(SignedVolume(mesh), 12, 1e-9);
  TurnOver(&mesh);
  EXPECT_NEAR(SignedVolume(mesh), -12, 1e-9);
}

TEST(MeshTopology, WeldKeepsOrderAndJoinsWithinTheTolerance) {
  Points points{{1, 0, 0}, {0, 0, 0}, {1 + 0.9e-3, 0, 0}, {0, -0.0, 0}, {1.0025, 0, 0}};
  Points exact = points;
  EXPECT_EQ(Weld(1e-3, &points), (std::vector<std::uint32_t>{0, 1, 0, 1, 2}));
  EXPECT_EQ(points.size(), 3u);
  EXPECT_EQ(Weld(0, &exact), (std::vector<std::uint32_t>{0, 1, 2, 1, 3}));
}

}  // namespace
}  // namespace sixpoint::metrology
