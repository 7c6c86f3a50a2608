#include "services/correction/validate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/correction/machine_axes.h"
#include "services/runtime/errors.h"

namespace sixpoint::correction {
namespace {

using ::testing::HasSubstr;

constexpr char kRegistration[] = "registrations/00000000-0000-7000-8000-000000000003";

std::string Refusal(const v1::CorrectRequest& request) {
  const absl::Status checked = CheckCorrect(request);
  EXPECT_EQ(checked.code(), absl::StatusCode::kInvalidArgument);
  return std::string(checked.message());
}

TEST(CheckCorrect, NamesTheField) {
  v1::CorrectRequest request;
  EXPECT_THAT(Refusal(request), HasSubstr("registration: "));
  request.set_registration("scans/s1");
  EXPECT_THAT(Refusal(request), HasSubstr("scans/s1"));
  request.set_registration("registrations/r1");
  EXPECT_THAT(Refusal(request), HasSubstr("registration"));
  request.set_registration(kRegistration);
  EXPECT_TRUE(CheckCorrect(request).ok());
  request.add_groups("G1");
  request.add_groups("G1");
  EXPECT_THAT(Refusal(request), HasSubstr("groups[1]"));
}

TEST(CheckCorrect, AModelSaysItsTemplateOffsetsAndToolsItself) {
  v1::CorrectRequest request;
  request.set_registration(kRegistration);
  request.set_machining_model("machining_models/edm@2");
  EXPECT_TRUE(CheckCorrect(request).ok());
  request.set_nc_template("X1");
  request.add_work_offsets()->set_code("G54");
  request.add_tool_lengths()->set_number(1);
  const std::string refusal = Refusal(request);
  EXPECT_THAT(refusal, HasSubstr("nc_template: 2 bytes, want none beside machining_model"));
  EXPECT_THAT(refusal, HasSubstr("work_offsets: 1 offsets"));
  EXPECT_THAT(refusal, HasSubstr("tool_lengths: 1 tools"));
  request.set_machining_model("edm");
  EXPECT_THAT(Refusal(request), HasSubstr("machining_model: edm"));
}

plant::v1::Machine TwoAxes() {
  plant::v1::Machine machine;
  machine.set_name("machines/m1");
  for (int i = 0; i < 2; ++i) {
    plant::v1::Joint& joint = *machine.mutable_kinematics()->add_part_side();
    joint.set_axis(i == 0 ? "A" : "B");
    joint.set_kind(plant::v1::JOINT_KIND_ROTARY);
    (i == 0 ? joint.mutable_direction()->set_y(1) : joint.mutable_direction()->set_x(1));
    joint.mutable_point_mm();
    joint.set_sign(i == 0 ? 1 : -1);
    joint.set_minimum(-90);
    joint.set_maximum(180);
  }
  return machine;
}

TEST(AxesOf, ReadsDirectionsWithTheirSense) {
  const auto axes = AxesOf(TwoAxes());
  ASSERT_TRUE(axes.ok()) << axes.status();
  EXPECT_EQ(axes->nominal.a.direction, Eigen::Vector3d(Eigen::Vector3d::UnitY()));
  EXPECT_EQ(axes->nominal.b.direction, Eigen::Vector3d(-Eigen::Vector3d::UnitX()));
  EXPECT_NEAR(axes->limits.a_minimum_rad, -1.5707963267948966, 1e-15);
  EXPECT_NEAR(axes->limits.b_maximum_rad, 3.1415926535897931, 1e-15);
}

TEST(AxesOf, RefusesOtherKinematics) {
  plant::v1::Machine one = TwoAxes();
  one.mutable_kinematics()->mutable_part_side()->RemoveLast();
  EXPECT_EQ(runtime::ReasonOf(AxesOf(one).status()), "KINEMATICS_UNSUPPORTED");
  plant::v1::Machine head = TwoAxes();
  *head.mutable_kinematics()->add_tool_side() = head.kinematics().part_side(1);
  EXPECT_EQ(runtime::ReasonOf(AxesOf(head).status()), "KINEMATICS_UNSUPPORTED");
  plant::v1::Machine empty = TwoAxes();
  empty.mutable_kinematics()->mutable_part_side(0)->set_maximum(-90);
  EXPECT_EQ(runtime::ReasonOf(AxesOf(empty).status()), "KINEMATICS_UNSUPPORTED");
}

TEST(LimitsOf, AreTheRecords) {
  plant::v1::Machine machine;
  machine.mutable_safety_envelope()->set_translation_mm(0.5);
  machine.mutable_safety_envelope()->set_rotation_deg(3);
  const metrology::GateLimits limits = LimitsOf(machine);
  EXPECT_EQ(limits.translation_mm, 0.5);
  EXPECT_NEAR(limits.rotation_rad, 0.0523598775598299, 1e-15);
  EXPECT_EQ(limits.uncertainty_share, 0);  // 0 is 0: every correction waits
}

// The tool's joints move it; those under the part move it the other way.
TEST(TravelOf, IsOfTheLinearJoints) {
  plant::v1::Machine machine = TwoAxes();
  plant::v1::Joint& z = *machine.mutable_kinematics()->add_tool_side();
  z.set_axis("Z");
  z.set_kind(plant::v1::JOINT_KIND_LINEAR);
  z.mutable_direction()->set_z(1);
  z.set_sign(1);
  z.set_minimum(-100);
  z.set_maximum(50);
  plant::v1::Joint& x = *machine.mutable_kinematics()->add_part_side();
  x = z;
  x.set_axis("X");
  x.mutable_direction()->set_z(0);
  x.mutable_direction()->set_x(1);
  const auto travel = TravelOf(machine, std::nullopt);
  ASSERT_TRUE(travel.ok()) << travel.status();
  ASSERT_EQ(travel->size(), 2u);
  EXPECT_EQ((*travel)[0].axis, "X");
  EXPECT_EQ((*travel)[0].direction, Eigen::Vector3d(-1, 0, 0));
  EXPECT_EQ((*travel)[1].direction, Eigen::Vector3d(0, 0, 1));
  EXPECT_EQ((*travel)[1].minimum_mm, -100);
}

// The spindle's own axis is no way for the tip to go: it takes its part of the way, or may stand anywhere.
TEST(TravelOf, WTakesItsPartFromTheAxesAlongIt) {
  plant::v1::Machine machine = TwoAxes();
  const auto add = [&](const char* axis, double y, double z, double sign, double least, double most) {
    plant::v1::Joint& joint = *machine.mutable_kinematics()->add_tool_side();
    joint.set_axis(axis);
    joint.set_kind(plant::v1::JOINT_KIND_LINEAR);
    joint.mutable_direction()->set_y(y);
    joint.mutable_direction()->set_z(z);
    joint.set_sign(sign);
    joint.set_minimum(least);
    joint.set_maximum(most);
  };
  add("Y", 1, 0, 1, -10, 10);
  add("Z", 0, 1, 1, -100, 50);
  add("W", 0, 1, -1, -20, 5);  // a positive command goes down
  const auto at_four = TravelOf(machine, 4.0), anywhere = TravelOf(machine, std::nullopt);
  ASSERT_TRUE(at_four.ok() && anywhere.ok());
  ASSERT_EQ(at_four->size(), 2u);
  EXPECT_EQ((*at_four)[0].minimum_mm, -10);
  EXPECT_EQ((*at_four)[0].maximum_mm, 10);
  EXPECT_EQ((*at_four)[1].minimum_mm, -104);
  EXPECT_EQ((*at_four)[1].maximum_mm, 46);
  // 20 mm up to 5 mm down: what Z reaches wherever W stands.
  EXPECT_EQ((*anywhere)[1].minimum_mm, -80);
  EXPECT_EQ((*anywhere)[1].maximum_mm, 45);
}

}  // namespace
}  // namespace sixpoint::correction
