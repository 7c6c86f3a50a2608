#include "metrology/mesh/skin.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "metrology/mesh/volume.h"
#include "tests/metrology/mesh/square_tube.h"
#include "tests/metrology/mesh/tetrahedron.h"

namespace sixpoint::metrology {
namespace {

using ::testing::HasSubstr;

TEST(Skin, TurningOverChangesTheSignOnly) {
  TriangleMesh mesh = Tetrahedron();
  mesh.corner_normals.assign(4, {Eigen::Vector3f::UnitX(), Eigen::Vector3f::UnitY(), Eigen::Vector3f::UnitZ()});
  TurnOver(&mesh);
  EXPECT_TRUE(IsClosed(mesh));
  EXPECT_NEAR(SignedVolume(mesh), -1.0 / 6, 1e-12);
  EXPECT_EQ(mesh.corner_normals[0][1], -Eigen::Vector3f::UnitZ());  // the normal goes with its corner
}

TEST(Skin, AMissingOrTurnedTriangleOpensTheMesh) {
  TriangleMesh missing = Tetrahedron(), turned = Tetrahedron();
  missing.triangles.pop_back();
  std::swap(turned.triangles[0][0], turned.triangles[0][1]);
  EXPECT_FALSE(IsClosed(missing));
  EXPECT_FALSE(IsClosed(turned));
  EXPECT_FALSE(IsClosed(TriangleMesh{}));
}

TEST(Skin, NamesEdgesThatNoBoundaryOfABodyHas) {
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

TEST(Skin, CountsWhatKeepsASurfaceFromBeingWhole) {
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

}  // namespace
}  // namespace sixpoint::metrology
