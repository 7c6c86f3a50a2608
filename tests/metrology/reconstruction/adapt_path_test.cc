// Tool paths that go with a surface: rigid where the deformation is, at the tool's radius from the shape everywhere, the template's own beyond the strip.
#include "metrology/reconstruction/adapt_path.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "refusal/refusal.h"
#include "tests/metrology/reconstruction/blank_worlds.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

const DesignPlaces& PathDesign() {
  static const DesignPlaces kDesign = *SampleDesign(sixpoint::testing::LensBlade({18, 5, 24}, 140), 0.5, 2);
  return kDesign;
}

// The upper half is machined.
std::vector<ShapeRegion> UpperHalfMachined() {
  std::vector<ShapeRegion> regions(2);
  regions[0].where.minimum_mm = Vector3d(-100, -100, 0);
  regions[1].kind = RegionKind::kFixed;
  regions[1].rest = true;
  return regions;
}

template <typename Function>
FreeFormDeformation Deformed(const Function& function) {
  const ControlLattice lattice{Vector3d(-24, -12, -30), Vector3d(4, 4, 4), {12, 6, 15}};
  ControlDisplacements controls_mm(3, static_cast<Eigen::Index>(lattice.control_count()));
  for (int x = 0; x < lattice.Controls(0); ++x)
    for (int y = 0; y < lattice.Controls(1); ++y)
      for (int z = 0; z < lattice.Controls(2); ++z)
        controls_mm.col(static_cast<Eigen::Index>(lattice.ControlIndex(x, y, z))) =
            function(lattice.corner_mm + 4 * Vector3d(x - 1, y - 1, z - 1));
  return *FreeFormDeformation::Make(lattice, controls_mm);
}

// A ball of 3 mm that touches the surface, its axis 30 deg off the normal.
std::vector<ToolPoint> Path(double least_z_mm, double most_z_mm) {
  std::vector<ToolPoint> path;
  for (const DesignPlace& place : PathDesign().places) {
    if (place.point_mm.z() < least_z_mm || place.point_mm.z() > most_z_mm) continue;
    const Vector3d aside = place.normal.unitOrthogonal();
    path.push_back(
        {place.point_mm + 3 * place.normal, (std::cos(0.5) * place.normal + std::sin(0.5) * aside).normalized()});
  }
  return path;
}

TEST(AdaptPath, GoesRigidlyWithARigidMotion) {
  const Matrix3d turn = Eigen::AngleAxisd(0.02, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  const Vector3d shift(0.1, -0.2, 0.3);
  const FreeFormDeformation deformation = Deformed([&](const Vector3d& p) -> Vector3d { return turn * p + shift - p; });
  const auto path = Path(1, 20);
  const auto adapted = AdaptPath(PathDesign(), UpperHalfMachined(), deformation, path, 5);
  ASSERT_TRUE(adapted.ok()) << adapted.status();
  for (std::size_t i = 0; i < path.size(); ++i) {
    EXPECT_EQ((*adapted)[i].part, 1);
    EXPECT_LT(((*adapted)[i].tool.centre_mm - turn * path[i].centre_mm - shift).norm(), 1e-9);
    EXPECT_LT(((*adapted)[i].tool.axis - turn * path[i].axis).norm(), 1e-9);
  }
}

// Stretch and shear would leave a centre that is merely displaced off the surface; one that goes with its contact stays a radius away.
TEST(AdaptPath, TheBallStillTouchesTheShape) {
  const FreeFormDeformation deformation = Deformed(
      [](const Vector3d& p) { return Vector3d(0.4 * std::sin(p.z() / 8), 0.5 * std::sin(p.x() / 7), 0.02 * p.y()); });
  const auto shape = sixpoint::testing::MovedSurface(*PathDesign().surface, deformation);
  const auto path = Path(1, 20);
  const auto adapted = AdaptPath(PathDesign(), UpperHalfMachined(), deformation, path, 5);
  ASSERT_TRUE(adapted.ok()) << adapted.status();
  double worst_mm = 0, merely_mm = 0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    worst_mm = std::max(worst_mm, std::abs(shape->Closest((*adapted)[i].tool.centre_mm).signed_distance_mm - 3));
    const auto moved = deformation.DisplacementAt(path[i].centre_mm);
    if (moved)
      merely_mm = std::max(merely_mm, std::abs(shape->Closest(path[i].centre_mm + *moved).signed_distance_mm - 3));
    EXPECT_NEAR((*adapted)[i].tool.axis.norm(), 1, 1e-12);
  }
  EXPECT_LT(worst_mm, 6e-3);  // of the two meshes: with 60 steps it was 29 um
  EXPECT_GT(merely_mm, 0.02);
}

TEST(AdaptPath, GoesBackToTheTemplateOverTheStrip) {
  const FreeFormDeformation deformation = Deformed([](const Vector3d&) { return Vector3d(0, 0.5, 0); });
  const auto path = Path(-20, -0.5);
  const auto adapted = AdaptPath(PathDesign(), UpperHalfMachined(), deformation, path, 5);
  ASSERT_TRUE(adapted.ok()) << adapted.status();
  int within = 0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const double moved_mm = ((*adapted)[i].tool.centre_mm - path[i].centre_mm).norm();
    EXPECT_NEAR(moved_mm, 0.5 * (*adapted)[i].part, 1e-9);
    if (path[i].centre_mm.z() < -8) {
      EXPECT_EQ((*adapted)[i].part, 0);
    }
    within += (*adapted)[i].part > 0 && (*adapted)[i].part < 1;
  }
  EXPECT_GT(within, 50);
}

TEST(AdaptPath, RefusesByName) {
  const FreeFormDeformation deformation = Deformed([](const Vector3d&) { return Vector3d(0, 0, 0); });
  const auto field = [&](std::vector<ToolPoint> path, double strip_mm, const FreeFormDeformation& by) {
    const auto adapted = AdaptPath(PathDesign(), UpperHalfMachined(), by, path, strip_mm);
    return adapted.ok() ? std::string() : ViolationsOf(adapted.status()).at(0).field;
  };
  const ToolPoint good{Vector3d(0, 8, 5), Vector3d::UnitY()};
  EXPECT_EQ(field({good}, 5, deformation), "");
  EXPECT_EQ(field({good, {Vector3d(NAN, 0, 0), Vector3d::UnitY()}}, 5, deformation), "template[1]");
  EXPECT_EQ(field({{Vector3d(0, 8, 5), Vector3d(0, 2, 0)}}, 5, deformation), "template[0]");
  EXPECT_EQ(field({good}, 0, deformation), "strip_mm");
  const auto elsewhere = FreeFormDeformation::Still({Vector3d(100, 0, 0), Vector3d::Ones(), {2, 2, 2}});
  EXPECT_EQ(field({good}, 5, *elsewhere), "template[0]");
}

}  // namespace
}  // namespace sixpoint::metrology
