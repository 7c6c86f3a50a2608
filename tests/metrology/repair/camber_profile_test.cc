// Camber lines beside their definition, and beside airfoils whose camber line is known.
#include "metrology/repair/camber_profile.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/metrology/repair/camber_check.h"
#include "tests/metrology/sections/airfoils.h"
#include "tests/metrology/sections/loop_outline.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector2d;

TEST(CamberProfile, OfKnownAirfoilsLiesOnTheirArcs) {
  std::mt19937_64 random(3);
  for (int i = 0; i < 6; ++i) {
    const Blade blade = RandomBlade(random);
    const Outline outline = ChebyshevOutline(LoopOutline(PolygonOf(blade, 0.02))->fitted.outline);
    const auto profile = ProfileOf(outline, {}, CamberMethod::kBisected);
    ASSERT_TRUE(profile.ok()) << profile.status();
    ASSERT_EQ(profile->stations.size(), kCamberStations);
    // Each centre on the known line: beside the nearest of many of its points. The polygon's chords are off by 0.02^2 / 8 / 0.3 mm = 0.2 um.
    for (std::size_t j = 5; j + 5 < profile->stations.size();
         ++j) {  // the ends' circles are circles of no width: their arcs are chords
      const CamberStation& station = profile->stations[j];
      double nearest_mm = 1e9, radius_mm = 0;
      for (int k = 0; k <= 20000; ++k) {
        const double off = (CamberPoint(blade, k / 20000.0) - station.centre_mm).norm();
        if (off < nearest_mm) nearest_mm = off, radius_mm = HalfThickness(blade, k / 20000.0);
      }
      EXPECT_LT(nearest_mm, 2e-3);
      EXPECT_NEAR(station.radius_mm, radius_mm, 2e-3);
    }
  }
}

TEST(CamberProfile, BisectedIsAsFarFromBothSides) {
  std::mt19937_64 random(5);
  for (int i = 0; i < 10; ++i) {
    Blade blade = RandomBlade(random);
    if (i % 2 == 1) blade.leading = BladeEnd::kEllipse, blade.flat_laws = true;
    const Outline outline = ChebyshevOutline(LoopOutline(PolygonOf(blade, 0.02))->fitted.outline);
    const auto published = ProfileOf(outline, {}, CamberMethod::kPublished);
    const auto bisected = ProfileOf(outline, {}, CamberMethod::kBisected);
    ASSERT_TRUE(published.ok() && bisected.ok());
    const CamberCheck before = CheckCamber(*published, outline), after = CheckCamber(*bisected, outline);
    EXPECT_LT(before.line_mm, 0.022);  // published
    EXPECT_LT(after.line_mm, 1e-4);    // of what is solved to 1e-7
    EXPECT_LT(after.leading_extension_mm, 0.005);
    EXPECT_LT(after.trailing_extension_mm, 0.005);
  }
}

// Waves of some micrometres along the outline, as a worn section has them: about a blunt end's centre the way turns more than places before it tell.
TEST(CamberProfile, ToAWornEndTheWayStaysInTheMiddle) {
  std::mt19937_64 random(11);
  double worst_mm = 0;
  for (int i = 0; i < 30; ++i) {
    Blade blade = RandomBlade(random);
    if (i % 2 == 1) blade.leading = BladeEnd::kEllipse, blade.flat_laws = true;
    const auto form_mm = FourierForm(0.03, 20, 60, random);
    auto polygon = PolygonOf(blade, 0.02);
    const auto plain = polygon;
    const auto count = plain.size();
    std::vector<double> along_mm = {0};
    for (std::size_t k = 0; k < count; ++k)
      along_mm.push_back(along_mm.back() + (plain[(k + 1) % count] - plain[k]).norm());
    for (std::size_t k = 0; k < count; ++k) {
      const Vector2d way = plain[(k + 1) % count] - plain[(k + count - 1) % count];
      polygon[k] += form_mm(along_mm[k] / along_mm.back()) * Vector2d(way.y(), -way.x()).normalized();
    }
    const Outline outline = ChebyshevOutline(LoopOutline(polygon)->fitted.outline);
    const auto profile = ProfileOf(outline, {}, CamberMethod::kBisected);
    ASSERT_TRUE(profile.ok()) << profile.status();
    const CamberCheck check = CheckCamber(*profile, outline);
    worst_mm = std::max({worst_mm, check.leading_extension_mm, check.trailing_extension_mm});
  }
  EXPECT_LT(worst_mm, 0.005);
}

TEST(CamberProfile, PointsAreDenseAtTheEnds) {
  const Outline outline = ChebyshevOutline(LoopOutline(PolygonOf(Blade(), 0.02))->fitted.outline);
  EXPECT_NEAR(static_cast<double>(outline.size()), static_cast<double>(kOutlinePoints), 4);
  const std::vector<double> places = ChebyshevPlaces(11);
  EXPECT_EQ(places.front(), 0);
  EXPECT_EQ(places.back(), 1);
  EXPECT_NEAR(places[5], 0.5, 1e-15);
  EXPECT_NEAR(places[1], (1 - std::cos(3.14159265358979 / 10)) / 2, 1e-12);
}

TEST(CamberProfile, RefusesWhatIsNoAirfoil) {
  std::vector<Vector2d> circle;
  for (int i = 0; i < 200; ++i) circle.emplace_back(5 * std::cos(i * 0.031416), 5 * std::sin(i * 0.031416));
  const auto profile = ProfileOf(LoopOutline(circle)->fitted.outline, {}, CamberMethod::kBisected);
  ASSERT_FALSE(profile.ok());
  EXPECT_NE(profile.status().message().find("outline: "), std::string::npos) << profile.status();
  EXPECT_NE(profile.status().message().find("want a closed airfoil"), std::string::npos);
}

}  // namespace
}  // namespace sixpoint::metrology
