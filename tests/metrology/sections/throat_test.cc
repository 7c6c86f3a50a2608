// The passage between two sections.
#include "metrology/sections/throat.h"

#include <gtest/gtest.h>

#include <cmath>

#include "metrology/sections/outlines.h"
#include "tests/metrology/sections/airfoils.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector2d;

TEST(Throat, IsTheLeastDistanceOfBruteForce) {
  const std::vector<Vector2d> polygon = PolygonOf({}, 0.02);
  const auto outline = LoopOutline(polygon);
  ASSERT_TRUE(outline.ok());
  const Outline& curve = outline->fitted.outline;
  for (const double pitch_mm : {12.0, 20.0}) {
    const Eigen::Isometry2d pitch = Eigen::Translation2d(0, pitch_mm) * Eigen::Isometry2d(Eigen::Rotation2Dd(0.05));
    double least = INFINITY;
    for (const Vector2d& p : polygon)
      for (const Vector2d& q : polygon) least = std::min(least, (p - pitch * q).norm());
    const auto throat = ThroatOf(curve, curve, pitch);
    ASSERT_TRUE(throat.ok()) << throat.status();
    EXPECT_NEAR(throat->width_mm, least, 2e-4);  // the polygon's chords
    EXPECT_LE(throat->width_mm, least + 1e-6);
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
