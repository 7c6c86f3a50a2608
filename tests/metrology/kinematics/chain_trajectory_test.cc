#include "metrology/kinematics/chain_trajectory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "metrology/frames/angles.h"
#include "refusal/refusal.h"
#include "tests/metrology/kinematics/machine_chains.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;
using ::testing::HasSubstr;

constexpr int kB = 2, kC = 3;  // of NRC's table

JointChain Table(double b_least_deg, double b_most_deg, double c_least_deg, double c_most_deg) {
  return Chain(
      {Linear("X", Vector3d::UnitX()), Linear("Y", Vector3d::UnitY()),
       Limited(Rotary("B", Vector3d::UnitY(), {0, 0, -100}), b_least_deg * kRadPerDeg, b_most_deg * kRadPerDeg),
       Limited(Rotary("C", Vector3d::UnitZ(), {0, 0, 0}), c_least_deg * kRadPerDeg, c_most_deg * kRadPerDeg)},
      {Linear("Z", Vector3d::UnitZ())});
}
// From C's axis, so far and at that azimuth; the tip goes along.
ToolTarget Off(double from_c_deg, double azimuth_deg) {
  const double t = from_c_deg * kRadPerDeg, z = azimuth_deg * kRadPerDeg;
  const Vector3d v(std::sin(t) * std::cos(z), std::sin(t) * std::sin(z), std::cos(t));
  return {Vector3d(20, 10, 5) + 30 * v, v};
}
Continuity Steps(double rotary_deg, double allowed_tilt_deg = 0) {
  Continuity continuity;
  continuity.rotary_rad.always = rotary_deg * kRadPerDeg;
  continuity.linear_mm.always = 300;
  continuity.allowed_tilt_rad = allowed_tilt_deg * kRadPerDeg;
  return continuity;
}

using Solutions = std::vector<ChainSolution>;
Solutions Solved(const ChainSolver& solver, const std::vector<ToolTarget>& targets, const VectorXd& nominal,
                 const Continuity& continuity) {
  auto solved = SolveTrajectory(solver, targets, nominal, continuity);
  EXPECT_TRUE(solved.ok()) << solved.status();
  if (!solved.ok()) return {};
  EXPECT_EQ(solved->size(), targets.size());
  for (size_t i = 0; i < solved->size(); ++i) {
    const ChainSolution& at = solved->at(i);
    const Arrival arrival = ArrivalOf(solver.chain(), {}, targets[i], at.reached);
    EXPECT_LT(arrival.off_mm, kClose) << i;
    EXPECT_NEAR(arrival.off_rad, at.tilt_rad, kClose) << i;
    EXPECT_LE(at.tilt_rad, continuity.allowed_tilt_rad + kClose) << i;
    EXPECT_TRUE(solver.chain().CheckLimits(at.commanded).ok()) << i;
    for (const int joint : {solver.first_joint(), solver.second_joint()}) {
      const double before = i > 0 ? solved->at(i - 1).reached(joint) : at.reached(joint);
      EXPECT_LE(std::abs(at.reached(joint) - before), continuity.rotary_rad.always + kClose) << i;
    }
  }
  return *std::move(solved);
}

TEST(ChainTrajectory, WindsOnWhereSingleTargetsWouldJumpBack) {
  const ChainSolver solver = Solver(Table(-120, 120, -1000, 1000));
  std::vector<ToolTarget> targets;
  for (int i = 0; i <= 100; ++i) targets.push_back(Off(30, 5 * i));
  const VectorXd nominal = Values({0, 0, -30 * kRadPerDeg, 0, 0});
  const Solutions solved = Solved(solver, targets, nominal, Steps(6));
  ASSERT_EQ(solved.size(), 101U);
  EXPECT_NEAR(std::abs(solved.back().reached(kC) - solved.front().reached(kC)) / kRadPerDeg, 500, 1e-6);
  // One by one they stay within a turn of nominal.
  EXPECT_LT(std::abs(solver.Solve(targets.back(), nominal)->reached(kC)) / kRadPerDeg, 181);
}

// From nominal C could go 200 deg either way; 300 deg are there only from the other branch.
TEST(ChainTrajectory, BeginsWhereTheWholeWayIsWithinTheLimits) {
  const ChainSolver solver = Solver(Table(-120, 120, -200, 200));
  std::vector<ToolTarget> targets;
  for (int i = 0; i <= 60; ++i) targets.push_back(Off(30, 5 * i));
  const VectorXd nominal = Values({0, 0, -30 * kRadPerDeg, 0, 0});
  EXPECT_NEAR(solver.Solve(targets.front(), nominal)->reached(kC), 0, kClose);
  const Solutions solved = Solved(solver, targets, nominal, Steps(6));
  ASSERT_EQ(solved.size(), 61U);
  EXPECT_NEAR(solved.front().reached(kC) / kRadPerDeg, 180, 1e-6);
  EXPECT_NEAR(solved.back().reached(kC) / kRadPerDeg, -120, 1e-6);
}

TEST(ChainTrajectory, GoesStraightThroughTheAxisByTheOtherBranch) {
  const ChainSolver solver = Solver(Table(-120, 120, -200, 200));
  std::vector<ToolTarget> targets;
  for (int i = -10; i <= 10; ++i) targets.push_back(Off(i, 70));
  const Solutions solved = Solved(solver, targets, Values({0, 0, 0, -70 * kRadPerDeg, 0}), Steps(2));
  ASSERT_EQ(solved.size(), 21U);
  EXPECT_EQ(solved[10].loose_joint, kC);
  EXPECT_EQ(solved[9].loose_joint, std::nullopt);
  for (const ChainSolution& at : solved) EXPECT_NEAR(at.reached(kC) / kRadPerDeg, -70, 1e-6);
  EXPECT_NEAR((solved[20].reached(kB) - solved[0].reached(kB)) / kRadPerDeg, -20, 1e-6);
}

// In along one azimuth, along the axis, out along another: C turns there, evenly.
TEST(ChainTrajectory, TurnsTheFreeAxisEvenlyBetweenItsNeighbours) {
  const ChainSolver solver = Solver(Table(-120, 120, -200, 200));
  std::vector<ToolTarget> targets;
  for (int i = 5; i > 0; --i) targets.push_back(Off(i, 180));
  for (int i = 0; i < 3; ++i) targets.push_back(Off(0, 0));
  for (int i = 1; i <= 5; ++i) targets.push_back(Off(i, 60));
  const VectorXd nominal = Values({0, 0, 5 * kRadPerDeg, 0, 0});
  const Solutions solved = Solved(solver, targets, nominal, Steps(16));
  ASSERT_EQ(solved.size(), 13U);
  for (int i = 0; i < 4; ++i)
    EXPECT_NEAR(solved[static_cast<size_t>(5 + i)].reached(kC) / kRadPerDeg, -15 - 15 * i, 1e-6);
  const auto refused = SolveTrajectory(solver, targets, nominal, Steps(14)).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kOutOfRange);
  const auto violations = ViolationsOf(refused);
  ASSERT_EQ(violations.size(), 1U);
  EXPECT_EQ(violations[0].field, "targets[5].C");
  EXPECT_THAT(violations[0].value, HasSubstr("a step of 15 deg"));
  EXPECT_EQ(violations[0].wanted, "at most 14 deg from one target to the next");
}

// A hundredth of a degree beside C, which would swing by half a turn within two steps; a tilt that is allowed spares it.
TEST(ChainTrajectory, PassesNearTheAxisByATiltThatIsAllowed) {
  const ChainSolver solver = Solver(Table(-120, 120, -400, 400));
  std::vector<ToolTarget> targets;
  for (int i = -5; i <= 5; ++i)
    targets.push_back(Off(std::hypot(i, 0.01), std::atan2(0.01, static_cast<double>(i)) / kRadPerDeg));
  const VectorXd nominal = VectorXd::Zero(5);
  const auto refused = SolveTrajectory(solver, targets, nominal, Steps(3)).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kOutOfRange);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("targets[5].C: a step of 89.4"));
  const Solutions solved = Solved(solver, targets, nominal, Steps(3, 0.05));
  ASSERT_EQ(solved.size(), 11U);
  EXPECT_EQ(solved[5].loose_joint, kC);
  EXPECT_NEAR(solved[5].tilt_rad / kRadPerDeg, 0.01, 1e-3);
  EXPECT_EQ(solved[4].tilt_rad, 0);
}

// B cannot nod to the other side, so that C has half a turn to make.
TEST(ChainTrajectory, SaysWhereAndByHowMuchItWouldJump) {
  const ChainSolver solver = Solver(Table(0, 120, -400, 400));
  std::vector<ToolTarget> targets;
  for (int i = -5; i <= 5; ++i)
    if (i != 0) targets.push_back(Off(i, 0));
  const auto refused = SolveTrajectory(solver, targets, VectorXd::Zero(5), Steps(10)).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kOutOfRange);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("targets[5].C: a step of 180 deg from"));
  EXPECT_TRUE(SolveTrajectory(solver, targets, VectorXd::Zero(5), Steps(181)).ok());
  // The linear joints have their own bound.
  Continuity short_travel = Steps(181);
  short_travel.linear_mm = {0, 1, 0};
  EXPECT_THAT(std::string(SolveTrajectory(solver, targets, VectorXd::Zero(5), short_travel).status().message()),
              HasSubstr(" mm from one target to the next"));
}

TEST(ChainTrajectory, HoldsTheFreeAxisAtTheEnds) {
  const ChainSolver solver = Solver(Table(-120, 120, -200, 200));
  const std::vector<ToolTarget> along(4, Off(0, 0));
  const VectorXd nominal = Values({0, 0, 0, 33 * kRadPerDeg, 0});
  for (const ChainSolution& at : Solved(solver, along, nominal, Steps(3))) {
    EXPECT_EQ(at.reached(kC), 33 * kRadPerDeg);
    EXPECT_EQ(at.loose_joint, kC);
  }
  std::vector<ToolTarget> targets = along;
  for (int i = 1; i < 5; ++i) targets.push_back(Off(i, -20));
  const Solutions out = Solved(solver, targets, nominal, Steps(3));
  std::reverse(targets.begin(), targets.end());
  const Solutions in = Solved(solver, targets, nominal, Steps(3));
  ASSERT_TRUE(out.size() == 8 && in.size() == 8);
  for (size_t i = 0; i < 8; ++i) {
    EXPECT_NEAR(out[i].reached(kC) / kRadPerDeg, 20, 1e-6);
    EXPECT_NEAR(in[i].reached(kC) / kRadPerDeg, 20, 1e-6);
  }
}

// Against every sequence of branches and whole turns.
TEST(ChainTrajectory, TravelsLeastOfAllWays) {
  std::mt19937_64 random(21);
  std::uniform_real_distribution<double> turn(-M_PI, M_PI), move(-0.6, 0.6);
  int compared = 0;
  for (int round = 0; round < 60; ++round) {
    const double limit = (round % 2 == 0 ? 200 : 400) * kRadPerDeg;
    std::vector<Joint> part_side = {Limited(Rotary("A", RandomDirection(random), {1, 2, 3}), -limit, limit)},
                       tool_side = {Linear("X", Vector3d::UnitX()), Linear("Y", Vector3d::UnitY()),
                                    Linear("Z", Vector3d::UnitZ()),
                                    Limited(Rotary("B", RandomDirection(random), {7, 8, 90}), -limit, limit)};
    const JointChain chain = Chain(part_side, tool_side);
    const auto solver = ChainSolver::Make(chain);
    if (!solver.ok()) continue;
    VectorXd at = Values({turn(random), 0, 0, 0, turn(random)});
    std::vector<ToolTarget> targets;
    for (int i = 0; i < 4; ++i) {
      at(0) += move(random);
      at(4) += move(random);
      targets.push_back(TargetAt(chain, {}, at));
    }
    const VectorXd nominal = VectorXd::Zero(5);
    const double most = 1.0;
    struct Way {
      TurnAngles at;
      double travel;
    };
    std::vector<Way> ways = {{{0, 0}, 0}};
    for (size_t i = 0; i < targets.size(); ++i) {
      const TurnBranches branches = BranchesOf(solver->turns(), Vector3d::UnitZ(), targets[i].axis_in_zero);
      std::vector<Way> longer;
      for (const Way& way : ways)
        for (int k = 0; k < branches.count; ++k)
          for (int m = -2; m <= 2; ++m)
            for (int n = -2; n <= 2; ++n) {
              const TurnAngles& base = branches.angles[static_cast<size_t>(k)];
              const TurnAngles to{base.first_rad + 2 * M_PI * m, base.second_rad + 2 * M_PI * n};
              const double first = to.first_rad - way.at.first_rad, second = to.second_rad - way.at.second_rad;
              if (std::abs(to.first_rad) > limit || std::abs(to.second_rad) > limit) continue;
              if (i > 0 && (std::abs(first) > most || std::abs(second) > most)) continue;
              longer.push_back({to, way.travel + std::hypot(first, second)});
            }
      ways = longer;
    }
    double least = std::numeric_limits<double>::infinity();
    for (const Way& way : ways) least = std::fmin(least, way.travel);
    Continuity continuity;
    continuity.rotary_rad.always = most;
    continuity.linear_mm.always = 1e6;
    const auto solved = SolveTrajectory(*solver, targets, nominal, continuity);
    ASSERT_EQ(solved.ok(), std::isfinite(least)) << round << " " << solved.status();
    if (!solved.ok()) continue;
    double travel = 0;
    VectorXd before = nominal;
    for (const ChainSolution& solution : *solved) {
      travel += std::hypot(solution.reached(0) - before(0), solution.reached(4) - before(4));
      before = solution.reached;
    }
    EXPECT_NEAR(travel, least, 1e-9) << round;
    ++compared;
  }
  EXPECT_GT(compared, 30);
}

// Steps of many turns are no more than one, on joints without limits too.
TEST(ChainTrajectory, TakesTheShortWayWhereStepsAreLong) {
  std::vector<ToolTarget> targets;
  for (int i = 0; i < 20; ++i) targets.push_back(Off(30, 10 * i));
  const auto solved =
      SolveTrajectory(Solver(TiltRotaryTable(100)), targets, Values({0, 0, -30 * kRadPerDeg, 0, 0}), Steps(1e9));
  ASSERT_TRUE(solved.ok()) << solved.status();
  EXPECT_NEAR(std::abs(solved->back().reached(kC) - solved->front().reached(kC)) / kRadPerDeg, 190, 1e-6);
}

TEST(ChainTrajectory, NamesTheTargetThatIsRefused) {
  const ChainSolver solver = Solver(Table(-20, 20, -200, 200));
  const auto refused = [&](const std::vector<ToolTarget>& targets, const Continuity& continuity) {
    return SolveTrajectory(solver, targets, VectorXd::Zero(5), continuity).status();
  };
  const auto steep = refused({Off(10, 0), Off(19, 0), Off(23, 0)}, Steps(20));
  EXPECT_EQ(steep.code(), absl::StatusCode::kOutOfRange);
  EXPECT_THAT(std::string(steep.message()), HasSubstr("targets[2].B: "));
  EXPECT_THAT(std::string(steep.message()), HasSubstr(" deg, 3 deg beyond, want -20 to 20 deg"));
  const auto malformed = refused({Off(10, 0), {{0, 0, 0}, {0, 0, 3}}}, Steps(20));
  EXPECT_EQ(malformed.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(malformed.message()), HasSubstr("targets[1].axis_in_zero"));
  EXPECT_THAT(std::string(refused({}, Steps(20)).message()), HasSubstr("targets: none"));
  EXPECT_THAT(std::string(refused({Off(10, 0)}, Steps(-1)).message()), HasSubstr("continuity.rotary_rad.always"));
  Continuity endless = Steps(20);
  endless.linear_mm.per_mm = std::numeric_limits<double>::infinity();
  EXPECT_THAT(std::string(refused({Off(10, 0)}, endless).message()), HasSubstr("continuity.linear_mm.per_mm"));
}

}  // namespace
}  // namespace sixpoint::metrology
