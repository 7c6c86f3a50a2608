#include "metrology/kinematics/joint_chain.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "metrology/frames/angles.h"
#include "metrology/kinematics/rotary_axes.h"
#include "tests/metrology/kinematics/machine_chains.h"

namespace sixpoint::metrology {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

// A about Y, of so many degrees, carries B about X; X, Y, Z move the tool.
JointChain SarixWithLimits() {
  return Chain({Limited(Rotary("A", Vector3d::UnitY(), kPointC), -100 * kRadPerDeg, 100 * kRadPerDeg),
                Rotary("B", Vector3d::UnitX(), kPointC)},
               {Linear("X", Vector3d::UnitX()), Linear("Y", Vector3d::UnitY()), Linear("Z", Vector3d::UnitZ())});
}

// Nothing of it is along a machine axis, and no two axes meet.
JointChain Skewed() {
  return Chain({Linear("Y", Vector3d(0.01, 1, -0.02).normalized()),
                Rotary("C", Vector3d(0.02, -0.01, 1).normalized(), {11, -7, 3}, -1),
                Rotary("A", Vector3d(1, 0.03, 0.01).normalized(), {2, 90, -60})},
               {Linear("X", Vector3d(1, 0.002, 0.003).normalized()),
                Rotary("B", Vector3d(-0.01, 1, 0.02).normalized(), {400, 3, 350})});
}

TEST(JointChain, TheSarixIsRyRxAboutC) {
  const JointChain chain = Sarix();
  const Vector3d p(71, 60, -181);
  for (const double a : {-1.7, 0.0, 0.4}) {
    for (const double b : {-6.0, 0.3, 3.1}) {
      Eigen::Matrix3d ry, rx;  // CONF 3.1, written out by hand
      ry << std::cos(a), 0, std::sin(a), 0, 1, 0, -std::sin(a), 0, std::cos(a);
      rx << 1, 0, 0, 0, std::cos(b), -std::sin(b), 0, std::sin(b), std::cos(b);
      const Vector3d stands = kPointC + ry * rx * (p - kPointC);
      const Eigen::VectorXd at = Values({a, b, 5, -3, 40});
      EXPECT_LT((chain.MachineFromZero(at) * p - stands).norm(), 1e-9);
      EXPECT_LT((chain.MachineFromTool(at) * p - (p + Vector3d(5, -3, 40))).norm(), 1e-9);
      EXPECT_LT((chain.ZeroFromTool(at) * (stands - Vector3d(5, -3, 40)) - p).norm(), 1e-9);
    }
  }
}

// NRC equation (3), element by element.
TEST(JointChain, TheTiltRotaryTableIsNrcsClosedForm) {
  const double z12 = 123.4;
  const JointChain chain = TiltRotaryTable(z12);
  for (const double b : {-1.2, 0.0, 0.7}) {
    for (const double c : {-2.5, 0.2, 6.0}) {
      const double x = 12, y = -34, z = 56;
      const double sb = std::sin(b), cb = std::cos(b), sc = std::sin(c), cc = std::cos(c);
      Eigen::Matrix4d closed;
      closed << cc * cb, sc, -cc * sb, -x * cc * cb - y * sc - (z + z12) * cc * sb,  //
          -sc * cb, cc, sc * sb, x * sc * cb - y * cc + (z + z12) * sc * sb,         //
          sb, 0, cb, -x * sb + (z + z12) * cb - z12,                                 //
          0, 0, 0, 1;
      EXPECT_LT((chain.ZeroFromTool(Values({x, y, b, c, z})).matrix() - closed).cwiseAbs().maxCoeff(), 1e-9);
    }
  }
}

Eigen::Matrix4d Shift(const Vector3d& t) {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topRightCorner<3, 1>() = t;
  return m;
}
// Rodrigues' matrix, written out; about a line by shifting there and back.
Eigen::Matrix4d Turn(const Vector3d& d, const Vector3d& point, double angle) {
  Eigen::Matrix3d k;
  k << 0, -d.z(), d.y(), d.z(), 0, -d.x(), -d.y(), d.x(), 0;
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = Eigen::Matrix3d::Identity() + std::sin(angle) * k + (1 - std::cos(angle)) * k * k;
  return Shift(point) * m * Shift(-point);
}

TEST(JointChain, SkewedAxesThatDoNotMeetAreAProductOfMatrices) {
  const Eigen::VectorXd at = Values({20, 0.8, -1.9, -15, 0.3});
  const JointChain chain = Skewed();
  const std::vector<Joint>& j = chain.joints();
  const auto line = [&](int i) { return j[static_cast<size_t>(i)].motion.line; };
  const Eigen::Matrix4d part = Shift(20 * line(0).direction) * Turn(line(1).direction, line(1).point_mm, -0.8) *
                               Turn(line(2).direction, line(2).point_mm, -1.9);
  const Eigen::Matrix4d tool = Shift(-15 * line(3).direction) * Turn(line(4).direction, line(4).point_mm, 0.3);
  EXPECT_LT((chain.MachineFromZero(at).matrix() - part).cwiseAbs().maxCoeff(), 1e-11);
  EXPECT_LT((chain.MachineFromTool(at).matrix() - tool).cwiseAbs().maxCoeff(), 1e-11);
  EXPECT_LT((chain.ZeroFromTool(at).matrix() - part.inverse() * tool).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(JointChain, DerivativesAreThoseOfDifferences) {
  const JointChain chain = Skewed();
  const Eigen::VectorXd at = Values({20, 0.8, -1.9, -15, 0.3});
  const Vector3d p(70, 60, -180);
  constexpr double kStep = 1e-6;
  // Rounding: 1e-14 * 400 mm / 1e-6.
  constexpr double kTolerance = 1e-5;
  std::vector<JointMotion> joints;
  int parameters = 0;
  for (int i = 0; i < chain.size(); ++i) {
    joints.push_back(chain.motion(i));
    parameters += joints.back().ParameterCount();
  }
  ASSERT_EQ(parameters, 2 + 4 + 4 + 2 + 4);
  const auto carried = [&](const std::vector<JointMotion>& by, const Eigen::VectorXd& positions) -> Vector3d {
    return Carry(by.data(), positions.data(), chain.size()) * p;
  };
  Eigen::Matrix3Xd by_position(3, chain.size()), by_line(3, parameters);
  CarryPositionJacobian(joints.data(), at.data(), chain.size(), p, by_position);
  CarryParameterJacobian(joints.data(), at.data(), chain.size(), p, by_line);
  int column = 0;
  for (int k = 0; k < chain.size(); ++k) {
    const Eigen::VectorXd step = kStep * Eigen::VectorXd::Unit(5, k);
    const Vector3d change = (carried(joints, at + step) - carried(joints, at - step)) / (2 * kStep);
    EXPECT_LT((change - by_position.col(k)).norm(), kTolerance) << k;
    for (int j = 0; j < joints[static_cast<size_t>(k)].ParameterCount(); ++j, ++column) {
      const auto moved = [&](double by) {
        std::vector<JointMotion> lines = joints;
        AxisLine& line = lines[static_cast<size_t>(k)].line;
        line = PerturbedLine(line, by * Eigen::Vector4d::Unit(j));
        return carried(lines, at);
      };
      EXPECT_LT(((moved(kStep) - moved(-kStep)) / (2 * kStep) - by_line.col(column)).norm(), kTolerance) << column;
    }
  }
}

// RotaryAxes stands on the chain; these are the expressions that it had before, and the bits are the same.
TEST(JointChain, RotaryAxesKeepTheirBits) {
  const RotaryAxes axes{{Vector3d(1e-4, 1, 3e-6).normalized(), {26.63, 54.88, -193.32}},
                        {Vector3d(1, -1e-4, 2e-5).normalized(), {26.63, 54.87, -193.324}}};
  const Vector3d p(70, 60, -180);
  for (const double a : {-0.8, 0.0, 1.3}) {
    const double b = 2.5 - a;
    EXPECT_EQ(axes.MachineFromZero(a, b).matrix(), (AboutLine(axes.a, a) * AboutLine(axes.b, b)).matrix());
    Eigen::Matrix<double, 3, 8> before;
    before << LineJacobian(axes.a, AboutLine(axes.b, b) * p, a),
        AboutLine(axes.a, a).linear() * LineJacobian(axes.b, p, b);
    EXPECT_EQ(axes.ParameterJacobian(p, a, b), before);
  }
  const auto of = RotaryAxes::Of(Skewed());
  ASSERT_TRUE(of.ok());
  EXPECT_EQ(of->MachineFromZero(0.3, 0.4).matrix(), Skewed().MachineFromZero(Values({0, 0.3, 0.4, 0, 0})).matrix());
  EXPECT_EQ(RotaryAxes::Of(Chain({Rotary("B", Vector3d::UnitX(), {0, 0, 0})}, {})).status().code(),
            absl::StatusCode::kFailedPrecondition);
}

TEST(JointChain, LimitsAreCheckedByName) {
  const JointChain chain = SarixWithLimits();
  EXPECT_TRUE(chain.CheckLimits(Values({-100 * kRadPerDeg, 50, 0, 0, 0})).ok());
  const absl::Status over = chain.CheckLimits(Values({100.5 * kRadPerDeg, 0, 0, 0, 0}));
  EXPECT_EQ(over.code(), absl::StatusCode::kOutOfRange);
  EXPECT_EQ(over.message(), "A: 100.5 deg, want -100 to 100 deg");
  EXPECT_THAT(std::string(chain.CheckLimits(Values({0, 0, std::nan(""), 0, 0})).message()), HasSubstr("X: NaN mm"));
  EXPECT_THAT(std::string(chain.CheckLimits(Values({0, 0})).message()), HasSubstr("2 values, want 5"));
  EXPECT_EQ(chain.Find("Z"), 4);
  EXPECT_EQ(chain.Find("C"), std::nullopt);
}

TEST(JointChain, RefusesWhatIsNoMachine) {
  const auto refused = [](std::vector<Joint> joints) {
    const auto chain = JointChain::Make(std::move(joints), {});
    return chain.ok() ? "accepted" : std::string(chain.status().message());
  };
  const Joint a = Rotary("A", Vector3d::UnitY(), kPointC);
  EXPECT_THAT(refused({a, a}), HasSubstr("a letter that no other joint has"));
  EXPECT_THAT(refused({Rotary("A", {0, 2, 0}, kPointC)}), HasSubstr("want length 1"));
  EXPECT_THAT(refused({Rotary("A", {0, 1, 0}, {0, std::nan(""), 0})}), HasSubstr("joint A.point_mm"));
  EXPECT_THAT(refused({Rotary("A", {0, 1, 0}, kPointC, 0)}), HasSubstr("+1 or -1"));
  Joint reversed = a;
  reversed.minimum = 1;
  reversed.maximum = -1;
  EXPECT_THAT(refused({reversed}), HasSubstr("limits in order"));
  Joint linear = Linear("X", Vector3d::UnitX());
  linear.table = AngleTable{{0, 0, 0, 0}, {0, 0, 0, 0}};
  EXPECT_THAT(refused({linear}), HasSubstr("angle_table"));
  Joint short_table = a;
  short_table.table = AngleTable{{0, 0, 0, 0}, {0, 0, 0}};
  EXPECT_THAT(refused({short_table}), HasSubstr("as many both ways"));
}

TEST(AngleTable, IsLinearBetweenItsValuesAndPeriodic) {
  const AngleTable table{{0, 1e-4, 2e-4, -1e-4}, {1e-4, 1e-4, 0, 0}};
  EXPECT_DOUBLE_EQ(table.ErrorAt(45 * kRadPerDeg, Travel::kForward), 0.5e-4);
  EXPECT_NEAR(table.ErrorAt(315 * kRadPerDeg, Travel::kForward), -0.5e-4, 1e-18);
  EXPECT_NEAR(table.ErrorAt(-45 * kRadPerDeg, Travel::kForward), -0.5e-4, 1e-18);
  EXPECT_NEAR(table.ErrorAt(45 * kRadPerDeg + 6 * M_PI, Travel::kBackward), 1e-4, 1e-18);
  EXPECT_NEAR(table.ErrorAt(135 * kRadPerDeg, Travel::kUnknown), (1.5e-4 + 0.5e-4) / 2, 1e-18);
  for (const double angle : {-7.0, 0.1, 3.0}) {
    const double command = table.CommandFor(angle, Travel::kBackward);
    EXPECT_NEAR(table.Reached(command, Travel::kBackward), angle, 1e-14);
  }
}

TEST(AngleTable, TheChainAppliesItWhereAsked) {
  Joint a = Rotary("A", Vector3d::UnitY(), kPointC);
  a.table = AngleTable{{1e-4, 1e-4, 1e-4, 1e-4}, {-1e-4, -1e-4, -1e-4, -1e-4}};
  const JointChain chain = Chain({a, Rotary("B", Vector3d::UnitX(), kPointC)}, {});
  const Eigen::VectorXd commanded = Values({0.5, 0.7});
  EXPECT_NEAR(chain.Reached(commanded, {Travel::kForward, Travel::kForward})(0), 0.5001, 1e-15);
  EXPECT_NEAR(chain.Reached(commanded, {Travel::kBackward, Travel::kForward})(0), 0.4999, 1e-15);
  EXPECT_EQ(chain.Reached(commanded, {})(0), 0.5);
  EXPECT_EQ(chain.Reached(commanded, {})(1), 0.7);
  // Not asked: the command is the position.
  EXPECT_EQ(chain.MachineFromZero(commanded).matrix(), Carry(&chain.motion(0), commanded.data(), 2).matrix());
}

}  // namespace
}  // namespace sixpoint::metrology
