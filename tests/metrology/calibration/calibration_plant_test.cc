// Calibration of the plant in shared/data/plant-a against what only its simulator knows.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "metrology/calibration/rotation_calibration.h"
#include "metrology/calibration/sensor_calibration.h"
#include "metrology/cloud/draco_codec.h"
#include "metrology/frames/angles.h"

namespace sixpoint::metrology {
namespace {

using nlohmann::json;

Eigen::Vector3d Vector(const json& j) { return {j.at(0).get<double>(), j.at(1).get<double>(), j.at(2).get<double>()}; }

class PlantA : public ::testing::Test {
 protected:
  void SetUp() override {
    const char* shared = std::getenv("SIXPOINT_SHARED_DIR");
    folder = std::string(shared == nullptr ? "../shared" : shared) + "/data/plant-a";
    std::ifstream data_file(folder + "/dataset.json"), truth_file(folder + "/truth.json");
    if (!data_file || !truth_file) GTEST_SKIP() << folder << " is absent: set SIXPOINT_SHARED_DIR";
    data = json::parse(data_file);
    truth = json::parse(truth_file);
  }

  LineScan Load(const std::string& id) const {
    for (const json& s : data.at("scans")) {
      if (s.at("id") != id) continue;
      std::ifstream file(folder + "/" + s.at("file").get<std::string>(), std::ios::binary);
      const std::string bytes((std::istreambuf_iterator<char>(file)), {});
      absl::StatusOr<Points> points = DecodeBlock(bytes, s.at("point_count").get<std::int64_t>());
      EXPECT_TRUE(points.ok()) << points.status();
      LineScan scan;
      scan.id = id;
      scan.v0_mm = Vector(s.at("v0_mm"));
      if (points.ok()) scan.points_mm = *std::move(points);
      return scan;
    }
    ADD_FAILURE() << "no scan " << id;
    return {};
  }

  std::string folder;
  json data, truth;
};

TEST_F(PlantA, SensorIsWithinThreeStandardUncertaintiesOfTheTruth) {
  const json& record = data.at("artefact");
  Artefact artefact;
  artefact.side_mm = 24;
  for (const auto& [name, at] : record.at("cones_mm").items())
    artefact.cones.push_back({name, {at.at(0).get<double>(), at.at(1).get<double>()}});
  for (const auto& [name, at] : record.at("slots_mm").items())
    artefact.slots.push_back({name, {at.at(0).get<double>(), at.at(1).get<double>()}});
  artefact.cone_half_angle_rad = record.at("cone_half_angle_deg").get<double>() * kRadPerDeg;
  artefact.cone_top_radius_mm = record.at("cone_top_radius_mm");
  artefact.cone_bottom_radius_mm = record.at("cone_bottom_radius_mm");
  artefact.slot_width_mm = record.at("slot_width_mm");
  artefact.slot_depth_mm = record.at("slot_depth_mm");
  ArtefactTouch touch;
  const json& probe = data.at("touch_probe");
  for (const auto& [name, at] : probe.at("centres").items()) touch.centres.push_back({name, Vector(at)});
  for (const json& p : probe.at("plane")) touch.plane_mm.push_back(Vector(p));
  for (const json& p : probe.at("side_x")) touch.side_x_mm.push_back(Vector(p));
  for (const json& p : probe.at("side_y")) touch.side_y_mm.push_back(Vector(p));
  SensorCalibrationOptions options;
  options.threads = 2;
  options.optics.mid_range_mm = data.at("sensor").at("mid_range_mm");
  const auto result = CalibrateSensor({Load("artefact_1"), Load("artefact_2")}, artefact, touch, options);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_TRUE(result->converged);

  Eigen::Matrix3d rotation;
  for (int i = 0; i < 9; ++i) rotation(i / 3, i % 3) = truth.at("machine_from_sensor_rotation").at(i / 3).at(i % 3);
  Vector6d error;
  error << VectorFromRotation(result->sensor.rotation * rotation.transpose()),
      result->sensor.t_sm_mm - Vector(truth.at("T_sm_mm"));
  for (int k = 0; k < 6; ++k) EXPECT_LT(std::abs(error(k)), 3 * std::sqrt(result->sensor.covariance(k, k))) << k;
  EXPECT_LT(error.head<3>().cwiseAbs().maxCoeff(), 0.0015 * kRadPerDeg);  // the plant's judge, level full
  EXPECT_LT(error.tail<3>().cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_NEAR(result->noise_mm, 2e-3, 0.05e-3);
  // Slots: within half the pitch of the profiles (50 um) in x, a touch in y and z.
  EXPECT_EQ(result->check.size(), 6u);
  for (const CentreResidual& c : result->check) {
    EXPECT_LT(std::abs(c.laser_minus_touch_mm.x()), 25e-3) << c.scan << " " << c.feature;
    EXPECT_LT(c.laser_minus_touch_mm.tail<2>().norm(), 5e-3) << c.scan << " " << c.feature;
  }
}

TEST_F(PlantA, AxesCarryAPointWithinTwoMicrometres) {
  std::vector<SpherePose> poses;
  for (const json& p : data.at("sphere_poses"))
    poses.push_back({p.at("a_deg").get<double>() * kRadPerDeg, p.at("b_deg").get<double>() * kRadPerDeg,
                     Vector(p.at("centre_mm")), p.at("use") != "fit"});
  RotationOptions options;
  options.nominal.a.point_mm = options.nominal.b.point_mm = Vector(data.at("machine").at("nominal_centre_mm"));
  const auto result = CalibrateRotation(poses, options);
  ASSERT_TRUE(result.ok()) << result.status();
  RotaryAxes axes{{Vector(truth.at("a_axis").at("direction")).normalized(), Vector(truth.at("a_axis").at("point"))},
                  {Vector(truth.at("b_axis").at("direction")).normalized(), Vector(truth.at("b_axis").at("point"))}};
  Eigen::Isometry3d zero_from_part;
  for (int i = 0; i < 16; ++i) zero_from_part.matrix()(i / 4, i % 4) = truth.at("zero_from_part").at(i / 4).at(i % 4);
  for (const json& group : data.at("part").at("hole_groups"))
    for (const json& hole : group.at("holes")) {
      const Eigen::Vector3d p = zero_from_part * Vector(hole.at("start_in_part_mm"));
      for (int a = -30; a <= 60; a += 30)
        for (int b = 0; b < 360; b += 45) {
          const Eigen::Vector3d error = result->axes.MachineFromZero(a * kRadPerDeg, b * kRadPerDeg) * p -
                                        axes.MachineFromZero(a * kRadPerDeg, b * kRadPerDeg) * p;
          EXPECT_LT(error.norm(), 2e-3) << "A " << a << " B " << b;
          const Eigen::Matrix<double, 3, 8> jacobian =
              result->axes.ParameterJacobian(p, a * kRadPerDeg, b * kRadPerDeg);
          const Eigen::Matrix3d covariance = jacobian * result->covariance * jacobian.transpose();
          for (int k = 0; k < 3; ++k) EXPECT_LT(std::abs(error(k)), 3.5 * std::sqrt(covariance(k, k)) + 1e-7);
        }
    }
  EXPECT_LT(result->check_rms_mm, 1.7e-3);
}

}  // namespace
}  // namespace sixpoint::metrology
