#include "metrology/correction/orientation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "metrology/frames/angles.h"
#include "metrology/kinematics/chain_solver.h"
#include "tests/metrology/correction/some_path.h"

namespace sixpoint::metrology {
namespace {

const RotaryLimits kWide{-2 * kPi, 2 * kPi, -2 * kPi, 2 * kPi};

Eigen::Matrix3d Ry(double a) { return Eigen::AngleAxisd(a, Eigen::Vector3d::UnitY()).toRotationMatrix(); }
Eigen::Matrix3d Rx(double b) { return Eigen::AngleAxisd(b, Eigen::Vector3d::UnitX()).toRotationMatrix(); }

Eigen::Vector3d RandomDirection(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  return Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
}

// The paper's closed form on ideal axes, Ry(a) Rx(b) v = +Z: b = atan2(Vy, Vz) or half a turn from it,
// a = atan2(-Vx, Vy sin b + Vz cos b).
TEST(Orient, IsThePapersClosedFormOnIdealAxes) {
  std::mt19937_64 random(2);
  int counted = 0, on_second_branch = 0;
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d v = RandomDirection(random);
    if (std::hypot(v.y(), v.z()) < 0.05) continue;
    const auto solved = Orient(RotaryAxes(), v, {0.3, -0.8}, kWide);
    ASSERT_TRUE(solved.ok()) << solved.status();
    bool found = false;
    for (int branch = 0; branch < 2; ++branch) {
      const double b = std::atan2(v.y(), v.z()) + branch * kPi;
      const double a = std::atan2(-v.x(), v.y() * std::sin(b) + v.z() * std::cos(b));
      EXPECT_LT((Ry(a) * Rx(b) * v - Eigen::Vector3d::UnitZ()).norm(), 1e-14);
      const bool same = std::abs(std::remainder(solved->a_rad - a, 2 * kPi)) < 1e-12 &&
                        std::abs(std::remainder(solved->b_rad - b, 2 * kPi)) < 1e-12;
      found = found || same;
      on_second_branch += same && branch == 1;
    }
    EXPECT_TRUE(found) << v.transpose();
    ++counted;
  }
  EXPECT_GT(counted, 450);
  EXPECT_GT(on_second_branch, 20);  // whichever is nearer
}

TEST(Orient, TurnsTheDirectionOntoPlusZOnTiltedAxes) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> tilt(0, 0.05);
  for (int i = 0; i < 500; ++i) {
    RotaryAxes axes;
    axes.a.direction = Eigen::Vector3d(tilt(random), 1, tilt(random)).normalized();
    axes.b.direction = Eigen::Vector3d(1, tilt(random), tilt(random)).normalized();
    const Eigen::Vector3d v = RandomDirection(random);
    if (axes.b.direction.cross(v).norm() < 0.3) continue;
    const auto angles = Orient(axes, v, {}, kWide);
    ASSERT_TRUE(angles.ok()) << angles.status();
    const Eigen::Matrix3d turn = axes.MachineFromZero(angles->a_rad, angles->b_rad).linear();
    EXPECT_LT((turn * v - Eigen::Vector3d::UnitZ()).norm(), 1e-14);
  }
}

// Outer B about Y, inner C about Z, as NRC's tilt-rotary table.
TEST(Orient, SolvesATiltRotaryTable) {
  RotaryAxes axes;
  axes.a.direction = Eigen::Vector3d::UnitY();
  axes.b.direction = Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d v = Eigen::Vector3d(0.3, 0.5, 0.7).normalized();
  const double c = -std::atan2(v.y(), v.x()), b = -std::atan2(std::hypot(v.x(), v.y()), v.z());
  const auto angles = Orient(axes, v, {b, c}, kWide);
  ASSERT_TRUE(angles.ok());
  EXPECT_NEAR(angles->a_rad, b, 1e-9);
  EXPECT_NEAR(angles->b_rad, c, 1e-9);
}

// The published example: poses of the nominal, local and six-point corrected hole
// (docs/methods/correction.md, figures).
TEST(Orient, ReproducesThePublishedPoses) {
  for (const auto& [a_deg, b_deg] : {std::pair{0.0, 55.0}, {0.9585, 55.7641}, {0.9513, 55.7212}}) {
    const Eigen::Vector3d v = Rx(-b_deg * kRadPerDeg) * Ry(-a_deg * kRadPerDeg) * Eigen::Vector3d::UnitZ();
    const RotaryAngles nominal{0, 55 * kRadPerDeg};
    const auto angles = Orient(RotaryAxes(), v, nominal, kWideLimits);
    ASSERT_TRUE(angles.ok());
    EXPECT_NEAR(angles->a_rad / kRadPerDeg, a_deg, 1e-9);
    EXPECT_NEAR(angles->b_rad / kRadPerDeg, b_deg, 1e-9);
  }
}

TEST(Orient, TakesTheBranchNearestToTheNominal) {
  const Eigen::Vector3d v = Rx(-40 * kRadPerDeg) * Ry(-20 * kRadPerDeg) * Eigen::Vector3d::UnitZ();
  const RotaryLimits limits{-170 * kRadPerDeg, 170 * kRadPerDeg, -360 * kRadPerDeg, 360 * kRadPerDeg};
  // The other branch: B + 180 deg, A mirrored about 90 deg.
  const auto near = Orient(RotaryAxes(), v, {20 * kRadPerDeg, 35 * kRadPerDeg}, limits);
  const auto far = Orient(RotaryAxes(), v, {150 * kRadPerDeg, 215 * kRadPerDeg}, limits);
  ASSERT_TRUE(near.ok() && far.ok());
  EXPECT_NEAR(near->a_rad / kRadPerDeg, 20, 1e-9);
  EXPECT_NEAR(near->b_rad / kRadPerDeg, 40, 1e-9);
  EXPECT_NEAR(far->a_rad / kRadPerDeg, 160, 1e-9);
  EXPECT_NEAR(far->b_rad / kRadPerDeg, 220, 1e-9);
}

TEST(Orient, TakesTheWholeTurnNearestToTheNominal) {
  const Eigen::Vector3d v = Rx(10 * kRadPerDeg) * Eigen::Vector3d::UnitZ();  // B = -10 or 350 deg
  EXPECT_NEAR(Orient(RotaryAxes(), v, {0, 0}, kWideLimits)->b_rad / kRadPerDeg, -10, 1e-9);
  EXPECT_NEAR(Orient(RotaryAxes(), v, {0, 340 * kRadPerDeg}, kWideLimits)->b_rad / kRadPerDeg, 350, 1e-9);
}

TEST(Orient, LeavesTheNearestBranchWhenALimitForbidsIt) {
  const Eigen::Vector3d v = Rx(-40 * kRadPerDeg) * Ry(-20 * kRadPerDeg) * Eigen::Vector3d::UnitZ();
  const RotaryLimits only_far{90 * kRadPerDeg, 170 * kRadPerDeg, -360 * kRadPerDeg, 360 * kRadPerDeg};
  EXPECT_NEAR(Orient(RotaryAxes(), v, {20 * kRadPerDeg, 40 * kRadPerDeg}, only_far)->a_rad / kRadPerDeg, 160, 1e-9);
}

TEST(Orient, RefusesWhatNoBranchReachesWithinTheLimits) {
  const Eigen::Vector3d v = Rx(-40 * kRadPerDeg) * Ry(-20 * kRadPerDeg) * Eigen::Vector3d::UnitZ();
  const RotaryLimits narrow{-10 * kRadPerDeg, 10 * kRadPerDeg, -360 * kRadPerDeg, 360 * kRadPerDeg};
  const auto solved = Orient(RotaryAxes(), v, {}, narrow);
  EXPECT_EQ(solved.status().code(), absl::StatusCode::kOutOfRange);
  EXPECT_NE(std::string(solved.status().message()).find("20.0"), std::string::npos) << solved.status();
  // A limit that is met exactly is met.
  const RotaryLimits exact{-20 * kRadPerDeg, 20 * kRadPerDeg, 0, 40 * kRadPerDeg};
  EXPECT_TRUE(Orient(RotaryAxes(), v, {}, exact).ok());
}

TEST(Orient, SaysSingularAlongTheInnerAxis) {
  for (const double sign : {1.0, -1.0}) {
    const Eigen::Vector3d v = Eigen::Vector3d(sign, 2e-4, 0).normalized();
    const auto solved = Orient(RotaryAxes(), v, {}, kWide);
    EXPECT_EQ(solved.status().code(), absl::StatusCode::kFailedPrecondition);
    EXPECT_NE(std::string(solved.status().message()).find("singular"), std::string::npos);
  }
  EXPECT_TRUE(Orient(RotaryAxes(), Eigen::Vector3d(1, 2e-3, 0).normalized(), {}, kWide).ok());
}

// Outer B about Y, inner C about Z, in the zero frame: a hole along C needs no C, and C stays where the nominal program has it.
RotaryAxes TiltRotaryTable() {
  RotaryAxes axes;
  axes.a.direction = Eigen::Vector3d::UnitY();
  axes.b.direction = Eigen::Vector3d::UnitZ();
  return axes;
}
Eigen::Vector3d OffC(double tilt_deg, double azimuth_deg) {
  const double t = tilt_deg * kRadPerDeg, z = azimuth_deg * kRadPerDeg;
  return {std::sin(t) * std::cos(z), std::sin(t) * std::sin(z), std::cos(t)};
}

TEST(OrientNearC, KeepsCWhereItIsFree) {
  const RotaryAngles nominal{0, 130 * kRadPerDeg};
  const auto angles = Orient(TiltRotaryTable(), Eigen::Vector3d::UnitZ(), nominal, kWide, 0.1 * kRadPerDeg);
  ASSERT_TRUE(angles.ok()) << angles.status();
  EXPECT_EQ(angles->b_rad, nominal.b_rad);
  EXPECT_NEAR(angles->a_rad, 0, 1e-15);
  EXPECT_NEAR(TiltOf(TiltRotaryTable(), Eigen::Vector3d::UnitZ(), *angles), 0, 1e-15);
}

// The exact answer swings C by whatever the azimuth is; of a tilt that is allowed it stays, and B takes its share.
TEST(OrientNearC, DoesNotSwingForATenthOfADegree) {
  const RotaryAngles nominal{0, 20 * kRadPerDeg};
  for (int azimuth = 0; azimuth < 360; azimuth += 15) {
    const Eigen::Vector3d v = OffC(0.1, azimuth);
    const auto exact = Orient(TiltRotaryTable(), v, nominal, kWide);
    const auto angles = Orient(TiltRotaryTable(), v, nominal, kWide, 0.15 * kRadPerDeg);
    ASSERT_TRUE(angles.ok()) << angles.status();
    EXPECT_LE(std::abs(angles->b_rad - nominal.b_rad), kLongSwing_rad + 1e-12) << azimuth;
    // What B alone leaves: the part of the tilt across its plane.
    const double left = 0.1 * kRadPerDeg * std::abs(std::sin((azimuth + 20) * kRadPerDeg));
    const double tilt = TiltOf(TiltRotaryTable(), v, *angles);
    EXPECT_LE(tilt, left + 1e-9);
    if (exact.ok() && std::abs(exact->b_rad - nominal.b_rad) > kLongSwing_rad) {
      EXPECT_EQ(angles->b_rad, nominal.b_rad);
      EXPECT_NEAR(tilt, left, 1e-8);
    }
  }
}

TEST(OrientNearC, SwingsNoFartherThanTheAllowedTiltAsks) {
  const RotaryAngles nominal{0, 0};
  for (const int azimuth : {40, 60, 90, 120, -75}) {
    const Eigen::Vector3d v = OffC(1, azimuth);
    const double allowed = 0.2 * kRadPerDeg;
    const auto exact = Orient(TiltRotaryTable(), v, nominal, kWide);
    const auto angles = Orient(TiltRotaryTable(), v, nominal, kWide, allowed);
    ASSERT_TRUE(exact.ok() && angles.ok());
    EXPECT_NEAR(TiltOf(TiltRotaryTable(), v, *exact), 0, 1e-12);
    EXPECT_NEAR(TiltOf(TiltRotaryTable(), v, *angles), allowed, 1e-9);
    // sin(swing that is left) = allowed / tilt.
    EXPECT_NEAR(std::abs(exact->b_rad - angles->b_rad) / kRadPerDeg, 11.54, 0.02) << azimuth;
    EXPECT_LT(std::abs(angles->b_rad), std::abs(exact->b_rad));
  }
}

// Away from it the exact answer is the only one, allowed tilt or not.
TEST(OrientNearC, IsExactElsewhere) {
  for (const auto& [tilt, azimuth] : {std::pair(1.0, 2.0), {6.0, 90.0}, {40.0, 170.0}}) {
    const Eigen::Vector3d v = OffC(tilt, azimuth);
    const auto exact = Orient(TiltRotaryTable(), v, {}, kWide),
               allowed = Orient(TiltRotaryTable(), v, {}, kWide, 0.2 * kRadPerDeg);
    ASSERT_TRUE(exact.ok() && allowed.ok());
    EXPECT_EQ(exact->a_rad, allowed->a_rad);
    EXPECT_EQ(exact->b_rad, allowed->b_rad);
  }
}

// One problem, seen from the part and from the tool: there C is the turn that comes last.
TEST(OrientNearC, IsWhatTheChainSolverAnswers) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> log10_tilt_deg(-4, 2), azimuth_deg(-180, 180), near(-1, 1);
  RotaryAxes axes = TiltRotaryTable();
  axes.a.direction = Eigen::Vector3d(1e-3, 1, -2e-3).normalized();
  axes.b.direction = Eigen::Vector3d(2e-3, 1e-3, 1).normalized();
  const auto linear = [](const char* axis, const Eigen::Vector3d& direction) {
    Joint joint;
    joint.axis = axis;
    joint.motion = {JointKind::kLinear, {direction, Eigen::Vector3d::Zero()}};
    return joint;
  };
  Joint b, c;
  b.axis = "B";
  b.motion = {JointKind::kRotary, axes.a};
  c.axis = "C";
  c.motion = {JointKind::kRotary, axes.b};
  const auto chain =
      JointChain::Make({b, c}, {linear("X", Eigen::Vector3d::UnitX()), linear("Y", Eigen::Vector3d::UnitY()),
                                linear("Z", Eigen::Vector3d::UnitZ())});
  ASSERT_TRUE(chain.ok());
  const auto solver = ChainSolver::Make(*chain);
  ASSERT_TRUE(solver.ok());
  const double free = 100 * kPi;
  int tilted = 0;
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector3d v = OffC(std::pow(10, log10_tilt_deg(random)), azimuth_deg(random));
    const RotaryAngles nominal{near(random), near(random)};
    const double allowed = 0.1 * kRadPerDeg;
    const auto angles = Orient(axes, v, nominal, {-free, free, -free, free}, allowed);
    Eigen::VectorXd commanded = Eigen::VectorXd::Zero(5);
    commanded.head<2>() << nominal.a_rad, nominal.b_rad;
    const auto solved = solver->Solve({{1, 2, 3}, v}, commanded, allowed);
    ASSERT_EQ(angles.ok(), solved.ok()) << angles.status() << solved.status();
    if (!angles.ok()) continue;
    EXPECT_NEAR(angles->a_rad, solved->commanded(0), 1e-9) << v.transpose();
    EXPECT_NEAR(angles->b_rad, solved->commanded(1), 1e-9) << v.transpose();
    tilted += solved->tilt_rad > 1e-6;
  }
  EXPECT_GT(tilted, 300);
}

TEST(OrientNearC, KeepsTheLimits) {
  RotaryLimits limits = kWide;
  limits.a_minimum_rad = 10 * kRadPerDeg;  // B cannot stand at 0
  limits.a_maximum_rad = 20 * kRadPerDeg;
  EXPECT_FALSE(
      Orient(TiltRotaryTable(), Eigen::Vector3d::UnitZ(), {12 * kRadPerDeg, 0}, limits, 0.1 * kRadPerDeg).ok());
}

TEST(Orient, SaysSingularWhenAnAxisIsAlongZOrBothAreParallel) {
  RotaryAxes axes;
  axes.a.direction = Eigen::Vector3d::UnitZ();
  EXPECT_EQ(Orient(axes, Eigen::Vector3d::UnitY(), {}, kWide).status().code(), absl::StatusCode::kFailedPrecondition);
  axes.a.direction = axes.b.direction;
  EXPECT_EQ(Orient(axes, Eigen::Vector3d::UnitY(), {}, kWide).status().code(), absl::StatusCode::kFailedPrecondition);
}

// B 45 deg from A: a direction within 45 deg of the B axis stays on a cone that A cannot bring to Z.
TEST(Orient, RefusesAnUnreachableDirection) {
  RotaryAxes axes;
  axes.b.direction = Eigen::Vector3d(1, 1, 0).normalized();
  const Eigen::Vector3d v = (axes.b.direction + Eigen::Vector3d(0, 0, 0.2)).normalized();
  const auto solved = Orient(axes, v, {}, kWide);
  EXPECT_EQ(solved.status().code(), absl::StatusCode::kOutOfRange);
  EXPECT_NE(std::string(solved.status().message()).find("unreachable"), std::string::npos);
}

TEST(Orient, RefusesADirectionThatIsNotUnit) {
  EXPECT_EQ(Orient(RotaryAxes(), {0, 0, 2}, {}, kWide).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(Orient(RotaryAxes(), {0, NAN, 1}, {}, kWide).status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace sixpoint::metrology
