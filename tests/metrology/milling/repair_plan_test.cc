// A whole repair of a known blade: the target beside the blade's own tip, the path beside the blade's true wall, and what is refused.
#include "metrology/milling/repair_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "metrology/sections/profile.h"
#include "tests/metrology/repair/bent_blades.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using ::testing::HasSubstr;

constexpr double kLine_mm = 28, kTop_mm = 38, kWeld_mm = 0.8;
constexpr double kCertain_mm = 0.08;  // that the target may be uncertain by

// The wall with so much of a weld on it.
Points WeldedWall(double from_mm, double to_mm, std::size_t count, double weld_mm, const SectionMotion& motion) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> unit(0, 1);
  Points points;
  while (points.size() < count) {
    const double z_mm = from_mm + (to_mm - from_mm) * unit(random);
    const std::vector<Vector2d> polygon = KnownPolygon(z_mm, motion);
    for (int k = 0; k < 100; ++k) {
      const auto i = static_cast<std::size_t>(unit(random) * static_cast<double>(polygon.size()));
      const Vector2d way = polygon[(i + 1) % polygon.size()] - polygon[i];
      const Vector2d point = polygon[i] + unit(random) * way + weld_mm * Vector2d(way.y(), -way.x()).normalized();
      points.emplace_back(point.x(), point.y(), z_mm);
    }
  }
  return points;
}

class RepairPlanTest : public ::testing::Test {
 protected:
  RepairPlanTest() : surface_(KnownSurface(-2, 40)), motion_(Bent(0.15, 0.003, 0.01)) {
    cloud_ = KnownWall(-0.5, kLine_mm, 240000, 0.002, motion_, 3);
    const Points weld = WeldedWall(kLine_mm + 0.2, kTop_mm, 60000, kWeld_mm, motion_);
    cloud_.insert(cloud_.end(), weld.begin(), weld.end());
    options_.stack.heights = {0, kLine_mm, kTop_mm, 1};
    options_.stack.half_width_mm = 0.25;
    options_.stack.surface = surface_.get();
    options_.stack.round_ends = true;
    options_.stack.thread_count = 2;
    options_.scallop_mm = 0.02;
    options_.path.mill = {2, 30};
    options_.greatest_uncertainty_mm = kCertain_mm;
  }
  std::string Refusal() const {
    const auto plan = PlanRepair(cloud_, options_);
    EXPECT_EQ(plan.status().code(), absl::StatusCode::kInvalidArgument) << plan.status();
    return std::string(plan.status().message());
  }

  std::shared_ptr<const Surface> surface_;
  SectionMotion motion_;
  Points cloud_;
  RepairOptions options_;
};

// Of a place to the true wall below the line, by its dense polygons.
double ClearOfWall(const Vector3d& centre_mm, const SectionMotion& motion) {
  double least_mm = 1e9;
  for (double z_mm = kLine_mm - 2.5; z_mm <= kLine_mm + 1e-9; z_mm += 0.25)
    for (const Vector2d& point : KnownPolygon(z_mm, motion))
      least_mm = std::min(least_mm, (Vector3d(point.x(), point.y(), z_mm) - centre_mm).norm());
  return least_mm;
}

TEST_F(RepairPlanTest, GoesAroundTheBladesOwnTipAndTouchesNothingBelowTheLine) {
  const auto plan = PlanRepair(cloud_, options_);
  ASSERT_TRUE(plan.ok()) << plan.status();
  for (const LeftOutSection& one : plan->measured.left_out) ADD_FAILURE() << one.z_mm << " " << one.refusal;
  EXPECT_NEAR(plan->stock_mm, kWeld_mm, 0.06);
  EXPECT_EQ(plan->path.roughing_layers, 2u);
  EXPECT_EQ(plan->target.sections.front().z_mm, kLine_mm);
  EXPECT_EQ(plan->target.sections.back().z_mm, kTop_mm);
  // Beside the tip as it was before it was cut off.
  double squares = 0, count = 0;
  for (const TargetSection& section : plan->target.sections)
    for (const Vector2d& point : KnownPolygon(section.z_mm, motion_)) {
      squares += std::pow(SignedDistance(section.outline, point - options_.stack.origin_mm, nullptr), 2);
      ++count;
    }
  EXPECT_LT(1e3 * std::sqrt(squares / count), 15);

  EXPECT_GT(plan->removal.place_count_below, 1000u);
  EXPECT_EQ(plan->removal.deepest_below_mm, 0);
  EXPECT_LT(plan->removal.deepest_in_target_mm, 2.5e-3);
  EXPECT_LT(plan->removal.deepest_beyond_uncertainty_mm, 3e-4);
  EXPECT_LT(plan->removal.mean_rest_mm, 0.02);
  EXPECT_EQ(plan->removal.rest_mm.size(), plan->target.sections.size());
  const RecontourPass& last = plan->path.passes.back();
  EXPECT_EQ(last.z_mm, kLine_mm);
  double least_mm = 1e9;
  for (std::size_t i = 0; i < last.places.size(); i += 3)
    least_mm = std::min(least_mm, ClearOfWall(last.places[i].centre_mm, motion_));
  EXPECT_GT(least_mm, 2 + 0.005) << "of the guard's 10 um half is left to what the outlines are off";
  EXPECT_LT(least_mm, 2 + 0.1);

  options_.stack.thread_count = 1;
  std::reverse(cloud_.begin(), cloud_.end());
  const auto again = PlanRepair(cloud_, options_);
  ASSERT_TRUE(again.ok()) << again.status();
  ASSERT_EQ(again->path.passes.size(), plan->path.passes.size());
  for (std::size_t p = 0; p < plan->path.passes.size(); ++p) {
    ASSERT_EQ(again->path.passes[p].places.size(), plan->path.passes[p].places.size());
    for (std::size_t i = 0; i < plan->path.passes[p].places.size(); ++i)
      ASSERT_EQ(again->path.passes[p].places[i].centre_mm, plan->path.passes[p].places[i].centre_mm);
  }
}

TEST_F(RepairPlanTest, RefusesByName) {
  options_.path.lead_rad = 1.3;  // the shank lies across the hollow side
  options_.path.tilt_rad = -0.3;
  EXPECT_THAT(Refusal(), HasSubstr("um below the repair line, want at most 1"));
  options_.path.lead_rad = 0;
  options_.path.tilt_rad = 0.9;
  options_.scallop_mm = 3;
  EXPECT_THAT(Refusal(), HasSubstr("scallop_mm: 3, want above 0, below the mill's radius"));
  options_.scallop_mm = 1e-9;
  EXPECT_THAT(Refusal(), HasSubstr("at most 2000 finishing laps"));
  options_.scallop_mm = 0.02;
  options_.stack.heights.cutoff_mm = 20;
  EXPECT_THAT(Refusal(), HasSubstr("heights.cutoff_mm: 20, want at least 25.3"));
  options_.stack.heights.cutoff_mm = kLine_mm;
  options_.greatest_uncertainty_mm = 1e-3;
  EXPECT_THAT(Refusal(), HasSubstr(" mm, want at most 1 um: less of it"));
  options_.greatest_uncertainty_mm = kCertain_mm;
  // One side of the weld was not scanned.
  const auto unseen = [](const Vector3d& point) { return point.z() > kLine_mm && point.x() > 4; };
  cloud_.erase(std::remove_if(cloud_.begin(), cloud_.end(), unseen), cloud_.end());
  EXPECT_THAT(Refusal(), HasSubstr("weld: "));
  EXPECT_THAT(Refusal(), HasSubstr("% of it seen, want at least 90"));
}

TEST(ThinnedLap, KeepsItsStraightWaysWithinTheChord) {
  std::vector<ToolPlace> places;
  constexpr double kRadius_mm = 10;
  for (int i = 0; i < 1000; ++i) {
    const double angle = 2 * std::acos(-1.0) * i / 1000;
    ToolPlace place;
    place.axis = {std::cos(angle), std::sin(angle), 0};
    place.normal = place.axis;
    place.centre_mm = kRadius_mm * place.axis;
    places.push_back(place);
  }
  const std::vector<ToolPlace> kept = Thinned(places, 0.002, 0.2);
  // The sagitta of a chord c on a circle: c^2 / (8 r).
  const double most_mm = std::sqrt(8 * kRadius_mm * 0.002), around_mm = 2 * std::acos(-1.0) * kRadius_mm;
  EXPECT_GE(static_cast<double>(kept.size()), around_mm / most_mm);
  EXPECT_LT(static_cast<double>(kept.size()), 1.2 * around_mm / most_mm + 2);
  for (std::size_t i = 0; i < kept.size(); ++i) {
    const Vector3d between = (kept[i].centre_mm + kept[(i + 1) % kept.size()].centre_mm) / 2;
    EXPECT_GT(between.norm(), kRadius_mm - 1e-5);  // the ends went out
    EXPECT_LT(kept[i].centre_mm.norm(), kRadius_mm + 0.0021);
  }
  EXPECT_NEAR(Length_mm(kept), around_mm, 0.02);
  EXPECT_GE(Thinned(places, 0.002, 0.05).size(), 2 * std::acos(-1.0) / 0.05);
}

}  // namespace
}  // namespace sixpoint::metrology
