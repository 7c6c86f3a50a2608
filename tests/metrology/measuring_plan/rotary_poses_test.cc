#include "metrology/measuring_plan/rotary_poses.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/metrology/measuring_plan/plan_scenes.h"

namespace sixpoint::metrology {
namespace {

ChainSolver SolverOn(const PlanMachine& machine) {
  ChainSolverOptions options;
  options.tool.axis_in_tool = TiltedSensor().rotation.col(2);
  auto solver = ChainSolver::Make(PlanChain(machine), options);
  EXPECT_TRUE(solver.ok()) << solver.status();
  return *solver;
}

// Straight from the machine: what the direction of the part becomes, against where the scanner is.
double Tilt_deg(const RotaryPose& pose, const Eigen::Vector3d& direction) {
  const Eigen::Vector3d turned = Eigen::AngleAxisd(pose.a_rad, Eigen::Vector3d::UnitY()) *
                                 (Eigen::AngleAxisd(pose.b_rad, Eigen::Vector3d::UnitX()) * direction);
  const Eigen::Vector3d beam = TiltedSensor().rotation.col(2);
  return std::atan2(turned.cross(beam).norm(), turned.dot(beam)) / kPlanDegree;
}

TEST(RotaryPoses, TurnEachDirectionAlongTheBeamByBothBranches) {
  PlanMachine free;
  free.a_limit_deg = 180;
  const ChainSolver solver = SolverOn(free);
  for (const Eigen::Vector3d& direction : DirectionsAround(50)) {
    const auto poses = PosesTowards(solver, {direction}, 0.1);
    ASSERT_EQ(poses.size(), 2u) << direction.transpose();
    for (const RotaryPose& pose : poses) EXPECT_NEAR(Tilt_deg(pose, direction), 0, 1e-6);
    EXPECT_GT(std::abs(poses[0].a_rad - poses[1].a_rad) + std::abs(poses[0].b_rad - poses[1].b_rad), 1e-3);
  }
}

// A can only go to 30 deg: a direction that asks for 50 is left 20 away, and one that asks for 80 is not offered at 40 deg.
TEST(RotaryPoses, HoldAJointAtItsLimitAndSayNothingOfWhatIsTooFar) {
  PlanMachine narrow;
  narrow.a_limit_deg = 30;
  const ChainSolver solver = SolverOn(narrow);
  const auto direction = [](double deg) -> Eigen::Vector3d {
    return Eigen::AngleAxisd(-deg * kPlanDegree, Eigen::Vector3d::UnitY()) * TiltedSensor().rotation.col(2);
  };
  const auto poses = PosesTowards(solver, {direction(50)}, 40 * kPlanDegree);
  ASSERT_FALSE(poses.empty());
  double least_deg = 180;
  for (const RotaryPose& pose : poses) {
    EXPECT_LE(std::abs(pose.a_rad), 30 * kPlanDegree + 1e-9);
    least_deg = std::min(least_deg, Tilt_deg(pose, direction(50)));
  }
  EXPECT_NEAR(least_deg, 20, 0.1);  // the scanner leans by a degree: B makes use of it
  EXPECT_TRUE(PosesTowards(solver, {direction(80)}, 40 * kPlanDegree).empty());
}

// Nothing in a grid over both axes within the limits comes nearer than what is offered.
TEST(RotaryPoses, NoAnglesWithinTheLimitsComeNearer) {
  PlanMachine narrow;
  narrow.a_limit_deg = 35;
  narrow.b_limit_deg = 70;
  const ChainSolver solver = SolverOn(narrow);
  for (const Eigen::Vector3d& direction : DirectionsAround(40)) {
    double least_deg = 180;
    for (double a = -35; a <= 35; a += 2.5)
      for (double b = -70; b <= 70; b += 2.5)
        least_deg = std::min(least_deg, Tilt_deg({a * kPlanDegree, b * kPlanDegree}, direction));
    if (least_deg > 50) continue;
    double found_deg = 180;
    for (const RotaryPose& pose : PosesTowards(solver, {direction}, 60 * kPlanDegree))
      found_deg = std::min(found_deg, Tilt_deg(pose, direction));
    EXPECT_LE(found_deg, least_deg + 1e-6) << direction.transpose();
  }
}

TEST(RotaryPoses, ThatStandAlikeAreOne) {
  const ChainSolver solver = SolverOn({});
  const Eigen::Vector3d direction = Eigen::Vector3d(0.1, 0.3, 1).normalized();
  EXPECT_EQ(
      PosesTowards(solver, {direction, direction, (direction + Eigen::Vector3d(1e-4, 0, 0)).normalized()}, 0.1).size(),
      PosesTowards(solver, {direction}, 0.1).size());
}

}  // namespace
}  // namespace sixpoint::metrology
