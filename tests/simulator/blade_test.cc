#include "simulator/blade.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "metrology/frames/angles.h"
#include "metrology/kinematics/rotary_axes.h"
#include "metrology/mesh/skin.h"
#include "metrology/mesh/volume.h"

namespace sixpoint::simulator {
namespace {

using Eigen::Vector3d;
using metrology::kRadPerDeg;
const Vector3d kCentre(26.6, 54.9, -193.3);

const DesignedPart& Part() {
  static const DesignedPart part = DesignPart({}, kCentre);
  return part;
}

TEST(Airfoil, MeshIsClosedWithPositiveVolume) {
  EXPECT_TRUE(metrology::IsClosed(Part().mesh));
  // Half thickness sin(turn) (F0 + (F1 - F0) u) over the chord is an area of pi/4 chord (F0 + F1), chord and F being
  // linear in z and sqrt(z): integrated over the span by the middle rule. Camber changes it in second order only.
  const AirfoilDesign& d = Part().airfoil;
  double expected = 0;
  for (int i = 0; i < 100; ++i) {
    const double chord = d.root_chord_mm + (d.tip_chord_mm - d.root_chord_mm) * (i + 0.5) / 100;
    const double f = std::sqrt(d.leading_edge_radius_mm * chord / 2) + std::sqrt(d.trailing_edge_radius_mm * chord / 2);
    expected += d.span_mm / 100 * 3.14159265358979 / 4 * chord * f;
  }
  EXPECT_NEAR(metrology::SignedVolume(Part().mesh) / expected, 1, 0.1);
}

TEST(Airfoil, NormalsPointOutwardsAndAreSmooth) {
  const Airfoil airfoil({});
  for (int turn_deg = 0; turn_deg < 360; turn_deg += 2) {
    const Vector3d here = airfoil.Normal(turn_deg * kRadPerDeg, 20),
                   next = airfoil.Normal((turn_deg + 2) * kRadPerDeg, 20);
    EXPECT_GT(here.dot(next), std::cos(15 * kRadPerDeg)) << turn_deg;
  }
  EXPECT_GT(airfoil.Normal(90 * kRadPerDeg, 20).y(), 0.8);
  EXPECT_LT(airfoil.Normal(270 * kRadPerDeg, 20).y(), -0.8);
}

TEST(DesignPart, NestIsWellConditioned) {
  ASSERT_EQ(Part().six_points.size(), 6u);
  EXPECT_EQ(Part().six_points[5].normal, Vector3d::UnitZ());
  EXPECT_GT(NestConditioning(Part().six_points), 0.2);
}

TEST(DesignPart, NominalAnglesPutEveryGroupAlongMachineZ) {
  metrology::RotaryAxes axes;
  axes.a.point_mm = axes.b.point_mm = kCentre;
  ASSERT_EQ(Part().hole_groups.size(), 3u);
  for (const DesignedHoleGroup& group : Part().hole_groups) {
    const Eigen::Isometry3d machine_from_zero =
        axes.MachineFromZero(group.a_nominal_deg * kRadPerDeg, group.b_nominal_deg * kRadPerDeg);
    const Vector3d along = machine_from_zero.linear() * Part().zero_from_part_nominal.linear() * group.axis;
    EXPECT_NEAR((along - Vector3d::UnitZ()).norm(), 0, 1e-12);
    EXPECT_LT(std::abs(group.a_nominal_deg), 30);
    for (const DesignedHole& hole : group.holes) EXPECT_GT(hole.normal.dot(group.axis), 0.6);
  }
}

TEST(Cast, LeavesTheDatumPointsAndStaysWithinItsBound) {
  const metrology::TriangleMesh cast = Cast(Part(), 0.3, 5);
  double greatest = 0;
  for (std::size_t i = 0; i < cast.vertices_mm.size(); ++i) {
    const double moved = (cast.vertices_mm[i] - Part().mesh.vertices_mm[i]).norm();
    greatest = std::max(greatest, moved);
    for (const DesignedDatum& datum : Part().six_points)
      if ((Part().mesh.vertices_mm[i] - datum.point_mm).norm() < 2.4) {
        EXPECT_EQ(moved, 0);
      }
  }
  EXPECT_NEAR(greatest, 0.3, 1e-5);
  EXPECT_TRUE(metrology::IsClosed(cast));
}

TEST(BinaryStl, CarriesTheVerticesExactly) {
  const metrology::TriangleMesh& mesh = Part().mesh;
  const std::string bytes = BinaryStl(mesh);
  ASSERT_EQ(bytes.size(), 84 + 50 * mesh.triangles.size());
  for (std::size_t i : {std::size_t{0}, mesh.triangles.size() / 2, mesh.triangles.size() - 1}) {
    for (int corner = 0; corner < 3; ++corner) {
      float xyz[3];
      std::memcpy(xyz, bytes.data() + 84 + 50 * i + 12 * (corner + 1), 12);
      const Vector3d& vertex = mesh.vertices_mm[mesh.triangles[i][corner]];
      EXPECT_EQ(Vector3d(xyz[0], xyz[1], xyz[2]), vertex);
    }
  }
}

}  // namespace
}  // namespace sixpoint::simulator
