// Twist and bow of sections whose places and angles are set.
#include "metrology/sections/span.h"

#include <gtest/gtest.h>

#include <cmath>

#include "metrology/sections/outlines.h"
#include "tests/metrology/sections/airfoils.h"

namespace sixpoint::metrology {
namespace {

using P = SectionParameter;

// Every 10 mm; each turned by 0.02 rad more than the last, and their places on a parabola.
std::vector<MeasuredSection> Sections(const std::optional<PoseCovariance>& pose) {
  std::vector<MeasuredSection> sections;
  std::mt19937_64 random(5);
  for (int i = 0; i < 5; ++i) {
    Blade blade;
    blade.stagger_rad += 0.02 * i;
    blade.place_mm = {0, 0};
    const Eigen::Vector2d middle = CamberPoint(blade, 0.5);
    blade.place_mm = Eigen::Vector2d(0.01 * i * (4 - i), 0) - middle;
    Points points = MeasuredOn(PolygonOf(blade, 0.02), {}, random);
    SectionPlane plane;
    plane.origin_mm.z() = 10 * i;
    for (Eigen::Vector3d& point : points) point.z() += 10 * i;
    const auto outline = MeasuredOutline(points, plane, {});
    UncertaintyOptions options;
    options.pose = pose;
    sections.push_back(*MeasureSection(*outline, options));
  }
  return sections;
}

TEST(Span, TwistIsTheTurnBetweenSections) {
  Matrix6d values = Matrix6d::Zero();
  values(2, 2) = 1e-6;  // 1 mrad about z: of all sections alike
  const auto sections = Sections(PoseCovariance(values, Eigen::Vector3d::Zero()));
  const auto twists = TwistOf(sections, {}, 0);
  ASSERT_TRUE(twists.ok()) << twists.status();
  for (std::size_t i = 0; i < 5; ++i) {
    const SpanValue& twist = (*twists)[i];
    ASSERT_TRUE(twist.value);
    EXPECT_NEAR(*twist.value, 0.02 * static_cast<double>(i), 4 * twist.standard + 1e-9);
    EXPECT_LT(twist.standard, 3e-4) << "the pose's turn takes itself off";
  }
  EXPECT_GT(sections[1].uncertainty(P::kStaggerNoseTail).standard, 9e-4);
  std::vector<SectionValues> nominal;
  for (const MeasuredSection& section : sections) nominal.push_back(section.values);
  const auto same = TwistOf(sections, nominal, 2);
  for (const SpanValue& twist : *same) EXPECT_EQ(*twist.value, 0);
}

TEST(Span, BowIsTheParabolaAcrossTheLineOfTheEnds) {
  const auto bows = BowOf(Sections(std::nullopt), {});
  ASSERT_TRUE(bows.ok()) << bows.status();
  // The greatest circle turns with its section about the camber line's middle, which it is not: only x's parabola is asked for, less that turn.
  for (std::size_t i = 0; i < 5; ++i) {
    const Bow& bow = (*bows)[i];
    ASSERT_TRUE(bow.x.value);
    const double at = static_cast<double>(i), wanted = 0.01 * at * (4 - at);
    EXPECT_NEAR(*bow.x.value, wanted, 4 * bow.x.standard + 0.006);
  }
}

TEST(Span, IsRefusedByName) {
  EXPECT_FALSE(TwistOf({}, {}, 0).ok());
  EXPECT_EQ(BowOf({}, {}).status().message(), "sections: 0, want at least 3");
  EXPECT_FALSE(TwistOf(std::vector<MeasuredSection>(2), std::vector<SectionValues>(3), 0).ok());
}

}  // namespace
}  // namespace sixpoint::metrology
