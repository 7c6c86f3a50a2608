// Every bad input that a calibration meets, over the wire: refused, saying what is missing and what would cure it, with
// nothing stored.
#include <gmock/gmock.h>

#include <algorithm>

#include "tests/services/calibration/calibration_bench.h"

namespace sixpoint::calibration {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class CalibrationBadInputTest : public CalibrationBench {
 protected:
  void TearDown() override {
    EXPECT_EQ(Execute("SELECT count(*) FROM calibrations").Int(0, 0), 0);
    EXPECT_EQ(Execute("SELECT count(*) FROM record_entries WHERE kind = 'calibration'").Int(0, 0), 0);
  }

  // What the service says of it, with its code and reason.
  absl::Status Refusal(const v1::CalibrateSensorRequest& request) {
    v1::Calibration made;
    return runtime::FromGrpc(Call(&v1::CalibrationService::Stub::CalibrateSensor, request, &made));
  }
  absl::Status Refusal(const v1::CalibrateRotationRequest& request) {
    v1::Calibration made;
    return runtime::FromGrpc(Call(&v1::CalibrationService::Stub::CalibrateRotation, request, &made));
  }
  template <typename Request>
  void ExpectWrong(const Request& request, const ::testing::Matcher<std::string>& says) {
    const absl::Status status = Refusal(request);
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << status;
    EXPECT_THAT(std::string(status.message()), says);
    // The kernels' refusals too arrive in parts, at the other end of the wire.
    const std::vector<Violation> violations = ViolationsOf(status);
    ASSERT_FALSE(violations.empty()) << status;
    for (const Violation& violation : violations) {
      EXPECT_THAT(violation.field, ::testing::MatchesRegex("[a-z_]+([].a-zA-Z0-9_[]*)")) << status;
      EXPECT_NE(violation.value, "");
      EXPECT_NE(violation.wanted, "");
    }
  }
  template <typename Request>
  void ExpectUndetermined(const Request& request, const ::testing::Matcher<std::string>& says) {
    const absl::Status status = Refusal(request);
    EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition) << status;
    EXPECT_EQ(runtime::ReasonOf(status), "CALIBRATION_UNDETERMINED");
    EXPECT_THAT(std::string(status.message()), says);
  }
  // The touch data as another unit has them.
  static v1::CalibrateSensorRequest Scaled(v1::CalibrateSensorRequest request, double factor) {
    const auto scale = [&](geometry::v1::Point* p) {
      p->set_x_mm(p->x_mm() * factor);
      p->set_y_mm(p->y_mm() * factor);
      p->set_z_mm(p->z_mm() * factor);
    };
    v1::TouchData& touch = *request.mutable_touch();
    for (v1::NamedPoint& centre : *touch.mutable_centres()) scale(centre.mutable_point_mm());
    for (auto* points : {touch.mutable_plane_mm(), touch.mutable_side_x_mm(), touch.mutable_side_y_mm()})
      for (geometry::v1::Point& point : *points) scale(&point);
    return request;
  }
};

TEST_F(CalibrationBadInputTest, TooFewFeatures) {
  v1::CalibrateSensorRequest request = SensorRequest();
  request.mutable_touch()->mutable_centres()->DeleteSubrange(2, request.touch().centres_size() - 2);
  ExpectWrong(request, HasSubstr("touch.centres: 2 of them, want at least 3"));
  request = SensorRequest();
  request.mutable_touch()->mutable_centres()->DeleteSubrange(1, 1);
  ExpectWrong(request, HasSubstr("touch.centres: no C2, want the centre of every cone: probe it and send it"));
  plant_.artefact.cones.pop_back();
  ExpectWrong(SensorRequest(), HasSubstr("artefact.cones: 2 of them, want 3 to 16"));
}

TEST_F(CalibrationBadInputTest, CollinearFeatures) {
  for (int k = 0; k < 3; ++k)
    plant_.artefact.cones[static_cast<std::size_t>(k)].centre_mm = Eigen::Vector2d(6, 6) * (k - 1);
  plant_.artefact.slots.clear();
  ExpectWrong(SensorRequest(), HasSubstr("artefact.cones: collinear, want three cones that span the plate: collinear "
                                         "ones leave the turn about their line undetermined"));
}

TEST_F(CalibrationBadInputTest, BothScansAtOneHeight) {
  std::mt19937_64 random(5);
  ingest_.scans["scans/low"] = bench_.Scan("low", 10, 2e-3, &random);
  ExpectUndetermined(SensorRequest(), AllOf(HasSubstr("beta (turn about machine Y) is not determined"),
                                            HasSubstr("add a scan with machine Z at least 5 mm away")));
  v1::CalibrateSensorRequest request = SensorRequest();
  request.mutable_scans()->RemoveLast();
  ExpectUndetermined(request, AllOf(HasSubstr("scans: 1, want at least two, at machine Z heights at least 5 mm apart"),
                                    HasSubstr("beta")));
}

TEST_F(CalibrationBadInputTest, AHiddenCone) {
  // Chips on it: no point within 4 mm of its middle.
  metrology::LineScan& low = ingest_.scans["scans/low"];
  const Eigen::Vector2d centre_mm = bench_.artefact.cones[1].centre_mm;
  const Eigen::Vector3d cone = bench_.machine_from_artefact * Eigen::Vector3d(centre_mm.x(), centre_mm.y(), 0);
  const auto hidden = [&](const Eigen::Vector3d& p) {
    const Eigen::Vector3d machine = bench_.sensor.rotation * Eigen::Vector3d(0, p.y(), p.z()) +
                                    Eigen::Vector3d(p.x(), 0, 0) - low.v0_mm + bench_.sensor.t_sm_mm;
    return (machine - cone).head<2>().norm() < 4;
  };
  const std::size_t whole = low.points_mm.size();
  low.points_mm.erase(std::remove_if(low.points_mm.begin(), low.points_mm.end(), hidden), low.points_mm.end());
  ASSERT_LT(low.points_mm.size(), whole);
  ExpectUndetermined(SensorRequest(), AllOf(HasSubstr("scan low: cone C2 not found"),
                                            HasSubstr("uncover it and scan again with all cones in view")));
}

TEST_F(CalibrationBadInputTest, TheWrongArtefact) {
  ingest_.subject = "artefacts/a2";
  ExpectWrong(SensorRequest(), HasSubstr("scans: scans/high of artefacts/a2, want scans of artefacts/a1"));
  // Labelled as this one, but another plate: its cones a third farther apart.
  ingest_.subject = "artefacts/a1";
  ArtefactBench other = bench_;
  for (metrology::PlaneFeature& cone : other.artefact.cones) cone.centre_mm *= 4.0 / 3;
  for (metrology::PlaneFeature& slot : other.artefact.slots) slot.centre_mm *= 4.0 / 3;
  std::mt19937_64 random(6);
  ingest_.scans["scans/high"] = other.Scan("high", 10, 2e-3, &random);
  ExpectUndetermined(SensorRequest(),
                     AllOf(HasSubstr("scan high: the artefact's pattern of cones and slots was not found"),
                           HasSubstr("scan this artefact, with all its cones in view")));
  // Or the other one was touched.
  v1::CalibrateSensorRequest request = SensorRequest();
  for (v1::NamedPoint& centre : *request.mutable_touch()->mutable_centres())
    centre.mutable_point_mm()->set_x_mm(centre.point_mm().x_mm() * 1.1);
  ExpectWrong(request, AllOf(HasSubstr("touch.centres: distances between cones off by up to"),
                             HasSubstr("want the distances of the artefact's record within 0.1 mm")));
}

TEST_F(CalibrationBadInputTest, TouchDataInOtherUnits) {
  ExpectWrong(Scaled(SensorRequest(), 25.4),
              AllOf(HasSubstr("touch.centres: distances between cones off"), HasSubstr("differ by a factor of 25.4"),
                    HasSubstr("send millimetres, these look like other units")));
  ExpectWrong(Scaled(SensorRequest(), 1 / 25.4),
              AllOf(HasSubstr("differ by a factor of 0.03937"), HasSubstr("send millimetres")));
}

TEST_F(CalibrationBadInputTest, ASphereProbedAtOnePoseOnly) {
  v1::CalibrateRotationRequest request = RotationRequest();
  request.mutable_poses()->DeleteSubrange(1, request.poses_size() - 1);
  ExpectUndetermined(request, AllOf(HasSubstr("A axis is not determined: A turns by 0 deg over 1 poses of the fit"),
                                    HasSubstr("probe the sphere over at least 20 deg of A")));
  // The same pose again and again tells no more.
  for (int i = 0; i < 20; ++i) *request.add_poses() = v1::SpherePose(request.poses(0));
  for (v1::SpherePose& pose : *request.mutable_poses()) pose.set_held_out(false);
  ExpectUndetermined(request, HasSubstr("A turns by 0 deg over 21 poses of the fit"));
}

TEST_F(CalibrationBadInputTest, ACloudFromAnotherMachine) {
  ingest_.machine = "machines/m2";
  ExpectWrong(SensorRequest(), HasSubstr("scans: scans/high of machines/m2, want scans of machines/m1"));
  // One labelled as from this machine, but by another one's sensor, which is mounted 3 mm higher: no pose brings both
  // scans onto the touched cones.
  ingest_.machine = "machines/m1";
  ArtefactBench other = bench_;
  other.sensor.t_sm_mm += Eigen::Vector3d(2, -1, 3);
  std::mt19937_64 random(7);
  ingest_.scans["scans/low"] = other.Scan("low", -10, 2e-3, &random);
  ExpectUndetermined(SensorRequest(),
                     AllOf(HasSubstr("scans, V0 and touch data contradict one another by"),
                           HasSubstr("use scans of this artefact as it was probed, all from this machine")));
  // Mounted aside instead: a turn about machine Y takes that up, but the cones' walls do not fit then.
  other.sensor.t_sm_mm = bench_.sensor.t_sm_mm + Eigen::Vector3d(2, -1, 0.5);
  ingest_.scans["scans/low"] = other.Scan("low", -10, 2e-3, &random);
  ExpectUndetermined(SensorRequest(), AllOf(HasSubstr("wall agree with the artefact's record"),
                                            HasSubstr("see that all scans are by this machine's sensor")));
}

TEST_F(CalibrationBadInputTest, WhatThePlantDoesNotKnow) {
  v1::CalibrateSensorRequest sensor = SensorRequest();
  sensor.set_scans(0, "scans/unknown");
  ExpectWrong(sensor, HasSubstr("scans: scans/unknown, want one that the plant knows"));
  v1::CalibrateRotationRequest rotation = RotationRequest();
  rotation.set_machine("machines/other");
  ExpectWrong(rotation, HasSubstr("machine: machines/other, want one that the plant knows"));
}

}  // namespace
}  // namespace sixpoint::calibration
