// Sections of a cloud: where they lie, what they are of a known blade, and what is refused.
#include "metrology/repair/blade_sections.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "metrology/sections/profile.h"
#include "tests/metrology/repair/bent_blades.h"
#include "tests/metrology/repair/camber_check.h"

namespace sixpoint::metrology {
namespace {

StackOptions Options() {
  StackOptions options;
  options.heights = {0, 30, 40, 2};
  options.half_width_mm = 0.2;
  return options;
}

TEST(BladeSections, AreThoseOfTheBlade) {
  const SectionMotion motion = Bent(0.2, 0.003, 0);
  const auto measured = MeasureSections(KnownWall(-0.3, 30.3, 300000, 0.002, motion, 7), Options());
  ASSERT_TRUE(measured.ok()) << measured.status();
  ASSERT_EQ(measured->sections.size(), 16u);
  EXPECT_TRUE(measured->left_out.empty());
  for (const BladeSection& section : measured->sections) {
    double squares = 0;
    const auto polygon = KnownPolygon(section.z_mm, motion);
    for (const Eigen::Vector2d& point : polygon)
      squares += std::pow(SignedDistance(section.outline, point, nullptr), 2);
    // 2 um of noise, averaged over a window's points: a micrometre at most, but at the trailing end.
    EXPECT_LT(std::sqrt(squares / static_cast<double>(polygon.size())), 0.0015) << section.z_mm;
    EXPECT_LT(CheckCamber(section.profile, section.outline).line_mm, 5e-3);  // the goal; published 22 um
  }
}

TEST(BladeSections, AreTheSameOnAnyNumberOfThreads) {
  Points points = KnownWall(-0.3, 30.3, 300000, 0.002, nullptr, 9);
  StackOptions options = Options();
  const auto one = MeasureSections(points, options);
  options.thread_count = 4;
  std::reverse(points.begin(), points.end());
  const auto four = MeasureSections(points, options);
  ASSERT_TRUE(one.ok() && four.ok());
  ASSERT_EQ(one->sections.size(), four->sections.size());
  for (std::size_t k = 0; k < one->sections.size(); ++k)
    for (std::size_t i = 0; i < kCamberStations; ++i)
      EXPECT_EQ(one->sections[k].profile.stations[i].centre_mm, four->sections[k].profile.stations[i].centre_mm);
}

// Points of the named sections, whose trailing end lies to the right, without that end.
Points WithoutTrailingEnds(Points points, const std::vector<double>& z_mm) {
  for (const double at_mm : z_mm) {
    double furthest_mm = -1e9;
    for (const Eigen::Vector3d& point : points)
      if (std::abs(point.z() - at_mm) < 0.3) furthest_mm = std::max(furthest_mm, point.x());
    const auto unseen = [&](const Eigen::Vector3d& point) {
      return std::abs(point.z() - at_mm) < 0.3 && point.x() > furthest_mm - 1.5;
    };
    points.erase(std::remove_if(points.begin(), points.end(), unseen), points.end());
  }
  return points;
}

TEST(BladeSections, LeaveOutWhatWasNotSeen) {
  const Points points = KnownWall(-0.3, 30.3, 300000, 0.002, nullptr, 11);
  const auto measured = MeasureSections(WithoutTrailingEnds(points, {8, 30}), Options());
  ASSERT_TRUE(measured.ok()) << measured.status();
  EXPECT_EQ(measured->sections.size(), 14u);
  ASSERT_EQ(measured->left_out.size(), 2u);
  EXPECT_EQ(measured->left_out[0].index, 4u);
  EXPECT_EQ(measured->left_out[1].z_mm, 29.8);  // of 30, its slab below the line
  EXPECT_NE(measured->left_out[0].refusal.message().find("the trailing end was not seen"), std::string::npos)
      << measured->left_out[0].refusal;
  // 26 mm is no longer two thirds of the way to 40 mm; and eleven sections are too few.
  for (const std::vector<double>& unseen : {std::vector<double>{28, 30}, std::vector<double>{4, 8, 12, 16, 20}}) {
    const auto refused = MeasureSections(WithoutTrailingEnds(points, unseen), Options());
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.status().message().rfind("sections: ", 0), 0u) << refused.status();
    EXPECT_NE(refused.status().message().find(".outline: the trailing end was not seen"), std::string::npos);
  }
}

TEST(BladeSections, HeightsEndBelowTheLine) {
  const SectionHeights heights{0, 30.5, 40, 2};
  EXPECT_EQ(MeasuredHeights(heights, 0.5).back(), 30);
  EXPECT_EQ(MeasuredHeights(heights, 1).back(), 29.5);  // all of its slab lies below the line
  EXPECT_EQ(MeasuredHeights(heights, 1).size(), 16u);
}

TEST(BladeSections, RefusesByName) {
  const auto refused = [](const SectionHeights& heights, const std::string& field) {
    const absl::Status status = CheckHeights(heights);
    EXPECT_NE(status.message().find(field + ": "), std::string::npos) << status;
  };
  refused({0, 26, 40, 1}, "heights.cutoff_mm");  // below two thirds
  refused({0, 40, 40, 1}, "heights.cutoff_mm");  // nothing to extrapolate
  refused({0, 30, -1, 1}, "heights.target_mm");
  refused({0, 30, 40, 3}, "heights.line_width_mm");  // 11 sections
  refused({0, 30, std::numeric_limits<double>::quiet_NaN(), 1}, "heights");
  EXPECT_TRUE(CheckHeights({0, 27, 40, 1}).ok());
  StackOptions options = Options();
  options.half_width_mm = 1.5;
  EXPECT_NE(MeasureSections({}, options).status().message().find("half_width_mm"), std::string::npos);
  // A cylinder's sections are closed, and no airfoils.
  Points round;
  for (int i = 0; i < 60000; ++i) round.emplace_back(5 * std::cos(i * 0.7), 5 * std::sin(i * 0.7), i * 5e-4);
  const auto measured = MeasureSections(round, Options());
  ASSERT_FALSE(measured.ok());
  EXPECT_NE(measured.status().message().find("sections[3].outline: no circle touches two sides"), std::string::npos)
      << measured.status();
}

}  // namespace
}  // namespace sixpoint::metrology
