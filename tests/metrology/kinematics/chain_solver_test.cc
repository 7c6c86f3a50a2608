#include "metrology/kinematics/chain_solver.h"

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

double TurnApart(double one, double other) { return std::abs(std::remainder(one - other, 2 * M_PI)); }

template <typename Solutions>
bool Holds(const Solutions& solutions, const VectorXd& wanted, const std::vector<int>& rotary) {
  for (const ChainSolution& solution : solutions) {
    double worst = 0;
    for (int i = 0; i < wanted.size(); ++i) {
      const bool turns = std::find(rotary.begin(), rotary.end(), i) != rotary.end();
      worst = std::fmax(
          worst, turns ? TurnApart(solution.commanded(i), wanted(i)) : std::abs(solution.commanded(i) - wanted(i)));
    }
    if (worst < kClose) return true;
  }
  return false;
}

// CONF 3.5, both branches, written out: b = atan2(vy, vz) or half a turn on, a = atan2(-vx, vy sin b + vz cos b); the start is
// C + Ry(a) Rx(b) (p - C).
TEST(ChainSolver, IsThePapersClosedFormOnTheSarix) {
  const ChainSolver solver = Solver(Sarix());
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> place(-200, 200);
  for (int i = 0; i < 2000; ++i) {
    const Vector3d v = RandomDirection(random), p(place(random), place(random), place(random));
    const auto solved = BothBranches(solver, {p, v}, VectorXd::Zero(5));
    ASSERT_EQ(solved.size(), 2U);
    for (const double half_turn : {0.0, M_PI}) {
      const double b = std::atan2(v.y(), v.z()) + half_turn;
      const double a = std::atan2(-v.x(), v.y() * std::sin(b) + v.z() * std::cos(b));
      Eigen::Matrix3d ry, rx;
      ry << std::cos(a), 0, std::sin(a), 0, 1, 0, -std::sin(a), 0, std::cos(a);
      rx << 1, 0, 0, 0, std::cos(b), -std::sin(b), 0, std::sin(b), std::cos(b);
      const Vector3d start = kPointC + ry * rx * (p - kPointC);
      // Along B rounding of the direction is all of b.
      if (std::hypot(v.y(), v.z()) < 1e-3) continue;
      EXPECT_TRUE(Holds(solved, Values({a, b, start.x(), start.y(), start.z()}), {0, 1})) << v.transpose();
    }
  }
}

// The columns of NRC's equation (3): the third is the tool's axis, and its translation is turned back into x, y, z.
TEST(ChainSolver, IsTheClosedFormOfATiltRotaryTable) {
  const double z12 = 123.4;
  const ChainSolver solver = Solver(TiltRotaryTable(z12));
  std::mt19937_64 random(12);
  std::uniform_real_distribution<double> place(-200, 200);
  for (int i = 0; i < 2000; ++i) {
    const Vector3d v = RandomDirection(random), p(place(random), place(random), place(random));
    const auto solved = BothBranches(solver, {p, v}, VectorXd::Zero(5));
    ASSERT_EQ(solved.size(), 2U);
    for (const double way : {1.0, -1.0}) {
      const double sb = way * std::hypot(v.x(), v.y()), cb = v.z(), b = std::atan2(sb, cb);
      const double c = std::atan2(way * v.y(), -way * v.x()), sc = std::sin(c), cc = std::cos(c);
      const Vector3d raised = p + Vector3d(0, 0, z12);
      const double x = raised.dot(Vector3d(-cc * cb, sc * cb, -sb)), y = raised.dot(Vector3d(-sc, -cc, 0));
      const double z = raised.dot(Vector3d(-cc * sb, sc * sb, cb)) - z12;
      if (std::abs(sb) < 1e-3) continue;
      EXPECT_TRUE(Holds(solved, Values({x, y, b, c, z}), {2, 3})) << v.transpose();
    }
  }
}

// Table-table, head-table, head-head.
TEST(ChainSolver, BringsTheToolThereOnRandomChainsOfEachClass) {
  std::mt19937_64 random(13);
  std::uniform_real_distribution<double> turn(-M_PI, M_PI), travel(-200, 200);
  for (const int on_part : {2, 1, 0}) {
    int solved_count = 0, two_branches = 0, of_own = 0;
    for (int i = 0; i < 1500; ++i) {
      const JointChain chain = RandomChain(on_part, random);
      ChainSolverOptions options;
      options.tool = {RandomDirection(random), {travel(random), travel(random), travel(random)}, 80};
      const auto solver = ChainSolver::Make(chain, options);
      if (!solver.ok()) continue;  // the tool along the joint that carries it
      VectorXd at(5);
      for (int k = 0; k < 5; ++k) at(k) = chain.motion(k).kind == JointKind::kRotary ? turn(random) : travel(random);
      const ToolTarget target = TargetAt(chain, options.tool, at);
      const auto branches = BothBranches(*solver, target, at);
      if (branches.empty()) continue;  // linear joints nearly dependent there
      ++solved_count;
      two_branches += branches.size() == 2;
      of_own += Holds(branches, at, {solver->first_joint(), solver->second_joint()});
      for (const ChainSolution& solution : branches) {
        const Arrival arrival = ArrivalOf(chain, options.tool, target, solution.reached);
        ASSERT_LT(arrival.off_mm, kClose) << on_part << " " << i;
        ASSERT_LT(arrival.off_rad, kClose) << on_part << " " << i;
        EXPECT_EQ(solution.loose_joint, std::nullopt);
      }
    }
    EXPECT_GT(solved_count, 1400) << on_part;
    EXPECT_GT(two_branches, 1300) << on_part;
    // But for where both branches meet, and rounding is magnified.
    EXPECT_GT(of_own, solved_count - 15) << on_part;
  }
}

TEST(ChainSolver, TakesTheBranchNearestToNominalAndItsWholeTurn) {
  const ChainSolver solver = Solver(Sarix());
  const ToolTarget target = TargetAt(solver.chain(), {}, Values({20 * kRadPerDeg, 40 * kRadPerDeg, 1, 2, 3}));
  const auto angles = [&](double a_deg, double b_deg) {
    const auto solved = solver.Solve(target, Values({a_deg * kRadPerDeg, b_deg * kRadPerDeg, 0, 0, 0}));
    EXPECT_TRUE(solved.ok()) << solved.status();
    return std::pair(solved->commanded(0) / kRadPerDeg, solved->commanded(1) / kRadPerDeg);
  };
  const auto near = angles(25, 30), other = angles(150, 200), wound = angles(10, 700);
  EXPECT_NEAR(near.first, 20, 1e-9);
  EXPECT_NEAR(near.second, 40, 1e-9);
  EXPECT_NEAR(other.first, 160, 1e-9);
  EXPECT_NEAR(other.second, 220, 1e-9);
  EXPECT_NEAR(wound.first, 20, 1e-9);
  EXPECT_NEAR(wound.second, 760, 1e-9);
}

TEST(ChainSolver, KeepsWholeTurnsWithinTheLimits) {
  const ChainSolver solver =
      Solver(Chain({Rotary("A", Vector3d::UnitY(), kPointC),
                    Limited(Rotary("B", Vector3d::UnitX(), kPointC), -100 * kRadPerDeg, 500 * kRadPerDeg)},
                   {Linear("X", Vector3d::UnitX()), Linear("Y", Vector3d::UnitY()), Linear("Z", Vector3d::UnitZ())}));
  const ToolTarget target = TargetAt(solver.chain(), {}, Values({20 * kRadPerDeg, 40 * kRadPerDeg, 1, 2, 3}));
  const auto solved = solver.Solve(target, Values({20 * kRadPerDeg, 1100 * kRadPerDeg, 0, 0, 0}));
  ASSERT_TRUE(solved.ok()) << solved.status();
  EXPECT_NEAR(solved->commanded(1) / kRadPerDeg, 400, 1e-9);
}

TEST(ChainSolver, SaysWhichLimitIsExceededAndByHowMuch) {
  const ChainSolver solver =
      Solver(Chain({Limited(Rotary("A", Vector3d::UnitY(), kPointC), -10 * kRadPerDeg, 10 * kRadPerDeg),
                    Limited(Rotary("B", Vector3d::UnitX(), kPointC), -300 * kRadPerDeg, 300 * kRadPerDeg)},
                   {Linear("X", Vector3d::UnitX()), Linear("Y", Vector3d::UnitY()), Linear("Z", Vector3d::UnitZ())}));
  const ToolTarget target = TargetAt(solver.chain(), {}, Values({20 * kRadPerDeg, 40 * kRadPerDeg, 1, 2, 3}));
  const auto refused = solver.Solve(target, VectorXd::Zero(5)).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kOutOfRange);
  EXPECT_THAT(ViolationsOf(refused), ::testing::ElementsAre(Violation{"A", "20 deg, 10 deg beyond", "-10 to 10 deg"}));
}

TEST(ChainSolver, TakesTheOtherBranchWhereALinearJointDoesNotReach) {
  const VectorXd at = Values({20 * kRadPerDeg, 40 * kRadPerDeg, 100, 50, 30});
  const ToolTarget target = TargetAt(Sarix(), {}, at);
  const auto both = BothBranches(Solver(Sarix()), target, at);
  ASSERT_EQ(both.size(), 2U);
  const double near_x = both[0].commanded(2), other_x = both[1].commanded(2);
  EXPECT_NEAR(other_x, 2 * kPointC.x() - near_x, kClose);  // half a turn about C
  const auto with = [&](double minimum, double maximum) {
    return Solver(Chain({Rotary("A", Vector3d::UnitY(), kPointC), Rotary("B", Vector3d::UnitX(), kPointC)},
                        {Limited(Linear("X", Vector3d::UnitX()), minimum, maximum), Linear("Y", Vector3d::UnitY()),
                         Linear("Z", Vector3d::UnitZ())}))
        .Solve(target, at);
  };
  const auto other = with(other_x - 1, other_x + 1);
  ASSERT_TRUE(other.ok()) << other.status();
  EXPECT_NEAR(other->commanded(2), other_x, kClose);
  EXPECT_NEAR(other->commanded(0) / kRadPerDeg, 160, 1e-9);
  const auto none = with(near_x + 2, near_x + 3).status();
  EXPECT_EQ(none.code(), absl::StatusCode::kOutOfRange);
  EXPECT_THAT(std::string(none.message()), HasSubstr("X: 100 mm, 2 mm beyond, want 102 to 103 mm"));
}

// Along an axis that axis is free: it stays nominal, and the answer says so.
TEST(ChainSolver, HolesAlongCLeaveCNominal) {
  const ChainSolver solver = Solver(TiltRotaryTable(100));
  for (const double c_deg : {0.0, 77.0, -400.0}) {
    const ToolTarget target{{30, 20, 10}, Vector3d::UnitZ()};
    const auto solved = solver.Solve(target, Values({0, 0, 5 * kRadPerDeg, c_deg * kRadPerDeg, 0}));
    ASSERT_TRUE(solved.ok()) << solved.status();
    EXPECT_EQ(solved->loose_joint, 3);
    EXPECT_EQ(solved->commanded(3), c_deg * kRadPerDeg);
    EXPECT_NEAR(solved->commanded(2), 0, 1e-12);
    EXPECT_LT(ArrivalOf(solver.chain(), {}, target, solved->reached).off_mm, kClose);
    EXPECT_LT(ArrivalOf(solver.chain(), {}, target, solved->reached).off_rad, kClose);
  }
  // A thousandth of a degree off C swings in full where no tilt is allowed, and stays where it is.
  const Vector3d off(0, std::sin(1e-3 * kRadPerDeg), std::cos(1e-3 * kRadPerDeg));
  const auto exact = solver.Solve({{30, 20, 10}, off}, Values({0, 0, 0, 10 * kRadPerDeg, 0}));
  const auto held = solver.Solve({{30, 20, 10}, off}, Values({0, 0, 0, 10 * kRadPerDeg, 0}), 2e-3 * kRadPerDeg);
  ASSERT_TRUE(exact.ok() && held.ok());
  EXPECT_NEAR(std::abs(exact->commanded(3)) / kRadPerDeg, 90, 1e-6);
  EXPECT_EQ(exact->loose_joint, std::nullopt);
  EXPECT_EQ(held->commanded(3), 10 * kRadPerDeg);
  EXPECT_EQ(held->loose_joint, 3);
  EXPECT_LT(held->tilt_rad, 1e-3 * kRadPerDeg);
}

// C nods to 45 deg and no farther: 70 deg from Z nothing reaches; a hair beyond it the allowed tilt does.
TEST(ChainSolver, SaysByWhatAngleADirectionIsOutOfReach) {
  const Vector3d nutating = Vector3d(0, 1, 1).normalized();
  const ChainSolver solver = Solver(Chain({Rotary("C", Vector3d::UnitZ(), {0, 0, 0})},
                                          {Linear("X", Vector3d::UnitX()), Linear("Y", Vector3d::UnitY()),
                                           Linear("Z", Vector3d::UnitZ()), Rotary("B", nutating, {0, 0, 50})}));
  const auto at = [](double from_z_deg) {
    return ToolTarget{{5, 6, 7}, {std::sin(from_z_deg * kRadPerDeg), 0, std::cos(from_z_deg * kRadPerDeg)}};
  };
  EXPECT_TRUE(solver.Solve(at(89.9), VectorXd::Zero(5)).ok());
  const auto refused = solver.Solve(at(93), VectorXd::Zero(5)).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kOutOfRange);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("3 deg from the nearest within reach"));
  EXPECT_THAT(std::string(refused.message()), HasSubstr("C, B"));
  const auto tilted = solver.Solve(at(90.01), VectorXd::Zero(5), 0.02 * kRadPerDeg);
  ASSERT_TRUE(tilted.ok()) << tilted.status();
  EXPECT_NEAR(tilted->tilt_rad / kRadPerDeg, 0.01, 1e-9);
  EXPECT_NEAR(ArrivalOf(solver.chain(), {}, at(90.01), tilted->reached).off_rad / kRadPerDeg, 0.01, 1e-9);
  EXPECT_LT(ArrivalOf(solver.chain(), {}, at(90.01), tilted->reached).off_mm, kClose);
  EXPECT_FALSE(solver.Solve(at(90.01), VectorXd::Zero(5), 0.005 * kRadPerDeg).ok());
}

TEST(ChainSolver, CommandsByTheTablesReachTheTarget) {
  Joint a = Limited(Rotary("A", Vector3d::UnitY(), kPointC), -100 * kRadPerDeg, 100 * kRadPerDeg);
  a.table = AngleTable{{1e-3, 3e-3, -2e-3, 0}, {-1e-3, 1e-3, -4e-3, 0}};
  Joint b = Rotary("B", Vector3d::UnitX(), kPointC);
  b.sign = -1;
  b.table = AngleTable{{0, 2e-3, 1e-3, 0, -1e-3}, {0, 2e-3, 1e-3, 0, -1e-3}};
  const JointChain chain =
      Chain({a, b}, {Linear("X", Vector3d::UnitX()), Linear("Y", Vector3d::UnitY()), Linear("Z", Vector3d::UnitZ())});
  ChainSolverOptions options;
  options.travel = {Travel::kForward, Travel::kBackward, Travel::kUnknown, Travel::kUnknown, Travel::kUnknown};
  const ChainSolver solver = Solver(chain, options);
  const VectorXd nominal = Values({50 * kRadPerDeg, 500 * kRadPerDeg, 0, 0, 0});
  const ToolTarget target = TargetAt(chain, {}, Values({55 * kRadPerDeg, 130 * kRadPerDeg, 4, 5, 6}));
  const auto solved = solver.Solve(target, nominal);
  ASSERT_TRUE(solved.ok()) << solved.status();
  const VectorXd reached = chain.Reached(solved->commanded, options.travel);
  EXPECT_GT((solved->commanded - reached).head<2>().cwiseAbs().minCoeff(), 1e-4);
  EXPECT_LT(ArrivalOf(chain, {}, target, reached).off_mm, kClose);
  EXPECT_LT(ArrivalOf(chain, {}, target, reached).off_rad, kClose);
  EXPECT_NEAR(solved->commanded(1) / kRadPerDeg, 490, 1);
  // The table reaches 100.1 deg at a command of 100: limits are of commands.
  const VectorXd end = Values({100 * kRadPerDeg, 0, 0, 0, 0});
  const auto at_end = solver.Solve(TargetAt(chain, {}, chain.Reached(end, options.travel)), end);
  ASSERT_TRUE(at_end.ok()) << at_end.status();
  EXPECT_TRUE(chain.CheckLimits(at_end->commanded).ok());
  EXPECT_NEAR(at_end->commanded(0) / kRadPerDeg, 100, 1e-9);
}

// W lies along Z in the spindle: what it is held at, Z gives.
TEST(ChainSolver, HoldsWAndKnowsTheToolsLength) {
  const auto chain =
      Chain({Rotary("C", Vector3d::UnitZ(), {0, 0, 0})},
            {Linear("X", Vector3d::UnitX()), Linear("Y", Vector3d::UnitY()), Linear("Z", Vector3d::UnitZ()),
             Rotary("B", Vector3d::UnitY(), {0, 0, 400}), Limited(Linear("W", Vector3d::UnitZ()), -100, 100)});
  ChainSolverOptions options;
  options.tool.gauge_in_tool_mm = {0, 0, 250};
  options.tool.length_mm = 120;
  options.held = {"W"};
  const ChainSolver solver = Solver(chain, options);
  const ToolTarget target{{30, -20, 10}, Vector3d(0.4, 0.5, 0.8).normalized()};
  VectorXd nominal = VectorXd::Zero(6);
  for (const double w : {0.0, -60.0, 100.0}) {
    nominal(5) = w;
    const auto solved = solver.Solve(target, nominal);
    ASSERT_TRUE(solved.ok()) << solved.status();
    EXPECT_EQ(solved->commanded(5), w);
    EXPECT_LT(ArrivalOf(chain, options.tool, target, solved->reached).off_mm, kClose);
    EXPECT_LT(ArrivalOf(chain, options.tool, target, solved->reached).off_rad, kClose);
    // By hand: B's pivot at 400 + Z, the tip 400 - 130 - w from it along the tool.
    EXPECT_NEAR(solved->commanded(3), 10 - 400 + (270 - w) * std::cos(solved->commanded(4)), kClose) << w;
  }
  nominal(5) = 101;
  EXPECT_THAT(std::string(solver.Solve(target, nominal).status().message()),
              HasSubstr("W: 101 mm, 1 mm beyond, want -100 to 100 mm"));
}

TEST(ChainSolver, RefusesAChainThatItDoesNotKnow) {
  const Joint x = Linear("X", Vector3d::UnitX()), y = Linear("Y", Vector3d::UnitY()),
              z = Linear("Z", Vector3d::UnitZ()), w = Linear("W", Vector3d::UnitZ());
  const Joint a = Rotary("A", Vector3d::UnitX(), {0, 0, 0}), b = Rotary("B", Vector3d::UnitY(), {0, 0, 0}),
              c = Rotary("C", Vector3d::UnitZ(), {0, 0, 0}),
              d = Rotary("D", Vector3d(0, 1, 1e-4).normalized(), {0, 9, 0});
  const auto refused = [](std::vector<Joint> part_side, std::vector<Joint> tool_side,
                          const ChainSolverOptions& options = {}) {
    const auto solver = ChainSolver::Make(Chain(std::move(part_side), std::move(tool_side)), options);
    EXPECT_EQ(solver.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_FALSE(ViolationsOf(solver.status()).empty());
    return std::string(solver.status().message());
  };
  EXPECT_THAT(refused({c}, {x, y, z}), HasSubstr("kinematics.rotary: 1 joints: C, want two"));
  EXPECT_THAT(refused({a, c}, {x, y, z, b}), HasSubstr("kinematics.rotary: 3 joints: C, A, B, want two"));
  EXPECT_THAT(refused({b, d}, {x, y, z}), HasSubstr("D, B: parallel"));
  EXPECT_THAT(refused({b, c}, {x, y}), HasSubstr("kinematics.linear: 2 joints: X, Y, want three"));
  EXPECT_THAT(refused({b, c}, {x, y, z, w}), HasSubstr("kinematics.linear: 4 joints: X, Y, Z, W, want three"));
  EXPECT_THAT(refused({b, c}, {x, z, w}), HasSubstr("kinematics.linear: X, Z, W: dependent"));
  EXPECT_THAT(refused({b}, {x, y, z, c}), HasSubstr("tool.axis_in_tool"));
  ChainSolverOptions options;
  options.held = {"B"};
  EXPECT_THAT(refused({b, c}, {x, y, z}, options), HasSubstr("held: B, want a linear joint"));
  options.held = {};
  options.tool.axis_in_tool = {0, 0, 2};
  EXPECT_THAT(refused({b, c}, {x, y, z}, options), HasSubstr("a unit direction"));
  options.tool.axis_in_tool = {0, 0, 1};
  options.travel = {Travel::kForward};
  EXPECT_THAT(refused({b, c}, {x, y, z}, options), HasSubstr("1 values, want 5"));
}

// With B at 90 deg W lies along X, and X, Y, W are no more than two.
TEST(ChainSolver, RefusesAnglesAtWhichLinearJointsAreDependent) {
  const ChainSolver solver =
      Solver(Chain({Rotary("C", Vector3d::UnitZ(), {0, 0, 0})},
                   {Linear("X", Vector3d::UnitX()), Linear("Y", Vector3d::UnitY()),
                    Rotary("B", Vector3d::UnitY(), {0, 0, 100}), Linear("W", Vector3d::UnitZ())}));
  EXPECT_TRUE(solver.Solve({{1, 2, 3}, Vector3d(1, 0, 1).normalized()}, VectorXd::Zero(5)).ok());
  const auto refused = solver.Solve({{1, 2, 3}, Vector3d::UnitX()}, VectorXd::Zero(5)).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kOutOfRange);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("X, Y, W: dependent at C, B 0, 90 deg"));
}

TEST(ChainSolver, RefusesWhatIsNoTarget) {
  const ChainSolver solver = Solver(Sarix());
  const VectorXd nominal = VectorXd::Zero(5);
  const auto code = [&](const ToolTarget& target, const VectorXd& near, double tilt = 0) {
    return solver.Solve(target, near, tilt).status().code();
  };
  constexpr auto kInvalid = absl::StatusCode::kInvalidArgument;
  EXPECT_EQ(code({{0, 0, 0}, {0, 0, 2}}, nominal), kInvalid);
  EXPECT_EQ(code({{0, 0, 0}, {0, 0, NAN}}, nominal), kInvalid);
  EXPECT_EQ(code({{NAN, 0, 0}, {0, 0, 1}}, nominal), kInvalid);
  EXPECT_EQ(code({{0, 0, 0}, {0, 0, 1}}, VectorXd::Zero(4)), kInvalid);
  EXPECT_EQ(code({{0, 0, 0}, {0, 0, 1}}, VectorXd::Constant(5, NAN)), kInvalid);
  EXPECT_EQ(code({{0, 0, 0}, {0, 0, 1}}, nominal, -1), kInvalid);
}

}  // namespace
}  // namespace sixpoint::metrology
