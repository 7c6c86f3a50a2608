// Patches of clouds beside what made them.
#include "metrology/reconstruction/blank_patch.h"

#include <gtest/gtest.h>

#include <cmath>

#include "refusal/refusal.h"
#include "tests/metrology/reconstruction/blank_worlds.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;

struct World {
  std::shared_ptr<const Surface> surface = sixpoint::testing::LensBlade({18, 5, 24}, 90);
  Points points_mm, outward;
};

// Off by a slope of 20 um a millimetre, 2 um of noise.
double Off(const Vector3d& place_mm) { return 0.3 + 0.02 * place_mm.z(); }

World Make(int each) {
  World world;
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0, 2e-3);
  std::uniform_real_distribution<double> unit(-0.3, 0.3);
  const absl::StatusOr<DesignPlaces> design = SampleDesign(world.surface, 0.5, 2);
  for (const DesignPlace& place : design->places)
    for (int k = 0; k < each; ++k) {
      const SurfacePoint on =
          world.surface->Closest(place.point_mm + Vector3d(unit(random), unit(random), unit(random)));
      world.points_mm.push_back(on.point_mm + (Off(on.point_mm) + noise(random)) * on.normal);
      world.outward.push_back(on.normal);
    }
  return world;
}

TEST(GatherBlank, PatchesStandWhereTheBlankDoes) {
  const World world = Make(20);
  const auto patches = SurfacePatches::Make(*world.surface, 1);
  const auto gathered = GatherBlank(*world.surface, *patches, world.points_mm, world.outward, {});
  ASSERT_TRUE(gathered.ok()) << gathered.status();
  EXPECT_GT(gathered->size(), patches->patches().size() * 9 / 10);
  int beyond = 0;
  double squares = 0;
  for (const BlankPatch& patch : *gathered) {
    const SurfacePoint on = world.surface->Closest(patch.point_mm);
    const double error_mm = on.signed_distance_mm - Off(on.point_mm);
    beyond += std::abs(error_mm) > 3 * patch.standard_uncertainty_mm;
    squares += std::pow(error_mm / patch.standard_uncertainty_mm, 2);
    EXPECT_LT(patch.standard_uncertainty_mm, 3e-3);  // of a plane through eight points, at its rim
  }
  // The slope is in no uncertainty; 3 sigma are left by 0.3 % of normal ones, whose sigma is estimated from some tens of points.
  EXPECT_LT(beyond, 0.02 * static_cast<double>(gathered->size()));
  // A patch of eight points has five degrees of freedom, Student's variance of 5 / 3.
  const double spread = std::sqrt(squares / static_cast<double>(gathered->size()));
  EXPECT_GT(spread, 0.9);
  EXPECT_LT(spread, std::sqrt(5.0 / 3));
}

TEST(GatherBlank, SameBitsOnAnyNumberOfThreads) {
  const World world = Make(4);
  const auto patches = SurfacePatches::Make(*world.surface, 1);
  const auto one = GatherBlank(*world.surface, *patches, world.points_mm, world.outward, {1, 1.5, 8});
  const auto other = GatherBlank(*world.surface, *patches, world.points_mm, world.outward, {3, 1.5, 8});
  ASSERT_EQ(one->size(), other->size());
  for (std::size_t i = 0; i < one->size(); ++i) EXPECT_TRUE((*one)[i].point_mm == (*other)[i].point_mm);
}

TEST(GatherBlank, RefusesByName) {
  const World world = Make(1);
  const auto patches = SurfacePatches::Make(*world.surface, 1);
  const auto field = [&](const Points& points_mm, const Points& outward) {
    return ViolationsOf(GatherBlank(*world.surface, *patches, points_mm, outward, {}).status()).at(0).field;
  };
  EXPECT_EQ(field(world.points_mm, {}), "outward");
  EXPECT_EQ(field({Vector3d(NAN, 0, 0)}, {Vector3d::UnitX()}), "points_mm");
}

}  // namespace
}  // namespace sixpoint::metrology
