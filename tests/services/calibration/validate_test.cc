#include "services/calibration/validate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "services/calibration/inputs.h"
#include "services/calibration/readings.h"
#include "services/calibration/validity.h"

namespace sixpoint::calibration {
namespace {

using ::testing::HasSubstr;

std::string Message(const absl::Status& status) { return std::string(status.message()); }

v1::CalibrateSensorRequest GoodSensorRequest() {
  v1::CalibrateSensorRequest request;
  request.set_machine("machines/m1");
  request.set_artefact("artefacts/a1");
  request.add_scans("scans/s1");
  request.add_scans("scans/s2");
  for (const char* name : {"C1", "C2", "C3"}) {
    v1::NamedPoint* centre = request.mutable_touch()->add_centres();
    centre->set_feature(name);
    centre->mutable_point_mm()->set_x_mm(200);
  }
  return request;
}

TEST(Validate, AcceptsAGoodSensorRequest) {
  EXPECT_TRUE(CheckRequest(GoodSensorRequest()).ok());
  const auto touch = TouchOf(GoodSensorRequest().touch());
  ASSERT_TRUE(touch.ok()) << touch.status();
  EXPECT_EQ(touch->centres.size(), 3u);
  EXPECT_EQ(touch->centres[1].point_mm.x(), 200);
}

TEST(Validate, NamesTheFieldOfASensorRequest) {
  v1::CalibrateSensorRequest request = GoodSensorRequest();
  request.set_machine("m1");
  EXPECT_THAT(Message(CheckRequest(request)), HasSubstr("machine: m1"));
  request = GoodSensorRequest();
  request.set_scans(1, "scans/s1");
  EXPECT_THAT(Message(CheckRequest(request)), HasSubstr("scans[1]: scans/s1, want each scan once"));
  request = GoodSensorRequest();
  request.clear_scans();
  EXPECT_THAT(Message(CheckRequest(request)), HasSubstr("scans: 0 scans"));
  request = GoodSensorRequest();
  request.clear_touch();
  EXPECT_THAT(Message(CheckRequest(request)), HasSubstr("touch: empty"));
}

TEST(Validate, RefusesTouchDataThatAreNotNumbers) {
  v1::TouchData touch = GoodSensorRequest().touch();
  touch.mutable_centres(2)->mutable_point_mm()->set_z_mm(NAN);
  EXPECT_THAT(Message(TouchOf(touch).status()), HasSubstr("touch.centres[2].point_mm.z_mm: NaN"));
  touch = GoodSensorRequest().touch();
  touch.add_plane_mm()->set_x_mm(INFINITY);
  EXPECT_THAT(Message(TouchOf(touch).status()), HasSubstr("touch.plane_mm[0].x_mm: inf"));
  touch = GoodSensorRequest().touch();
  touch.set_standard_uncertainty_um(-1);
  EXPECT_THAT(Message(TouchOf(touch).status()), HasSubstr("standard_uncertainty_um: -1"));
  touch = GoodSensorRequest().touch();
  touch.mutable_centres(0)->clear_point_mm();
  EXPECT_THAT(Message(TouchOf(touch).status()), HasSubstr("touch.centres[0].point_mm"));
}

TEST(Validate, ValidityIsThirtyDaysUnlessSaid) {
  const storage::Instant now = std::chrono::system_clock::now();
  const auto usual = ValidityOf(nullptr, nullptr, now);
  ASSERT_TRUE(usual.ok());
  EXPECT_EQ(usual->from, now);
  EXPECT_EQ(usual->until - usual->from, std::chrono::hours(30 * 24));
  google::protobuf::Timestamp from, until;
  from.set_seconds(1'800'000'000);
  until.set_seconds(1'799'999'999);
  EXPECT_THAT(Message(ValidityOf(&from, &until, now).status()), HasSubstr("valid_until: 1799999999 s"));
  until.set_nanos(-1);
  EXPECT_FALSE(ValidityOf(&from, &until, now).ok());
}

TEST(Validate, RefusesScansOfOtherThings) {
  const v1::CalibrateSensorRequest request = GoodSensorRequest();
  ingest::v1::Scan scan;
  scan.set_name("scans/s1");
  scan.mutable_header()->set_machine("machines/m1");
  scan.mutable_header()->set_subject("artefacts/a1");
  EXPECT_TRUE(CheckScan(request, scan, scan).ok());
  ingest::v1::Scan other = scan;
  other.mutable_header()->set_machine("machines/m2");
  EXPECT_THAT(Message(CheckScan(request, other, scan)), HasSubstr("scans/s1 of machines/m2"));
  other = scan;
  other.mutable_header()->set_subject("blades/sn1");
  EXPECT_THAT(Message(CheckScan(request, other, scan)), HasSubstr("scans/s1 of blades/sn1"));
  other = scan;
  other.mutable_header()->set_b_deg(30);
  EXPECT_THAT(Message(CheckScan(request, other, scan)), HasSubstr("A and B as in scans/s1"));
}

TEST(Validate, NamesThePoseThatIsWrong) {
  v1::CalibrateRotationRequest request;
  request.set_machine("machines/m1");
  request.add_poses()->mutable_centre_mm();
  request.add_poses()->set_a_deg(NAN);
  EXPECT_TRUE(CheckRequest(request).ok());
  EXPECT_THAT(Message(PosesOf(request).status()), HasSubstr("poses[1].a_deg: NaN"));
  request.mutable_poses(1)->set_a_deg(10);
  EXPECT_THAT(Message(PosesOf(request).status()), HasSubstr("poses[1].centre_mm: empty"));
}

plant::v1::Joint* AddRotary(plant::v1::Machine* machine, const std::string& axis, double x, double y, double sign) {
  plant::v1::Joint* joint = machine->mutable_kinematics()->add_part_side();
  joint->set_axis(axis);
  joint->set_kind(plant::v1::JOINT_KIND_ROTARY);
  joint->mutable_direction()->set_x(x);
  joint->mutable_direction()->set_y(y);
  joint->set_sign(sign);
  return joint;
}

TEST(Validate, TakesTheAxesFromTheMachinesRecord) {
  plant::v1::Machine machine;
  machine.set_name("machines/m1");
  machine.mutable_nominal_centre_mm()->set_z_mm(-193);
  AddRotary(&machine, "A", 0, 1, 1);
  EXPECT_EQ(RotationOptionsOf(machine).status().code(), absl::StatusCode::kFailedPrecondition);
  AddRotary(&machine, "B", 1, 0, -1)->mutable_point_mm()->set_z_mm(-190);
  const auto options = RotationOptionsOf(machine);
  ASSERT_TRUE(options.ok()) << options.status();
  const metrology::RotaryAxes* axes = &options->nominal;
  EXPECT_EQ(axes->a.direction, Eigen::Vector3d::UnitY());
  EXPECT_EQ(axes->a.point_mm.z(), -193);
  EXPECT_EQ(axes->b.direction, Eigen::Vector3d(-1, 0, 0));
  EXPECT_EQ(axes->b.point_mm.z(), -190);
}

}  // namespace
}  // namespace sixpoint::calibration
