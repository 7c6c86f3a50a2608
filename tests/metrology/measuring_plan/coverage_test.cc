// What a plan says it sees, against closed forms.
#include <gtest/gtest.h>

#include <cmath>

#include "metrology/frames/angles.h"
#include "metrology/measuring_plan/measuring_plan.h"
#include "refusal/refusal.h"
#include "tests/metrology/measuring_plan/plan_scenes.h"

namespace sixpoint::metrology {
namespace {

MeasuringPlan PlanOf(const PlanTask& task) {
  auto plan = MakeMeasuringPlan(task);
  EXPECT_TRUE(plan.ok()) << plan.status();
  return plan.ok() ? *std::move(plan) : MeasuringPlan();
}
double ShareOf(const RegionCoverage& region, Seen seen) {
  return region.area_mm2[static_cast<std::size_t>(seen)] / region.wanted_mm2;
}

TEST(PlanCoverage, APlaneAsWideAsTheLineIsOneSweepAlongItsNormal) {
  const auto plane = SurfaceOf(SheetMesh(40, 14, 8));
  PlanTask task = TaskOf(*plane);
  task.options.coverage = 1;
  const MeasuringPlan plan = PlanOf(task);
  ASSERT_EQ(plan.portions.size(), 1u);
  EXPECT_EQ(plan.regions.at(0).Share(), 1);
  EXPECT_NEAR(plan.regions.at(0).wanted_mm2, 40 * 14, 0.1);
  const PlannedPortion& portion = plan.portions[0];
  // It begins and ends the margin before and behind the plane; the laser plane's lean across 14 mm adds a quarter.
  EXPECT_NEAR(portion.length_mm, 40 + 2 * task.options.margin_mm, 1);
  const Eigen::Vector3d normal =
      RotaryAxes::Of(task.chain)->MachineFromZero(portion.pose.a_rad, portion.pose.b_rad).linear() *
      Eigen::Vector3d::UnitZ();
  EXPECT_NEAR((normal - task.sensor.rotation.col(2)).norm(), 0, 1e-9);
  EXPECT_EQ(plan.travel_mm, 0);
}

// The beam's cap: 2 pi r^2 (1 - cos theta) of 4 pi r^2, by rays that are parallel within half a degree.
TEST(PlanCoverage, OfASphereThatIsNotTurnedIsTheCapWithinTheAngle) {
  const auto sphere = SurfaceOf(SphereMesh(8, 90));
  PlanMachine still;
  still.a_limit_deg = still.b_limit_deg = 0.01;
  for (const double angle_deg : {35.0, 50.0, 65.0}) {
    PlanTask task = TaskOf(*sphere, still);
    task.optics = ParallelOptics();
    task.options.coverage = 1;
    task.options.greatest_incidence_rad = angle_deg * kPlanDegree;
    const RegionCoverage region = PlanOf(task).regions.at(0);
    const auto cap = [](double deg) { return (1 - std::cos(deg * kPlanDegree)) / 2; };
    EXPECT_GE(region.Share(), cap(angle_deg - 0.5) - kShare) << angle_deg;
    EXPECT_LE(region.Share(), cap(angle_deg + 0.5) + kShare) << angle_deg;
    EXPECT_NEAR(ShareOf(region, Seen::kRotaryLimits), 1 - region.Share(), 0.01) << angle_deg;
    EXPECT_EQ(ShareOf(region, Seen::kHidden), 0);
  }
}

TEST(PlanCoverage, OfACylinderIsAllRoundAndItsEndsWhereALetsThem) {
  const double radius_mm = 10, length_mm = 30;
  const auto cylinder = SurfaceOf(CylinderMesh(radius_mm, length_mm, 120));
  const double mantle = length_mm / (length_mm + radius_mm);
  PlanTask free = TaskOf(*cylinder);
  free.options.coverage = 0.99;
  EXPECT_GE(PlanOf(free).regions.at(0).Share(), 0.99);
  // At 60 deg at most, an end takes a turn of 30 deg; A goes 20, and the scanner leans by 0.7.
  PlanMachine narrow;
  narrow.a_limit_deg = 20;
  PlanTask task = TaskOf(*cylinder, narrow);
  task.options.coverage = 1;
  const RegionCoverage region = PlanOf(task).regions.at(0);
  EXPECT_NEAR(region.Share(), mantle, kShare);
  EXPECT_NEAR(ShareOf(region, Seen::kRotaryLimits), 1 - mantle, kShare);
}

TEST(PlanCoverage, WhatLiesWithinThePartIsHidden) {
  TriangleMesh mesh;
  AddBoxMesh({-10, -10, -10}, {10, 10, 10}, false, &mesh);
  AddBoxMesh({-5, -5, -5}, {5, 5, 5}, true, &mesh);
  const auto box = SurfaceOf(mesh);
  PlanTask task = TaskOf(*box);
  task.options.coverage = 1;
  const RegionCoverage region = PlanOf(task).regions.at(0);
  EXPECT_NEAR(region.Share(), 2400.0 / 3000, kShare);
  EXPECT_NEAR(ShareOf(region, Seen::kHidden), 600.0 / 3000, kShare);
  double sum = 0;
  for (const double area : region.area_mm2) sum += area;
  EXPECT_NEAR(sum, region.wanted_mm2, 1e-6);
}

// A post beside the plate: its axes do not turn, so the housing cannot come over the plate near it.
TEST(PlanCoverage, WhereTheHousingWouldTouchIsNotScannedAndSaysSo) {
  TriangleMesh mesh;
  AddBoxMesh({-40, -8, -5}, {40, 8, 0}, false, &mesh);
  AddBoxMesh({45, -8, -5}, {55, 8, 80}, false, &mesh);
  const auto part = SurfaceOf(mesh);
  PlanMachine still;
  still.a_limit_deg = still.b_limit_deg = 0.01;
  PlanTask task = TaskOf(*part, still);
  task.options.coverage = 1;
  task.options.greatest_incidence_rad = 30 * kPlanDegree;
  const RegionCoverage region = PlanOf(task).regions.at(0);
  EXPECT_GT(region.area_mm2[static_cast<std::size_t>(Seen::kClearance)], 100);
  // Without the post the whole plate is seen.
  TriangleMesh alone;
  AddBoxMesh({-40, -8, -5}, {40, 8, 0}, false, &alone);
  const auto plate = SurfaceOf(alone);
  PlanTask free = TaskOf(*plate, still);
  free.options = task.options;
  const RegionCoverage clear = PlanOf(free).regions.at(0);
  EXPECT_EQ(clear.area_mm2[static_cast<std::size_t>(Seen::kClearance)], 0);
  EXPECT_NEAR(clear.area_mm2[0], 80 * 16, 0.01 * 80 * 16);
}

// A second plate of the fixture that stands up beside it: the housing, 20 mm to either side, keeps away from it. Over it, it hides it.
TEST(PlanCoverage, ANeighbourStandsInTheWayAndInTheLight) {
  TriangleMesh mesh;
  AddBoxMesh({-40, -8, -5}, {40, 8, 0}, false, &mesh);
  const auto plate = SurfaceOf(mesh);
  PlanMachine still;
  still.a_limit_deg = still.b_limit_deg = 0.01;
  PlanTask task = TaskOf(*plate, still);
  task.options.coverage = 1;
  task.options.greatest_incidence_rad = 30 * kPlanDegree;
  const auto neighbour_at = [&](double x_mm) {
    task.neighbours_zero_from_part = {task.zero_from_part * Eigen::Translation3d(x_mm, 0, 40) *
                                      Eigen::AngleAxisd(kPlanDegree * 90, Eigen::Vector3d::UnitY())};
  };
  const auto why_nothing = [&] {
    const auto plan = MakeMeasuringPlan(task);
    EXPECT_EQ(plan.status().code(), absl::StatusCode::kOutOfRange) << plan.status();
    return std::string(plan.status().message());
  };
  neighbour_at(80);
  EXPECT_NEAR(PlanOf(task).regions.at(0).area_mm2[0], 80 * 16, 0.01 * 80 * 16);
  neighbour_at(50);
  EXPECT_NE(why_nothing().find("too near to the part for the housing"), std::string::npos) << why_nothing();
  task.options.body = {{-1, -1, 200}, {1, 1, 201}};
  task.neighbours_zero_from_part = {task.zero_from_part * Eigen::Translation3d(0, 0, 30)};
  EXPECT_NE(why_nothing().find("hidden"), std::string::npos) << why_nothing();
}

TEST(PlanCoverage, LimitsThatLeaveNothingAreRefusedWithWhy) {
  const auto plane = SurfaceOf(SheetMesh(40, 14, 4));
  PlanMachine tight;
  tight.x_mm = 1;
  const auto no_travel = MakeMeasuringPlan(TaskOf(*plane, tight));
  EXPECT_EQ(no_travel.status().code(), absl::StatusCode::kOutOfRange);
  ASSERT_EQ(ViolationsOf(no_travel.status()).size(), 1u);
  EXPECT_EQ(ViolationsOf(no_travel.status())[0].value, "nothing of it is seen: 100 % beyond a linear axis's limits");
  TriangleMesh under = SheetMesh(40, 14, 4);
  for (TriangleCorners& corners : under.triangles) std::swap(corners[0], corners[1]);
  const auto below = SurfaceOf(under);
  PlanMachine still;
  still.a_limit_deg = still.b_limit_deg = 20;
  const auto no_turn = MakeMeasuringPlan(TaskOf(*below, still));
  ASSERT_EQ(ViolationsOf(no_turn.status()).size(), 1u) << no_turn.status();
  EXPECT_EQ(ViolationsOf(no_turn.status())[0].value, "nothing of it is seen: 100 % beyond a rotary axis's limits");
}

TEST(PlanCoverage, StopsWhereEnoughIsSeen) {
  const auto cylinder = SurfaceOf(CylinderMesh(10, 30, 60));
  PlanTask half = TaskOf(*cylinder), most = TaskOf(*cylinder);
  half.options.coverage = 0.5;
  most.options.coverage = 0.95;
  const MeasuringPlan little = PlanOf(half), much = PlanOf(most);
  EXPECT_GE(little.regions[0].Share(), 0.5);
  EXPECT_LT(little.portions.size(), much.portions.size());
  EXPECT_NEAR(ShareOf(little.regions[0], Seen::kLeftOut), 1 - little.regions[0].Share(), 1e-9);
  PlanTask few = most;
  few.options.most_portions = 2;
  const MeasuringPlan two = PlanOf(few);
  EXPECT_EQ(two.portions.size(), 2u);
  EXPECT_LT(two.regions[0].Share(), 0.95);
}

// Six places of a block, two on the underside.
std::vector<NamedDisc> SixDiscs() {
  return {{"D1", {{-10, -5, 8}, {0, 0, 1}, 2}}, {"D2", {{10, -5, 8}, {0, 0, 1}, 2}},
          {"D3", {{0, 5, -8}, {0, 0, -1}, 2}},  {"D4", {{-10, 10, 0}, {0, 1, 0}, 2}},
          {"D5", {{10, 10, 0}, {0, 1, 0}, 2}},  {"D6", {{20, 0, 0}, {1, 0, 0}, 2}}};
}

TEST(PlanCoverage, OfSixPlacesIsASmallSweepOverEachAlongItsNormal) {
  TriangleMesh mesh;
  AddBoxMesh({-20, -10, -8}, {20, 10, 8}, false, &mesh);
  const auto block = SurfaceOf(mesh);
  PlanTask task = TaskOf(*block);
  task.discs = SixDiscs();
  task.options.coverage = 1;
  const MeasuringPlan plan = PlanOf(task);
  ASSERT_EQ(plan.regions.size(), 6u);
  ASSERT_EQ(plan.portions.size(), 6u);
  for (const RegionCoverage& region : plan.regions) {
    EXPECT_EQ(region.Share(), 1) << region.name;
    EXPECT_NEAR(region.wanted_mm2, 4 * kPi, 0.05 * 4 * kPi);
  }
  const RotaryAxes axes = *RotaryAxes::Of(task.chain);
  for (const NamedDisc& named : task.discs) {
    const auto portion = std::find_if(plan.portions.begin(), plan.portions.end(),
                                      [&](const PlannedPortion& p) { return p.region == named.name; });
    ASSERT_NE(portion, plan.portions.end()) << named.name;
    EXPECT_LE(portion->length_mm, 4 + 2 * task.options.margin_mm + 0.4);
    const Eigen::Isometry3d machine_from_part =
        axes.MachineFromZero(portion->pose.a_rad, portion->pose.b_rad) * task.zero_from_part;
    // Of D6, which lies along B, A alone turns the normal: the scanner's lean of 0.4 deg about X is left.
    EXPECT_NEAR((machine_from_part.linear() * named.disc.normal - task.sensor.rotation.col(2)).norm(), 0,
                named.name == "D6" ? 0.45 * kPlanDegree : 1e-9)
        << named.name;
    // In the middle of the sweep the place is in the middle of the field.
    const Eigen::Vector3d middle_mm = task.sensor.MachineFromSensor({portion->length_mm / 2, 0, 0}, portion->v0_mm);
    EXPECT_NEAR((middle_mm - machine_from_part * named.disc.centre_mm).norm(), 0, 0.3) << named.name;
  }
}

// Wider than the line: as many sweeps as it takes, side by side.
TEST(PlanCoverage, OfAWidePlaceIsMoreThanOneSweep) {
  const auto plane = SurfaceOf(SheetMesh(80, 80, 8));
  PlanTask task = TaskOf(*plane);
  task.discs = {{"D1", {Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitZ(), 25}}};
  const MeasuringPlan plan = PlanOf(task);
  EXPECT_GE(plan.portions.size(), 3u);
  EXPECT_GE(plan.regions.at(0).Share(), 0.95);
  EXPECT_NEAR(plan.regions.at(0).wanted_mm2, kPi * 25 * 25, 0.05 * kPi * 25 * 25);  // 300 places, some on the rim
  EXPECT_EQ(ShareOf(plan.regions.at(0), Seen::kRotaryLimits), 0);
}

TEST(PlanCoverage, IsTheSameOnAnyNumberOfThreads) {
  const auto cylinder = SurfaceOf(CylinderMesh(10, 30, 60));
  PlanTask one = TaskOf(*cylinder), many = TaskOf(*cylinder);
  one.options.threads = 1;
  many.options.threads = 5;
  const MeasuringPlan first = PlanOf(one), second = PlanOf(many);
  ASSERT_EQ(first.portions.size(), second.portions.size());
  for (std::size_t i = 0; i < first.portions.size(); ++i) {
    EXPECT_EQ(first.portions[i].start, second.portions[i].start);
    EXPECT_EQ(first.portions[i].v0_mm, second.portions[i].v0_mm);
    EXPECT_EQ(first.portions[i].length_mm, second.portions[i].length_mm);
    EXPECT_EQ(first.portions[i].leave, second.portions[i].leave);
  }
}

// Real CAD stands metres from its origin.
TEST(PlanCoverage, APartFarFromItsOriginIsSeenAsMuch) {
  const Eigen::Vector3d far_mm(-176, -6314, 220);
  TriangleMesh moved = CylinderMesh(10, 30, 60);
  for (Eigen::Vector3d& vertex : moved.vertices_mm) vertex += far_mm;
  const auto near = SurfaceOf(CylinderMesh(10, 30, 60)), away = SurfaceOf(moved);
  PlanTask of_moved = TaskOf(*away);
  of_moved.zero_from_part.translation() -= far_mm;
  EXPECT_NEAR(PlanOf(of_moved).regions[0].Share(), PlanOf(TaskOf(*near)).regions[0].Share(), kShare);
}

TEST(PlanCoverage, EndsWhereTheCallerGoesAway) {
  const auto cylinder = SurfaceOf(CylinderMesh(10, 30, 60));
  PlanTask task = TaskOf(*cylinder);
  task.options.keep_going = [] { return false; };
  EXPECT_EQ(MakeMeasuringPlan(task).status().code(), absl::StatusCode::kCancelled);
}

TEST(PlanCoverage, WhatIsNotTakenIsRefusedByItsName) {
  const auto plane = SurfaceOf(SheetMesh(40, 14, 4));
  const auto refused = [&](const std::function<void(PlanTask*)>& change, const std::string& field) {
    PlanTask task = TaskOf(*plane);
    change(&task);
    const absl::Status status = MakeMeasuringPlan(task).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << field << ": " << status;
    bool named = false;
    for (const Violation& violation : ViolationsOf(status)) named = named || violation.field == field;
    EXPECT_TRUE(named) << field << ": " << status;
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double coverage : {0.0, -0.1, 1.01, nan})
    refused([&](PlanTask* task) { task->options.coverage = coverage; }, "coverage");
  for (const double angle_deg : {0.0, 86.0, nan})
    refused([&](PlanTask* task) { task->options.greatest_incidence_rad = angle_deg * kPlanDegree; },
            "greatest_incidence_deg");
  for (const double margin_mm : {-1.0, 12.5, nan})
    refused([&](PlanTask* task) { task->options.margin_mm = margin_mm; }, "margin_mm");
  for (const double clearance_mm : {-1.0, 1001.0, nan})
    refused([&](PlanTask* task) { task->options.clearance_mm = clearance_mm; }, "clearance_mm");
  for (const int most : {0, 501}) refused([&](PlanTask* task) { task->options.most_portions = most; }, "most_portions");
  refused([](PlanTask* task) { task->options.body.low_mm = task->options.body.high_mm; }, "body");
  refused([](PlanTask* task) { task->optics = {}; }, "sensor.mid_range_mm");
  refused([](PlanTask* task) { task->optics.range_mm = 0; }, "sensor.range_mm");
  refused([](PlanTask* task) { task->optics.line_angle_rad = 0; }, "sensor.line_angle_deg");
  // A line along the encoder's way.
  refused([](PlanTask* task) { task->sensor.rotation = RotationFromVector({0, 0, M_PI / 2}); }, "sensor_calibration");
  refused([](PlanTask* task) { task->discs = {{"D1", {{0, 0, 0}, {0, 0, 1}, 0}}}; }, "regions[D1].radius_mm");
  refused([](PlanTask* task) { task->discs = {{"D1", {{0, 0, 0}, {0, 0, 2}, 1}}}; }, "regions[D1].normal_in_part");
  refused([](PlanTask* task) { task->discs = {{"D1", {{0, 0, 90}, {0, 0, 1}, 1}}}; }, "regions[D1]");
  refused([](PlanTask* task) { task->discs.assign(51, {"D1", {{0, 0, 0}, {0, 0, 1}, 1}}); }, "regions");
}

}  // namespace
}  // namespace sixpoint::metrology
