// Paths around a known blade: where the ball stands, what it keeps clear of, and what is refused.
#include "metrology/milling/recontour_path.h"

#include <gtest/gtest.h>

#include <cmath>

#include "metrology/sections/profile.h"
#include "tests/metrology/repair/bent_blades.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// The blade itself above 30 mm; offset_mm: the target lies so much inside it.
std::vector<TargetSection> TargetOf(double offset_mm) {
  std::vector<TargetSection> target;
  for (const double z_mm : PassHeights(30, 32, 0.4)) {
    const Outline outline = KnownSection(z_mm, nullptr).outline;
    const std::vector<double> offsets(outline.size(), -offset_mm), slopes(outline.size(), 0);
    target.push_back({z_mm, outline.Offset(offsets, slopes), std::vector<double>(outline.size(), 1e-3)});
  }
  return target;
}

GuardedSurface Guard(double margin_mm) {
  std::vector<BladeSection> below;
  for (const double z_mm : {27.0, 28.0, 29.0, 30.0}) below.push_back(KnownSection(z_mm, nullptr));
  return GuardBelow(below, TargetOf(0).front(), Vector2d::Zero(), 2, margin_mm);
}

TEST(RecontourPath, BallTouchesTheTargetAndNothingElse) {
  PathOptions options;
  options.mill.radius_mm = 2;
  const auto target = TargetOf(0);
  const auto path = PlanPath(target, Vector2d::Zero(), 0, {}, options, 1);
  ASSERT_TRUE(path.ok()) << path.status();
  EXPECT_EQ(path->roughing_layers, 0u);
  ASSERT_EQ(path->passes.size(), target.size());
  EXPECT_EQ(path->passes.front().z_mm, 32);  // from the tip down
  for (const RecontourPass& pass : path->passes)
    for (const ToolPlace& place : pass.places) {
      EXPECT_NEAR((place.centre_mm - place.contact_mm).norm(), 2 + place.lifted_mm, 1e-9);
      EXPECT_NEAR(place.axis.norm(), 1, 1e-12);
      for (const TargetSection& section : target)
        if (section.z_mm == pass.z_mm) {
          const double clear_mm = SignedDistance(section.outline, place.centre_mm.head<2>(), nullptr);
          // In the plane of a wall that leans a ball's circle is smaller; never does it cut more than what is tolerated.
          EXPECT_GT(clear_mm, std::sqrt(4 - std::pow(place.centre_mm.z() - pass.z_mm, 2)) - 1e-3);
        }
    }
}

TEST(RecontourPath, KeepsClearOfWhatLiesBelowTheLine) {
  PathOptions options;
  options.mill.radius_mm = 2;
  const GuardedSurface guard = Guard(0.002);
  // A target 20 um inside the blade: a ball at the line would cut what lies below it.
  const auto path = PlanPath(TargetOf(0.02), Vector2d::Zero(), 0.3, guard, options, 1);
  ASSERT_TRUE(path.ok()) << path.status();
  double lifted_mm = 0;
  for (const RecontourPass& pass : path->passes)
    for (const ToolPlace& place : pass.places) {
      lifted_mm = std::max(lifted_mm, place.lifted_mm);
      for (const Vector3d& point : guard.points_mm) ASSERT_GT((point - place.centre_mm).norm(), 2.002 - 1e-9);
    }
  EXPECT_GT(lifted_mm, 0.015);
}

TEST(RecontourPath, KeepsClearByAWideMargin) {
  PathOptions options;
  options.mill.radius_mm = 2;
  GuardedSurface guard = Guard(0.4);  // more than any place is off
  const auto path = PlanPath(TargetOf(0), Vector2d::Zero(), 0, guard, options, 1);
  ASSERT_TRUE(path.ok()) << path.status();
  for (const RecontourPass& pass : path->passes)
    for (const ToolPlace& place : pass.places)
      for (const Vector3d& point : guard.points_mm) ASSERT_GT((point - place.centre_mm).norm(), 2.4 - 1e-8);
}

TEST(RecontourPath, RoughsLayerByLayer) {
  PathOptions options;
  options.mill.radius_mm = 2;
  const auto path = PlanPath(TargetOf(0), Vector2d::Zero(), 1.2, {}, options, 1);
  ASSERT_TRUE(path.ok()) << path.status();
  EXPECT_EQ(path->roughing_layers, 3u);  // 1.1 mm in layers of 0.5 at most
  double before_mm = 1e9;
  for (const RecontourPass& pass : path->passes) {
    EXPECT_LE(pass.allowance_mm, before_mm);
    before_mm = pass.allowance_mm;
  }
  EXPECT_EQ(before_mm, 0);
  EXPECT_NEAR(path->passes.front().allowance_mm, 0.1 + 1.1 * 2 / 3, 1e-9);
}

TEST(RecontourPath, AxisIsThePublishedOne) {
  const Vector3d feed(0, 1, 0), normal(1, 0, 0);
  EXPECT_NEAR((ToolAxis(feed, normal, 0, 0) - normal).norm(), 0, 1e-15);
  const Vector3d axis = ToolAxis(feed, normal, 0.3, 0.5);
  EXPECT_NEAR(axis.norm(), 1, 1e-15);
  EXPECT_NEAR(axis.dot(feed) / axis.dot(normal), std::tan(0.3), 1e-12);
  EXPECT_NEAR(axis.z() / axis.dot(normal), std::tan(0.5), 1e-12);
}

TEST(RecontourPath, StepOverAndScallopAreEachOthers) {
  EXPECT_NEAR(*ScallopOf(*StepOverFor(0.005, 3), 3), 0.005, 1e-12);
  EXPECT_FALSE(StepOverFor(0, 3).has_value());
  EXPECT_FALSE(ScallopOf(6.1, 3).has_value());
  const auto heights = PassHeights(30, 31, 0.3);
  EXPECT_EQ(heights.size(), 5u);
  EXPECT_EQ(heights.back(), 31);
}

TEST(RecontourPath, WeldStockIsWhatStandsOverTheTarget) {
  const auto target = TargetOf(0);
  const OutlineNode& node = target[2].outline.nodes()[100];
  const Vector2d out = node.point_mm + 0.7 * node.normal;
  const WeldStock stock = WeldStockOf(target, Vector2d::Zero(), {{out.x(), out.y(), target[2].z_mm}});
  EXPECT_NEAR(stock.greatest_mm, 0.7, 1e-6);
  EXPECT_GT(stock.seen_part, 0);
  EXPECT_LT(stock.seen_part, 0.02);
  EXPECT_EQ(WeldStockOf(target, Vector2d::Zero(), {{0, 0, 10}}).greatest_mm, 0);
}

TEST(RecontourPath, RefusesByName) {
  const auto refused = [](const PathOptions& options, const std::string& field) {
    const auto path = PlanPath(TargetOf(0), Vector2d::Zero(), 0, {}, options, 1);
    ASSERT_FALSE(path.ok()) << field;
    EXPECT_NE(path.status().message().find(field + ": "), std::string::npos) << path.status();
  };
  PathOptions options;
  options.mill.radius_mm = 2;
  options.lead_rad = 1.4;
  refused(options, "lead_rad");
  options.lead_rad = 0;
  options.tilt_rad = -1.4;
  refused(options, "tilt_rad");
  options.tilt_rad = 0.5;
  options.mill.radius_mm = 0.15;
  refused(options, "target[1].z_mm");
  options.mill.radius_mm = 45;
  refused(options, "mill.radius_mm");
  const auto refused_of = [](double depth_mm, GuardedSurface guard, const std::string& field) {
    PathOptions of;
    of.mill.radius_mm = 2;
    of.depth_of_cut_mm = depth_mm;
    const auto path = PlanPath(TargetOf(0), Vector2d::Zero(), 1, std::move(guard), of, 1);
    ASSERT_FALSE(path.ok()) << field;
    EXPECT_NE(path.status().message().find(field + ": "), std::string::npos) << path.status();
  };
  refused_of(1e-9, {}, "depth_of_cut_mm");  // a thousand million layers
  refused_of(0.5, {{Vector3d::Zero()}, {}}, "guard.margin_mm");
  refused_of(0.5, {{Vector3d::Zero()}, {3}}, "guard.margin_mm[0]");
  refused_of(0.5, {{Vector3d(0, std::nan(""), 0)}, {0}}, "guard.points_mm[0]");
}

}  // namespace
}  // namespace sixpoint::metrology
