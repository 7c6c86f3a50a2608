#include "metrology/correction/correct.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "metrology/frames/angles.h"
#include "tests/metrology/correction/some_path.h"

namespace sixpoint::metrology {
namespace {

using nlohmann::json;

Eigen::Vector3d Vector(const json& values) {
  return Eigen::Vector3d(values[0].get<double>(), values[1].get<double>(), values[2].get<double>());
}
Eigen::Isometry3d Transform(const json& rows) {
  Eigen::Isometry3d transform = Eigen::Isometry3d::Identity();
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 4; ++j) transform.matrix()(i, j) = rows[i][j].get<double>();
  return transform;
}

struct GroupCase {
  NominalHoleGroup group;
  RegisteredPose pose = ExactPose(Eigen::Isometry3d::Identity());
  CalibrationCovariance calibrations = CalibrationCovariance::Zero();  // of pose.sources
  PoseSensitivity sensitivity = PoseSensitivity::Zero();
  Eigen::Isometry3d nominal = Eigen::Isometry3d::Identity();
  RotaryAxes axes;
};

// A blade some centimetres from the axes, and covariances of a fair plant, all correlated.
GroupCase SomeCase(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const auto vector = [&](double scale) -> Eigen::Vector3d {
    return Eigen::Vector3d(normal(random), normal(random), normal(random)) * scale;
  };
  GroupCase c;
  c.axes.a = {Eigen::Vector3d(1e-4, 1, -2e-4).normalized(), {26.63, 54.88, -193.1}};
  c.axes.b = {Eigen::Vector3d(1, -1e-4, 3e-4).normalized(), {26.63, 54.87, -193.11}};
  c.nominal.linear() = RotationFromVector(vector(1));
  c.nominal.translation() = c.axes.a.point_mm + Eigen::Vector3d(40, 5, 10);
  c.pose.zero_from_part = c.nominal;
  c.pose.zero_from_part.linear() = RotationFromVector(vector(0.01)) * c.nominal.linear();
  c.pose.zero_from_part.translation() += vector(0.3);
  c.pose.noise.reference_mm = c.nominal.translation() + vector(3);
  const auto random_covariance = [&](int size, const auto& scale) {
    Eigen::MatrixXd factor(size, size);
    for (int i = 0; i < size; ++i)
      for (int j = 0; j < size; ++j) factor(i, j) = normal(random) * scale(i) / std::sqrt(size);
    return Eigen::MatrixXd(factor * factor.transpose());
  };
  c.pose.noise.values = random_covariance(6, [](int i) { return i < 3 ? 3e-6 : 2e-4; });
  c.calibrations.topLeftCorner<6, 6>() = random_covariance(6, [](int i) { return i < 3 ? 1e-5 : 5e-4; });
  c.calibrations.block<8, 8>(6, 6) = random_covariance(8, [](int i) { return i % 4 < 2 ? 1e-5 : 6e-4; });
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 14; ++j) {
      const bool angle_in = j < 3 || (j >= 6 && j % 4 >= 2 && j % 4 < 4);
      const double scale = (i < 3 ? 0.01 : 1) * (angle_in ? 50 : 1);
      c.sensitivity(i, j) = normal(random) * scale * 0.5;
    }
  c.pose.sources = {SourceOf("calibrations", c.calibrations)};
  ActOnPose(c.sensitivity, &c.pose.sources);
  c.group.name = "G";
  c.group.nominal = {2 * kRadPerDeg, 40 * kRadPerDeg};
  // Along Z at the nominal pose.
  c.group.axis_in_part = c.nominal.linear().transpose() *
                         c.axes.MachineFromZero(2 * kRadPerDeg, 40 * kRadPerDeg).linear().transpose() *
                         Eigen::Vector3d::UnitZ();
  c.group.holes = {{"H1", {1, 2, 3}}, {"H2", {-20, 5, 8}}, {"H3", {12, -30, 1}}};
  return c;
}

TEST(CorrectGroup, GivesTheNominalWhereTheBladeIsNominal) {
  GroupCase c = SomeCase(1);
  c.pose.zero_from_part = c.nominal;
  const auto corrected = CorrectGroup(c.group, c.pose, c.nominal, c.axes, RotaryAxes(), kWideLimits);
  ASSERT_TRUE(corrected.ok()) << corrected.status();
  EXPECT_NEAR(corrected->corrected.a_rad, corrected->nominal.a_rad, 1e-12);
  EXPECT_NEAR(corrected->corrected.b_rad, corrected->nominal.b_rad, 1e-12);
  for (const CorrectedHole& hole : corrected->holes) EXPECT_LT((hole.start_mm - hole.nominal_start_mm).norm(), 1e-9);
}

// Where the whole plant (blade and axes) is shifted, the corrected starts are shifted by as much.
TEST(CorrectGroup, MovesWithTheMachinesOrigin) {
  GroupCase c = SomeCase(2);
  const auto before = CorrectGroup(c.group, c.pose, c.nominal, c.axes, RotaryAxes(), kWideLimits);
  const Eigen::Vector3d shift(100, -200, 300);
  c.pose.zero_from_part.translation() += shift;
  c.pose.noise.reference_mm += shift;
  c.nominal.translation() += shift;
  c.axes.a.point_mm += shift;
  c.axes.b.point_mm += shift;
  const auto after = CorrectGroup(c.group, c.pose, c.nominal, c.axes, RotaryAxes(), kWideLimits);
  ASSERT_TRUE(before.ok() && after.ok());
  EXPECT_NEAR(after->corrected.a_rad, before->corrected.a_rad, 1e-14);
  for (std::size_t i = 0; i < before->holes.size(); ++i) {
    EXPECT_LT((after->holes[i].start_mm - before->holes[i].start_mm - shift).norm(), 1e-9);
    EXPECT_NEAR(after->holes[i].expanded_uncertainty_um, before->holes[i].expanded_uncertainty_um, 1e-4);
  }
}

// What the product claims, against draws of noise and calibration carried through the exact chain.
TEST(CorrectGroup, StatesUncertaintiesThatDrawsConfirm) {
  for (const std::uint64_t seed : {3, 4}) {
    const GroupCase c = SomeCase(seed);
    const auto stated = CorrectGroup(c.group, c.pose, c.nominal, c.axes, RotaryAxes(), kWideLimits);
    ASSERT_TRUE(stated.ok()) << stated.status();
    const Eigen::MatrixXd noise_factor = c.pose.noise.values.llt().matrixL();
    const Eigen::MatrixXd calibration_factor = c.calibrations.topLeftCorner<14, 14>().llt().matrixL();
    std::mt19937_64 random(100 + seed);
    std::normal_distribution<double> normal;
    const auto draw = [&](const Eigen::MatrixXd& factor) {
      Eigen::VectorXd values(factor.cols());
      for (double& value : values) value = normal(random);
      return Eigen::VectorXd(factor * values);
    };
    constexpr int kDraws = 4000;
    std::vector<int> inside(c.group.holes.size());
    double a_squares = 0, b_squares = 0;
    for (int i = 0; i < kDraws; ++i) {
      const Eigen::VectorXd calibration = draw(calibration_factor);
      Eigen::Isometry3d pose =
          Perturbed(c.pose.zero_from_part, c.sensitivity.leftCols<14>() * calibration, c.pose.noise.reference_mm);
      pose = Perturbed(pose, draw(noise_factor), c.pose.noise.reference_mm);
      const RotaryAxes axes = c.axes.Perturbed(calibration.tail<8>());
      const auto angles = Orient(axes, pose.linear() * c.group.axis_in_part, c.group.nominal, kWideLimits);
      ASSERT_TRUE(angles.ok());
      a_squares += std::pow(angles->a_rad - stated->corrected.a_rad, 2);
      b_squares += std::pow(angles->b_rad - stated->corrected.b_rad, 2);
      const Eigen::Isometry3d machine_from_part = axes.MachineFromZero(angles->a_rad, angles->b_rad) * pose;
      for (std::size_t k = 0; k < inside.size(); ++k) {
        const double distance_um =
            1e3 * (machine_from_part * c.group.holes[k].start_in_part_mm - stated->holes[k].start_mm).norm();
        inside[k] += distance_um <= stated->holes[k].expanded_uncertainty_um;
      }
    }
    for (std::size_t k = 0; k < inside.size(); ++k) {
      EXPECT_GT(stated->holes[k].expanded_uncertainty_um, 0.1);
      EXPECT_GT(100.0 * inside[k] / kDraws, 93) << seed << " " << k;
      EXPECT_LT(100.0 * inside[k] / kDraws, 97) << seed << " " << k;
    }
    EXPECT_NEAR(std::sqrt(a_squares / kDraws) / stated->a_standard_uncertainty_rad, 1, 0.05);
    EXPECT_NEAR(std::sqrt(b_squares / kDraws) / stated->b_standard_uncertainty_rad, 1, 0.05);
  }
}

TEST(CorrectGroup, RefusesNamingTheGroup) {
  GroupCase c = SomeCase(5);
  c.group.axis_in_part = c.pose.zero_from_part.linear().transpose() * c.axes.b.direction;
  const auto singular = CorrectGroup(c.group, c.pose, c.nominal, c.axes, RotaryAxes(), kWideLimits);
  EXPECT_EQ(singular.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_NE(std::string(singular.status().message()).find("group G"), std::string::npos);
  GroupCase bad = SomeCase(5);
  bad.pose.noise.values(2, 2) = NAN;
  EXPECT_EQ(CorrectGroup(bad.group, bad.pose, bad.nominal, bad.axes, RotaryAxes(), kWideLimits).status().code(),
            absl::StatusCode::kInvalidArgument);
}

// Fed with the plant's true pose and axes, the chain gives the plant's true correction.
TEST(CorrectGroup, ReproducesThePlantsTruth) {
  const char* shared = std::getenv("SIXPOINT_SHARED_DIR");
  const std::string folder = std::string(shared ? shared : "") + "/data/plant-a/";
  std::ifstream dataset_file(folder + "dataset.json"), truth_file(folder + "truth.json");
  if (!dataset_file || !truth_file) GTEST_SKIP() << "no plant-a under SIXPOINT_SHARED_DIR";
  const json dataset = json::parse(dataset_file), truth = json::parse(truth_file);
  RotaryAxes axes;
  axes.a = {Vector(truth["a_axis"]["direction"]).normalized(), Vector(truth["a_axis"]["point"])};
  axes.b = {Vector(truth["b_axis"]["direction"]).normalized(), Vector(truth["b_axis"]["point"])};
  const RegisteredPose pose = ExactPose(Transform(truth["zero_from_part"]));
  const Eigen::Isometry3d nominal = Transform(dataset["part"]["zero_from_part_nominal"]);
  int holes = 0;
  for (std::size_t g = 0; g < truth["correction"].size(); ++g) {
    const json& from = dataset["part"]["hole_groups"][g];
    const json& want = truth["correction"][g];
    ASSERT_EQ(from["name"], want["group"]);
    NominalHoleGroup group{
        from["name"],
        Vector(from["axis_in_part"]).normalized(),
        {from["a_nominal_deg"].get<double>() * kRadPerDeg, from["b_nominal_deg"].get<double>() * kRadPerDeg},
        {}};
    for (const json& hole : from["holes"]) group.holes.push_back({hole["name"], Vector(hole["start_in_part_mm"])});
    const auto corrected = CorrectGroup(group, pose, nominal, axes, RotaryAxes(), kWideLimits);
    ASSERT_TRUE(corrected.ok()) << corrected.status();
    EXPECT_NEAR(corrected->ideal.a_rad / kRadPerDeg, want["ideal_axes"]["a_deg"].get<double>(), 1e-9);
    EXPECT_NEAR(corrected->ideal.b_rad / kRadPerDeg, want["ideal_axes"]["b_deg"].get<double>(), 1e-9);
    EXPECT_NEAR(corrected->corrected.a_rad / kRadPerDeg, want["real_axes"]["a_deg"].get<double>(), 1e-9);
    EXPECT_NEAR(corrected->corrected.b_rad / kRadPerDeg, want["real_axes"]["b_deg"].get<double>(), 1e-9);
    for (std::size_t h = 0; h < corrected->holes.size(); ++h, ++holes)
      EXPECT_LT((corrected->holes[h].start_mm - Vector(want["holes"][h]["start_table_mm"])).norm(), 1e-9);
  }
  EXPECT_EQ(holes, 18);
}

// A hole along C on a table of B and C, the part turned by a tenth of a degree: C stays, the start follows, and the tilt that is left is
// said, with its uncertainty.
TEST(CorrectGroup, KeepsCOfAHoleAlongIt) {
  RotaryAxes axes;
  axes.a = {Eigen::Vector3d::UnitY(), {0, 0, -50}};
  axes.b = {Eigen::Vector3d::UnitZ(), {0, 0, -50}};
  NominalHoleGroup group;
  group.name = "G1";
  group.axis_in_part = Eigen::Vector3d::UnitZ();
  group.nominal.b_rad = 30 * kRadPerDeg;
  group.inclination_tolerance_rad = 0.5 * kRadPerDeg;  // a quarter: 0.125 deg
  group.holes = {{"H1", {12, 3, 5}}};
  RegisteredPose pose = ExactPose(Eigen::Isometry3d::Identity());
  pose.zero_from_part.linear() = RotationFromVector({0.1 * kRadPerDeg, 0, 0});
  pose.noise.values = Matrix6d::Identity() * 1e-10;
  const auto corrected = CorrectGroup(group, pose, Eigen::Isometry3d::Identity(), axes, axes, kWideLimits);
  ASSERT_TRUE(corrected.ok()) << corrected.status();
  EXPECT_EQ(corrected->corrected.b_rad, group.nominal.b_rad);
  EXPECT_GT(corrected->tilt_rad, 0.01 * kRadPerDeg);
  EXPECT_LE(corrected->tilt_rad, 0.1 * kRadPerDeg + 1e-12);
  const Eigen::Vector3d want = axes.MachineFromZero(corrected->corrected.a_rad, corrected->corrected.b_rad) *
                               (pose.zero_from_part * Eigen::Vector3d(12, 3, 5));
  EXPECT_LT((corrected->holes[0].start_mm - want).norm(), 1e-12);
  EXPECT_EQ(corrected->b_standard_uncertainty_rad, 0);                // it does not follow
  EXPECT_NEAR(corrected->tilt_standard_uncertainty_rad, 1e-5, 2e-6);  // of one of the two directions
  EXPECT_NEAR(corrected->a_standard_uncertainty_rad, 1e-5, 2e-6);
}

// A part that is warm is drilled where it is; what the tool's tip is off by is a part of U of its own.
TEST(CorrectGroup, DrillsAWarmPartWhereItIsAndCountsTheTool) {
  GroupCase c = SomeCase(3);
  const auto at_20 = CorrectGroup(c.group, c.pose, c.nominal, c.axes, RotaryAxes(), kWideLimits);
  Drilling drilling;
  drilling.stretch = 1 + 12.5e-6 * 5;
  drilling.tool_offset_mm = 1.5e-3;
  const auto warm = CorrectGroup(c.group, c.pose, c.nominal, c.axes, RotaryAxes(), kWideLimits, drilling);
  ASSERT_TRUE(at_20.ok() && warm.ok()) << at_20.status() << warm.status();
  const Eigen::Isometry3d machine_from_zero = c.axes.MachineFromZero(warm->reached.a_rad, warm->reached.b_rad);
  for (std::size_t i = 0; i < c.group.holes.size(); ++i) {
    const Eigen::Vector3d zero = c.pose.zero_from_part * c.group.holes[i].start_in_part_mm;
    EXPECT_LT((warm->holes[i].start_mm -
               machine_from_zero * (c.axes.b.point_mm + drilling.stretch * (zero - c.axes.b.point_mm)))
                  .norm(),
              1e-9);
    // Between two holes 12.5 um in a metre and a kelvin.
    if (i > 0) {
      EXPECT_NEAR((warm->holes[i].start_mm - warm->holes[0].start_mm).norm() /
                      (at_20->holes[i].start_mm - at_20->holes[0].start_mm).norm(),
                  drilling.stretch, 1e-12);
    }
    EXPECT_LT(
        (warm->holes[i].covariance_mm2 - at_20->holes[i].covariance_mm2 - 1.5e-3 * 1.5e-3 * Eigen::Matrix3d::Identity())
            .norm(),
        1e-3 * 1.5e-3 * 1.5e-3);
  }
}

}  // namespace
}  // namespace sixpoint::metrology
