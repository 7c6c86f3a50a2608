// The passage between two sections.
#include "metrology/sections/throat.h"

#include <gtest/gtest.h>

#include <cmath>

#include "metrology/sections/outlines.h"
#include "tests/metrology/sections/airfoils.h"
#include "tests/metrology/sections/loop_outline.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector2d;

TEST(Throat, IsTheLeastDistanceOfBruteForce) {
  const std::vector<Vector2d> polygon = PolygonOf({}, 0.02);
  const auto outline = LoopOutline(polygon);
  ASSERT_TRUE(outline.ok());
  const Outline& curve = outline->fitted.outline;
  std::vector<Vector2d> dense;
  for (std::size_t i = 0; i < curve.size(); ++i)
    for (int k = 0; k < 20; ++k) dense.push_back(curve.PointAt({i, k / 20.0}));
  const auto least_of = [](const std::vector<Vector2d>& points, const Eigen::Isometry2d& pitch) {
    double least = INFINITY;
    for (const Vector2d& q : points) {
      const Vector2d moved = pitch * q;
      for (const Vector2d& p : points) least = std::min(least, (p - moved).squaredNorm());
    }
    return std::sqrt(least);
  };
  for (const double pitch_mm : {12.0, 20.0}) {
    const Eigen::Isometry2d pitch = Eigen::Translation2d(0, pitch_mm) * Eigen::Isometry2d(Eigen::Rotation2Dd(0.05));
    const auto throat = ThroatOf(curve, curve, pitch);
    ASSERT_TRUE(throat.ok()) << throat.status();
    // Of the curves themselves: their points are 0.03 mm apart, and so too far by 0.02^2 / (2 * 5 mm) at most.
    const double least_mm = least_of(dense, pitch);
    EXPECT_LE(throat->width_mm, least_mm + 1e-6);
    EXPECT_GE(throat->width_mm, least_mm - 5e-5);
    // Of the polygon, from which a curve is 0.55 um off where its curvature jumps.
    EXPECT_NEAR(throat->width_mm, least_of(polygon, pitch), 1.1e-3);
    EXPECT_FALSE(throat->beside_gap);
  }
}

TEST(Throat, IsRefusedWhereBladesMeet) {
  const auto outline = LoopOutline(PolygonOf({}, 0.05));
  const Outline& curve = outline->fitted.outline;
  const auto throat = ThroatOf(curve, curve, Eigen::Isometry2d(Eigen::Translation2d(0, 1)));
  EXPECT_EQ(throat.status().message(), "pitch: outlines that meet, want a passage between them");
}

TEST(Throat, AddsBothSidesToItsUncertainty) {
  std::mt19937_64 random(3);
  const auto measured = MeasuredOutline(MeasuredOn(PolygonOf({}, 0.02), {}, random), {}, {});
  ASSERT_TRUE(measured.ok()) << measured.status();
  const FittedOutline& fitted = measured->fitted;
  const auto throat = ThroatOf(fitted.outline, fitted.outline, Eigen::Isometry2d(Eigen::Translation2d(0, 20)));
  ASSERT_TRUE(throat.ok());
  FormError form;
  form.sigma_mm = 0.003;
  const double u = ThroatStandardUncertainty(*throat, fitted, form, fitted, form, 0.004);
  // The noise of means is a tenth of these.
  EXPECT_NEAR(u, std::sqrt(2 * 9.0 + 16) * 1e-3, 2e-4);
}

}  // namespace
}  // namespace sixpoint::metrology
