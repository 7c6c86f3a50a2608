#include "metrology/measuring_plan/surface_samples.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "metrology/frames/angles.h"
#include "tests/metrology/measuring_plan/plan_scenes.h"

namespace sixpoint::metrology {
namespace {

TEST(SurfaceSamples, AreAsManyAsAskedAndEachOfTheSameArea) {
  const TriangleMesh mesh = SphereMesh(10, 40);
  const SurfaceSamples sampled = SampleSurface(mesh, 10'000);
  EXPECT_NEAR(static_cast<double>(sampled.samples.size()), 10'000, 1);
  const double area_mm2 = SurfaceOf(mesh)->area_mm2();
  EXPECT_NEAR(sampled.area_mm2 * static_cast<double>(sampled.samples.size()), area_mm2, 1e-3 * area_mm2);
}

TEST(SurfaceSamples, LieOnTheirTriangles) {
  const TriangleMesh mesh = SphereMesh(10, 20);
  for (const SurfaceSample& sample : SampleSurface(mesh, 2000).samples) {
    const Eigen::Vector3d& corner = mesh.vertices_mm[mesh.triangles[sample.triangle][0]];
    EXPECT_NEAR(sample.normal.dot(sample.point_mm - corner), 0, 1e-12);
    EXPECT_GT(sample.normal.dot(sample.point_mm), 0);
  }
}

// Archimedes: the area of a sphere between two heights is in proportion to the heights.
TEST(SurfaceSamples, AreSpreadByArea) {
  for (const double height_mm : {-7.0, 0.0, 4.0, 9.0}) {
    const SurfaceSamples sampled = SampleSurface(SphereMesh(10, 120), 10'000);
    const auto above = std::count_if(sampled.samples.begin(), sampled.samples.end(),
                                     [&](const SurfaceSample& sample) { return sample.point_mm.z() > height_mm; });
    EXPECT_NEAR(static_cast<double>(above) / static_cast<double>(sampled.samples.size()), (10 - height_mm) / 20,
                kShare);
  }
}

TEST(SurfaceSamples, OfALargeTriangleCoverItEvenly) {
  const TriangleMesh mesh = SheetMesh(20, 20, 1);
  const SurfaceSamples sampled = SampleSurface(mesh, 10'000);
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) {
      const auto in = std::count_if(sampled.samples.begin(), sampled.samples.end(), [&](const SurfaceSample& sample) {
        return std::floor((sample.point_mm.x() + 10) / 5) == i && std::floor((sample.point_mm.y() + 10) / 5) == j;
      });
      EXPECT_NEAR(static_cast<double>(in) / 10'000, 1.0 / 16, kShare);
    }
}

TEST(SurfaceSamples, OfADiscAreItsAreaWhateverTheTriangles) {
  for (const int pieces : {1, 7, 60}) {
    const SurfaceDisc disc{{3, -2, 0}, Eigen::Vector3d::UnitZ(), 2};
    const SurfaceSamples sampled = SampleDisc(SheetMesh(40, 40, pieces), disc, 3000);
    for (const SurfaceSample& sample : sampled.samples) EXPECT_LE((sample.point_mm - disc.centre_mm).norm(), 2);
    // The rim goes between the places: some for each turn of it.
    EXPECT_NEAR(sampled.area_mm2 * static_cast<double>(sampled.samples.size()), 4 * kPi, 0.02 * 4 * kPi) << pieces;
  }
}

// A disc that holds the whole part: the side that looks its way.
TEST(SurfaceSamples, OfADiscGreaterThanThePartAreItsSide) {
  TriangleMesh box;
  AddBoxMesh({-10, -5, -2}, {10, 5, 0}, false, &box);
  const SurfaceSamples samples = SampleDisc(box, {{0, 0, 0}, Eigen::Vector3d::UnitZ(), 1000}, 300);
  ASSERT_GT(samples.samples.size(), 50u);
  EXPECT_NEAR(static_cast<double>(samples.samples.size()) * samples.area_mm2, 20 * 10, 2 * samples.area_mm2);
}

TEST(SurfaceSamples, OfADiscOnAThinPlateLeaveItsOtherSide) {
  TriangleMesh mesh;
  AddBoxMesh({-20, -20, -0.5}, {20, 20, 0}, false, &mesh);
  const SurfaceSamples sampled = SampleDisc(mesh, {{0, 0, 0}, Eigen::Vector3d::UnitZ(), 3}, 500);
  ASSERT_FALSE(sampled.samples.empty());
  for (const SurfaceSample& sample : sampled.samples) EXPECT_EQ(sample.point_mm.z(), 0);
}

// The line of sight's own search, against every triangle in turn.
TEST(SurfaceMeets, IsWhatEveryTriangleInTurnSays) {
  TriangleMesh mesh = SphereMesh(10, 12);
  AddBoxMesh({12, -4, -4}, {15, 4, 4}, false, &mesh);
  for (Eigen::Vector3d& vertex : mesh.vertices_mm)
    vertex += Eigen::Vector3d(3000, -2000, 500);  // far from the CAD's origin
  const auto surface = SurfaceOf(mesh);
  std::uint32_t state = 1;
  const auto uniform = [&] { return 40 * ((state = state * 1664525u + 1013904223u) / 4294967296.0) - 20; };
  int met = 0;
  for (int k = 0; k < 4000; ++k) {
    const Eigen::Vector3d from(3000 + uniform(), -2000 + uniform(), 500 + uniform());
    const Eigen::Vector3d to(3000 + uniform(), -2000 + uniform(), 500 + uniform());
    bool expected = false;
    for (const TriangleCorners& corners : mesh.triangles) {
      // By signed volumes: the line passes within all three edges, and its ends lie on different sides.
      const auto volume = [](const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Eigen::Vector3d& r,
                             const Eigen::Vector3d& s) { return (q - p).cross(r - p).dot(s - p) > 0; };
      const Eigen::Vector3d &a = mesh.vertices_mm[corners[0]], &b = mesh.vertices_mm[corners[1]],
                            &c = mesh.vertices_mm[corners[2]];
      const bool one = volume(from, to, a, b);
      expected = expected || (volume(a, b, c, from) != volume(a, b, c, to) && one == volume(from, to, b, c) &&
                              one == volume(from, to, c, a));
    }
    EXPECT_EQ(surface->Meets(from, to), expected) << k;
    met += expected ? 1 : 0;
  }
  EXPECT_GT(met, 500);
  EXPECT_LT(met, 3500);
}

}  // namespace
}  // namespace sixpoint::metrology
