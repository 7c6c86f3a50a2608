#include "metrology/mesh/volume.h"

#include <gtest/gtest.h>

#include <cmath>

#include "metrology/mesh/skin.h"
#include "tests/metrology/mesh/square_tube.h"
#include "tests/metrology/mesh/tetrahedron.h"

namespace sixpoint::metrology {
namespace {

TEST(Volume, ATetrahedronIsClosedAndHasItsVolume) {
  for (const Eigen::Vector3d& origin : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(6350, -20, 320)}) {
    const TriangleMesh mesh = Tetrahedron(origin);
    EXPECT_TRUE(IsClosed(mesh));
    EXPECT_NEAR(SignedVolume(mesh), 1.0 / 6, 1e-12);
  }
}

TEST(Volume, AnOpenTubeHasTheVolumeBetweenItsEnds) {
  TriangleMesh mesh = SquareTube();
  EXPECT_FALSE(IsClosed(mesh));
  EXPECT_NEAR(SignedVolume(mesh), 12, 1e-9);
  TurnOver(&mesh);
  EXPECT_NEAR(SignedVolume(mesh), -12, 1e-9);
}

TEST(Volume, OfAClosedMeshIsTheSameAboutAnyPointNearby) {
  const TriangleMesh mesh = Tetrahedron(Eigen::Vector3d(6350, -20, 320));
  for (const Eigen::Vector3d& about_mm : {mesh.vertices_mm[0], Eigen::Vector3d(6350.3, -19, 321)})
    EXPECT_NEAR(SignedVolumeOfClosed(mesh.vertices_mm, mesh.triangles, about_mm), 1.0 / 6, 1e-12);
}

TEST(Volume, NoTrianglesEncloseNothing) {
  EXPECT_EQ(SignedVolume(TriangleMesh{}), 0);
  EXPECT_TRUE(BoundsOf(TriangleMesh{}).isEmpty());
}

TEST(Volume, MomentsOfASquareTubeAreThoseOfItsWalls) {
  const TriangleMesh tube = SquareTube();  // 2 x 2 x 3
  const SurfaceMoments moments = MomentsOf(tube.vertices_mm, tube.triangles);
  const Eigen::AlignedBox3d bounds_mm = BoundsOf(tube);
  EXPECT_NEAR(moments.area_mm2, 24, 1e-9);
  EXPECT_LT((moments.centroid_mm - bounds_mm.center()).norm(), 1e-9);
  // Each wall lies 1 off the axis, and has 2^2 / 12 across and 3^2 / 12 along it.
  EXPECT_NEAR(moments.radius_of_gyration_mm, std::sqrt(1 + 4. / 12 + 9. / 12), 1e-5);
}

}  // namespace
}  // namespace sixpoint::metrology
