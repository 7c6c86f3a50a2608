// Lattices beside closed forms: what cubic splines reproduce, refinement, derivatives, and what lies outside.
#include "metrology/reconstruction/free_form_deformation.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// CAD stands metres from its origin.
ControlLattice FarLattice() { return {Vector3d(6300, -20, 330), Vector3d(4, 5, 6), {7, 5, 6}}; }

Vector3d PlaceOf(const ControlLattice& lattice, int x, int y, int z) {
  return lattice.corner_mm + lattice.spacing_mm.cwiseProduct(Vector3d(x - 1, y - 1, z - 1));
}

// Controls of any function of where they stand.
template <typename Function>
ControlDisplacements Controls(const ControlLattice& lattice, const Function& function) {
  ControlDisplacements controls_mm(3, static_cast<Eigen::Index>(lattice.control_count()));
  for (int x = 0; x < lattice.Controls(0); ++x)
    for (int y = 0; y < lattice.Controls(1); ++y)
      for (int z = 0; z < lattice.Controls(2); ++z)
        controls_mm.col(static_cast<Eigen::Index>(lattice.ControlIndex(x, y, z))) = function(PlaceOf(lattice, x, y, z));
  return controls_mm;
}

FreeFormDeformation Random(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> any(0, 0.5);
  return *FreeFormDeformation::Make(FarLattice(), Controls(FarLattice(), [&](const Vector3d&) {
                                      return Vector3d(any(random), any(random), any(random));
                                    }));
}

std::vector<Vector3d> Places(int count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<Vector3d> places;
  for (int i = 0; i < count; ++i)
    places.emplace_back(FarLattice().corner_mm +
                        Vector3d(28, 25, 36).cwiseProduct(Vector3d(unit(random), unit(random), unit(random))));
  return places;
}

// Splines add up to 1 and have linear precision: an affine map of the controls is that of the points.
TEST(FreeFormDeformation, ReproducesAnAffineDisplacement) {
  Matrix3d a;
  a << 0.01, -0.02, 0.003, 0.004, 0.005, -0.006, 0.02, 0.001, -0.01;
  const auto affine = [&](const Vector3d& p) -> Vector3d {
    return Vector3d(0.1, -0.2, 0.3) + a * (p - FarLattice().corner_mm);
  };
  const auto made = FreeFormDeformation::Make(FarLattice(), Controls(FarLattice(), affine));
  ASSERT_TRUE(made.ok()) << made.status();
  for (const Vector3d& place : Places(500, 1)) {
    const auto local = made->LocalAt(place);
    ASSERT_TRUE(local.has_value());
    EXPECT_LT((local->displacement_mm - affine(place)).norm(), 1e-12);  // coordinates of 6300 mm have steps of 1e-12
    EXPECT_LT((local->gradient - a).norm(), 1e-12);
  }
}

// Of a quadratic the controls are off by a constant, which is known: h^2 / 6 times its second derivative.
TEST(FreeFormDeformation, ReproducesAQuadraticDisplacement) {
  const auto quadratic = [](const Vector3d& p) {
    const Vector3d q = p - FarLattice().corner_mm;
    return Vector3d(0.01 * q.x() * q.x(), 0.02 * q.x() * q.y(), -0.005 * q.z() * q.z());
  };
  const auto made = FreeFormDeformation::Make(FarLattice(), Controls(FarLattice(), [&](const Vector3d& p) -> Vector3d {
                                                return quadratic(p) - Vector3d(0.02 * 16, 0, -0.01 * 36) / 6;
                                              }));
  for (const Vector3d& place : Places(500, 2))
    EXPECT_LT((*made->DisplacementAt(place) - quadratic(place)).norm(), 1e-11);
}

TEST(FreeFormDeformation, RefinedIsTheSame) {
  FreeFormDeformation fine = Random(3);
  const FreeFormDeformation coarse = fine;
  for (int level = 0; level < 2; ++level) {
    fine = fine.Refined();
    for (const Vector3d& place : Places(500, 4)) {
      const auto one = coarse.LocalAt(place), other = fine.LocalAt(place);
      EXPECT_LT((one->displacement_mm - other->displacement_mm).norm(), 1e-12);
      EXPECT_LT((one->gradient - other->gradient).norm(), 1e-11);
    }
  }
  EXPECT_EQ(fine.lattice().cells[0], 28);
}

TEST(FreeFormDeformation, GradientIsThatOfDifferences) {
  const FreeFormDeformation deformation = Random(5);
  const double step_mm = 1e-4;
  for (const Vector3d& place : Places(300, 6)) {
    const auto local = deformation.LocalAt(place);
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d step = step_mm * Vector3d::Unit(axis);
      const auto ahead = deformation.DisplacementAt(place + step), behind = deformation.DisplacementAt(place - step);
      if (!ahead || !behind) continue;
      // The difference is off by a sixth of step^2 times the third derivative, and by 1e-12 / step of rounding.
      EXPECT_LT(((*ahead - *behind) / (2 * step_mm) - local->gradient.col(axis)).norm(), 2e-8);
    }
  }
}

// Value, slope and bend from the left and from the right of where two cells meet; the third derivative jumps.
TEST(FreeFormDeformation, IsTwiceContinuouslyDifferentiable) {
  EXPECT_EQ(SplineValues(1)[3], 1.0 / 6);
  for (const auto& function : {SplineValues, SplineSlopes, SplineBends}) {
    const auto end = function(1), begin = function(0);
    EXPECT_NEAR(end[0], 0, 1e-15);
    EXPECT_NEAR(begin[3], 0, 1e-15);
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(end[k + 1], begin[k], 1e-15);
  }
}

TEST(FreeFormDeformation, RefusesWhatItDoesNotCover) {
  std::vector<std::uint8_t> covered(FarLattice().cell_count(), 1);
  covered[FarLattice().CellIndex(2, 2, 2)] = 0;
  const auto made = FreeFormDeformation::Still(FarLattice(), covered);
  ASSERT_TRUE(made.ok()) << made.status();
  const Vector3d in_the_gap = FarLattice().corner_mm + Vector3d(10, 12.5, 15);
  EXPECT_FALSE(made->WeightsAt(in_the_gap));
  EXPECT_TRUE(made->WeightsAt(in_the_gap + Vector3d(4, 0, 0)));
  EXPECT_TRUE(made->WeightsAt(FarLattice().corner_mm));
  EXPECT_TRUE(made->WeightsAt(FarLattice().corner_mm + Vector3d(28, 25, 36)));
  EXPECT_FALSE(made->WeightsAt(FarLattice().corner_mm - Vector3d(1e-3, 0, 0)));
  EXPECT_FALSE(made->WeightsAt(Vector3d(NAN, 0, 0)));
  EXPECT_FALSE(made->Refined().WeightsAt(in_the_gap));
  const auto refused = made->At("template.points[3]", in_the_gap);
  const auto violations = ViolationsOf(refused.status());
  ASSERT_EQ(violations.size(), 1u);
  EXPECT_EQ(violations[0].field, "template.points[3]");
  EXPECT_NE(violations[0].value.find("outside the lattice"), std::string::npos);
}

TEST(FreeFormDeformation, RefusesBadLattices) {
  const auto refused = [](const ControlLattice& lattice, ControlDisplacements controls_mm) {
    const auto made = FreeFormDeformation::Make(lattice, std::move(controls_mm));
    return made.ok() ? std::string() : ViolationsOf(made.status()).at(0).field;
  };
  const ControlDisplacements some = ControlDisplacements::Zero(3, 64);
  EXPECT_EQ(refused({}, some), "");
  EXPECT_EQ(refused({Vector3d(NAN, 0, 0), Vector3d::Ones(), {1, 1, 1}}, some), "lattice.corner_mm");
  EXPECT_EQ(refused({Vector3d::Zero(), Vector3d(1, 0, 1), {1, 1, 1}}, some), "lattice.spacing_mm");
  EXPECT_EQ(refused({Vector3d::Zero(), Vector3d::Ones(), {1, 0, 1}}, some), "lattice.cells");
  EXPECT_EQ(refused({Vector3d::Zero(), Vector3d::Ones(), {1000, 1000, 1000}}, some), "lattice.cells");
  EXPECT_EQ(refused({Vector3d::Zero(), Vector3d::Ones(), {2, 1, 1}}, some), "controls_mm");
  EXPECT_EQ(refused({}, ControlDisplacements::Constant(3, 64, NAN)), "controls_mm");
  EXPECT_FALSE(FreeFormDeformation::Make({}, some, {1, 1}).ok());
}

}  // namespace
}  // namespace sixpoint::metrology
