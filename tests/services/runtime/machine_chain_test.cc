#include "services/runtime/machine_chain.h"

#include <gmock/gmock.h>
#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "services/runtime/errors.h"

namespace sixpoint::runtime {
namespace {

using ::testing::HasSubstr;
constexpr double kDeg = M_PI / 180;

plant::v1::Machine Record(const std::string& text) {
  plant::v1::Machine machine;
  EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString(text, &machine));
  return machine;
}

// The SARIX SX200 as the plant's record has it.
constexpr char kSarix[] = R"(
  name: "machines/sarix-1"
  nominal_centre_mm { x_mm: 26.6264 y_mm: 54.8357 z_mm: -193.1341 }
  kinematics {
    part_side { axis: "A" kind: JOINT_KIND_ROTARY direction { y: 1 } sign: 1 minimum: -100 maximum: 100
                point_mm { x_mm: 26.6264 y_mm: 54.8357 z_mm: -193.1341 } }
    part_side { axis: "B" kind: JOINT_KIND_ROTARY direction { x: 1 } sign: 1 minimum: -360 maximum: 360 }
    tool_side { axis: "X" kind: JOINT_KIND_LINEAR direction { x: 1 } sign: 1 minimum: -175 maximum: 175 }
    tool_side { axis: "Y" kind: JOINT_KIND_LINEAR direction { y: 1 } sign: 1 minimum: -100 maximum: 100 }
    tool_side { axis: "Z" kind: JOINT_KIND_LINEAR direction { z: 1 } sign: 1 minimum: -100 maximum: 100 }
  })";

// NRC's tilt-rotary table; its B and C are stated against the sense of their commands.
constexpr char kTiltRotary[] = R"(
  name: "machines/nrc"
  nominal_centre_mm { z_mm: -123.4 }
  kinematics {
    part_side { axis: "X" kind: JOINT_KIND_LINEAR direction { x: 1 } sign: 1 }
    part_side { axis: "Y" kind: JOINT_KIND_LINEAR direction { y: -1 } sign: -1 }
    part_side { axis: "B" kind: JOINT_KIND_ROTARY direction { y: -1 } sign: -1 }
    part_side { axis: "C" kind: JOINT_KIND_ROTARY direction { z: -1 } sign: -1 point_mm { } }
    tool_side { axis: "Z" kind: JOINT_KIND_LINEAR direction { z: 1 } sign: 1 }
  })";

TEST(MachineChain, TheSarixsRecordIsThePapersClosedForm) {
  const auto chain = ChainOf(Record(kSarix));
  ASSERT_TRUE(chain.ok()) << chain.status();
  const Eigen::Vector3d c(26.6264, 54.8357, -193.1341), p(71, 60, -181);
  const double a = 0.7, b = -2.1;
  Eigen::Matrix3d ry, rx;  // CONF 3.1
  ry << std::cos(a), 0, std::sin(a), 0, 1, 0, -std::sin(a), 0, std::cos(a);
  rx << 1, 0, 0, 0, std::cos(b), -std::sin(b), 0, std::sin(b), std::cos(b);
  Eigen::VectorXd at(5);
  at << a, b, 1, 2, 3;
  EXPECT_LT((chain->MachineFromZero(at) * p - (c + ry * rx * (p - c))).norm(), 1e-9);
  EXPECT_LT((chain->MachineFromTool(at).translation() - Eigen::Vector3d(1, 2, 3)).norm(), 1e-9);
  at(0) = 101 * kDeg;
  EXPECT_EQ(chain->CheckLimits(at).message(), "A: 101 deg, want -100 to 100 deg");
  at(0) = 0;
  at(2) = 175.5;
  EXPECT_EQ(chain->CheckLimits(at).message(), "X: 175.5 mm, want -175 to 175 mm");
}

TEST(MachineChain, TheTiltRotaryTablesRecordIsNrcsClosedForm) {
  const auto chain = ChainOf(Record(kTiltRotary));
  ASSERT_TRUE(chain.ok()) << chain.status();
  const double x = 12, y = -34, z = 56, z12 = 123.4, b = 0.7, c = -2.5;
  const double sb = std::sin(b), cb = std::cos(b), sc = std::sin(c), cc = std::cos(c);
  Eigen::Matrix4d closed;                                                        // NRC equation (3)
  closed << cc * cb, sc, -cc * sb, -x * cc * cb - y * sc - (z + z12) * cc * sb,  //
      -sc * cb, cc, sc * sb, x * sc * cb - y * cc + (z + z12) * sc * sb,         //
      sb, 0, cb, -x * sb + (z + z12) * cb - z12,                                 //
      0, 0, 0, 1;
  Eigen::VectorXd at(5);
  at << x, y, b, c, z;
  EXPECT_LT((chain->ZeroFromTool(at).matrix() - closed).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_TRUE(chain->CheckLimits(at).ok());  // none stated
}

TEST(MachineChain, RefusesARecordThatIsNoMachine) {
  plant::v1::Machine machine = Record(kSarix);
  machine.mutable_kinematics()->mutable_part_side(1)->mutable_direction()->set_x(NAN);
  const absl::Status status = ChainOf(machine).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(ReasonOf(status), "KINEMATICS_UNSUITABLE");
  EXPECT_THAT(std::string(status.message()), HasSubstr("machines/sarix-1.kinematics: joint B.direction"));
  machine = Record(kSarix);
  machine.mutable_kinematics()->mutable_tool_side(0)->clear_kind();
  EXPECT_THAT(std::string(ChainOf(machine).status().message()), HasSubstr("joint X.kind"));
}

}  // namespace
}  // namespace sixpoint::runtime
