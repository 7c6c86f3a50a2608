#include "metrology/inspection/blade_inspection.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <cstring>

#include "tests/metrology/inspection/simulated_pin.h"

namespace sixpoint::metrology {
namespace {

constexpr double kRad = 3.14159265358979323846 / 180;

// A block 30 x 30 x 10 mm whose top is the plane z = 0 of the part.
TriangleMesh Block() {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i) mesh.vertices_mm.emplace_back(i & 1 ? 15 : -15, i & 2 ? 15 : -15, i & 4 ? 0 : -10);
  mesh.triangles = {{4, 5, 7}, {4, 7, 6}, {0, 2, 3}, {0, 3, 1}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  mesh.closed = true;
  return mesh;
}

// A machine with a turned sensor and axes that do not meet; the block stands on it, a pin in each of two holes.
struct Plant {
  SensorPose sensor;
  RotaryAxes axes;
  RegisteredPose pose;
  std::vector<InspectedHole> holes;
  std::vector<SimulatedPin> pins;
  std::vector<double> b_deg = {-60, -20, 20, 60};
  std::shared_ptr<const Surface> surface;
};

Plant MakePlant() {
  Plant plant;
  plant.sensor.rotation = RotationFromCardan({0.14 * kRad, 0.46 * kRad, 0.28 * kRad});
  plant.sensor.t_sm_mm = {14.8, -41.7, 20};
  plant.axes.a = {Eigen::Vector3d(1e-4, 1, -2e-4).normalized(), {26.6, 54.9, -193.1}};
  plant.axes.b = {Eigen::Vector3d(1, -1e-4, 3e-4).normalized(), {26.6, 54.87, -193.11}};
  plant.pose.zero_from_part.linear() = RotationFromVector({0.01, -0.02, 0.3});
  plant.pose.zero_from_part.translation() = plant.axes.a.point_mm + Eigen::Vector3d(30, 3, 10);
  plant.pose.noise.reference_mm = plant.pose.sensitivity_reference_mm = plant.pose.zero_from_part.translation();
  const Eigen::Vector3d axis = Eigen::Vector3d(0.3, 0.2, 1).normalized();
  for (int i = 0; i < 2; ++i) {
    InspectedHole hole;
    hole.group = "G1";
    hole.name = "H" + std::to_string(i + 1);
    hole.pin = {{6.0 * i - 3, 2, 0}, axis, Eigen::Vector3d::UnitZ(), 0.44};
    hole.position_tolerance_mm = 0.06;
    hole.inclination_tolerance_rad = 0.5 * kRad;
    SimulatedPin pin;
    pin.start_mm = hole.pin.start_mm + Eigen::Vector3d(0.02 + 0.06 * i, 0.01, 0);  // the second is out of tolerance
    pin.axis = (axis + TangentBasis(axis) * Eigen::Vector2d(2e-3, -3e-3)).normalized();
    plant.holes.push_back(hole);
    plant.pins.push_back(pin);
  }
  plant.surface = *Surface::Prepare(Block());
  return plant;
}

// Part points as the sensor reads them at a pose of the axes; noise along the sensor's z.
LineScan Scanned(const Plant& plant, double b_deg, const Points& in_part, std::mt19937_64* random) {
  std::normal_distribution<double> noise(0, 2e-3);
  LineScan scan;
  scan.b_rad = b_deg * kRad;
  scan.v0_mm = {-60, -87, 264};
  const Eigen::Isometry3d machine_from_part = plant.axes.MachineFromZero(0, scan.b_rad) * plant.pose.zero_from_part;
  Eigen::Matrix3d columns;
  columns << Eigen::Vector3d::UnitX(), plant.sensor.rotation.col(1), plant.sensor.rotation.col(2);
  const Eigen::Matrix3d inverse = columns.inverse();
  for (const Eigen::Vector3d& point : in_part) {
    Eigen::Vector3d in_sensor = inverse * (machine_from_part * point + scan.v0_mm - plant.sensor.t_sm_mm);
    in_sensor.z() += noise(*random);
    scan.points_mm.push_back(in_sensor);
  }
  return scan;
}

std::vector<LineScan> Scans(const Plant& plant, std::mt19937_64* random, int top_count) {
  std::uniform_real_distribution<double> anywhere(-14, 14);
  std::vector<LineScan> scans;
  for (const double b_deg : plant.b_deg) {
    const Eigen::Matrix3d part_from_machine =
        (plant.axes.MachineFromZero(0, b_deg * kRad).linear() * plant.pose.zero_from_part.linear()).transpose();
    const Eigen::Vector3d view = -(part_from_machine * Eigen::Vector3d::UnitZ());
    Points points;
    for (int i = 0; i < top_count; ++i) points.emplace_back(anywhere(*random), anywhere(*random), 0.005);
    for (SimulatedPin pin : plant.pins) {
      pin.noise_mm = 0;  // put in by the sensor
      const Points seen = SeenFrom(pin, {view}, 250, random);
      points.insert(points.end(), seen.begin(), seen.end());
    }
    for (int i = 0; i < 5; ++i) points.emplace_back(anywhere(*random), anywhere(*random), 3.0);  // chips
    scans.push_back(Scanned(plant, b_deg, points, random));
  }
  return scans;
}

absl::StatusOr<BladeFindings> Inspect(const Plant& plant, const std::vector<LineScan>& scans, int threads = 2) {
  InspectionOptions options;
  options.threads = threads;
  BladeInspection inspection(plant.surface, plant.holes, plant.pose, plant.sensor, plant.axes, options);
  for (const LineScan& scan : scans)
    if (absl::Status status = inspection.Add(scan); !status.ok()) return status;
  return inspection.Finish();
}

TEST(BladeInspection, JudgesPinsAndSurface) {
  const Plant plant = MakePlant();
  std::mt19937_64 random(1);
  const auto findings = Inspect(plant, Scans(plant, &random, 4000));
  ASSERT_TRUE(findings.ok()) << findings.status();
  EXPECT_EQ(findings->holes[0].verdict, Verdict::kConform) << findings->holes[0].reason;
  EXPECT_EQ(findings->holes[1].position_verdict, Verdict::kNotConform) << findings->holes[1].reason;
  EXPECT_EQ(findings->holes[1].inclination_verdict, Verdict::kConform);
  EXPECT_EQ(findings->verdict, Verdict::kNotConform);
  for (int i = 0; i < 2; ++i) {
    const HoleError& error = findings->holes[i].error;
    EXPECT_LT((error.start_in_part_mm - plant.pins[i].start_mm).norm(), 1e-3);
    EXPECT_LT((error.axis_in_part - plant.pins[i].axis).norm(), 3e-4);
  }
  // The block's top was put 5 um high; chips and holes are set aside.
  EXPECT_NEAR(findings->deviation.p50_um, 5, 0.2);
  EXPECT_NEAR(findings->deviation.rms_um, std::sqrt(25 + 4), 0.5);
  EXPECT_LT(findings->deviation.maximum_um, 20);
  EXPECT_GT(findings->deviation.minimum_um, -10);
  EXPECT_GE(findings->deviation.excluded_count, 4 * 505);
  EXPECT_EQ(findings->deviation.point_count + findings->deviation.excluded_count, 4 * 4505);
}

TEST(BladeInspection, GivesTheSameBitsOnAnyNumberOfThreads) {
  const Plant plant = MakePlant();
  std::mt19937_64 random(2);
  const std::vector<LineScan> scans = Scans(plant, &random, 20000);
  const auto one = Inspect(plant, scans, 1), four = Inspect(plant, scans, 4);
  ASSERT_TRUE(one.ok() && four.ok());
  EXPECT_EQ(one->deviation.rms_um, four->deviation.rms_um);
  EXPECT_EQ(one->deviation.p95_um, four->deviation.p95_um);
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(one->holes[i].error.position_mm, four->holes[i].error.position_mm);
    EXPECT_EQ(one->holes[i].position_expanded_uncertainty_mm, four->holes[i].position_expanded_uncertainty_mm);
  }
}

// A hole with no pin in it is not measured, and so the blade is no pass.
TEST(BladeInspection, DoesNotPassAHoleWithoutAPin) {
  Plant plant = MakePlant();
  plant.pins.pop_back();
  std::mt19937_64 random(3);
  const auto findings = Inspect(plant, Scans(plant, &random, 1000));
  ASSERT_TRUE(findings.ok());
  EXPECT_EQ(findings->holes[1].verdict, Verdict::kNotMeasured);
  EXPECT_NE(findings->holes[1].reason, "");
  EXPECT_EQ(findings->verdict, Verdict::kNotMeasured);
}

// Wrong calibrations and a pose that follows them: the stated uncertainty holds as often as k = 2 says.
TEST(BladeInspection, StatesUncertaintiesThatDrawsConfirm) {
  const Plant truth = MakePlant();
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal;
  RegisteredPose pose = truth.pose;
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 14; ++j) {
      const bool angle_in = j < 3 || j == 6 || j == 7 || j == 10 || j == 11;
      pose.calibration_sensitivity(i, j) = normal(random) * (i < 3 ? 0.01 : 0.7) * (angle_in ? 40 : 1);
    }
  const auto diagonal = [](double angle, double length, int j) {
    const bool angle_in = j < 3 || j == 6 || j == 7 || j == 10 || j == 11;
    return std::pow(angle_in ? angle : length, 2);
  };
  for (int j = 0; j < 14; ++j) pose.calibration_covariance(j, j) = diagonal(1e-5, 6e-4, j);
  for (int j = 0; j < 6; ++j) pose.noise.values(j, j) = std::pow(j < 3 ? 5e-6 : 2e-4, 2);

  constexpr int kDraws = 200;
  int position_inside = 0, inclination_inside = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    const std::vector<LineScan> scans = Scans(truth, &random, 10);
    Eigen::Matrix<double, 14, 1> calibration;
    for (int j = 0; j < 14; ++j) calibration[j] = std::sqrt(pose.calibration_covariance(j, j)) * normal(random);
    Vector6d noise;
    for (int j = 0; j < 6; ++j) noise[j] = std::sqrt(pose.noise.values(j, j)) * normal(random);
    Plant estimate = truth;
    estimate.pose = pose;
    estimate.sensor.rotation = RotationFromVector(calibration.head<3>()) * truth.sensor.rotation;
    estimate.sensor.t_sm_mm += calibration.segment<3>(3);
    estimate.axes = truth.axes.Perturbed(calibration.tail<8>());
    estimate.pose.zero_from_part =
        Perturbed(truth.pose.zero_from_part, pose.calibration_sensitivity * calibration, pose.sensitivity_reference_mm);
    estimate.pose.zero_from_part = Perturbed(estimate.pose.zero_from_part, noise, pose.noise.reference_mm);
    const auto findings = Inspect(estimate, scans, 1);
    ASSERT_TRUE(findings.ok());
    for (int i = 0; i < 2; ++i) {
      const HoleFinding& finding = findings->holes[i];
      ASSERT_NE(finding.verdict, Verdict::kNotMeasured) << finding.reason;
      const double position = (truth.pins[i].start_mm - truth.holes[i].pin.start_mm).norm();
      const double inclination = std::acos(truth.pins[i].axis.dot(truth.holes[i].pin.axis));
      position_inside += std::abs(finding.error.position_mm - position) <= finding.position_expanded_uncertainty_mm;
      inclination_inside +=
          std::abs(finding.error.inclination_rad - inclination) <= finding.inclination_expanded_uncertainty_rad;
      EXPECT_LT(finding.position_expanded_uncertainty_mm, 5e-3);
    }
  }
  // 95.4 % of 400 (two holes that share a calibration), within about four standard deviations.
  EXPECT_GT(position_inside, 0.90 * 2 * kDraws);
  EXPECT_LT(position_inside, 0.99 * 2 * kDraws);
  EXPECT_GT(inclination_inside, 0.90 * 2 * kDraws);
  EXPECT_LT(inclination_inside, 0.99 * 2 * kDraws);
}

TEST(BladeInspection, StopsWhenTheCallerIsGone) {
  const Plant plant = MakePlant();
  std::mt19937_64 random(5);
  InspectionOptions options;
  options.keep_going = [] { return false; };
  BladeInspection inspection(plant.surface, plant.holes, plant.pose, plant.sensor, plant.axes, options);
  EXPECT_EQ(inspection.Add(Scans(plant, &random, 10)[0]).code(), absl::StatusCode::kCancelled);
}

TEST(BladeInspection, RefusesTooManyPointsAndScansOfSomethingElse) {
  const Plant plant = MakePlant();
  std::mt19937_64 random(6);
  InspectionOptions options;
  options.greatest_point_count = 100;
  BladeInspection small(plant.surface, plant.holes, plant.pose, plant.sensor, plant.axes, options);
  EXPECT_EQ(small.Add(Scans(plant, &random, 10)[0]).code(), absl::StatusCode::kResourceExhausted);
  const Points far(50, Eigen::Vector3d(0, 0, 40));
  const auto findings = Inspect(plant, {Scanned(plant, 0, far, &random)});
  EXPECT_EQ(findings.status().code(), absl::StatusCode::kFailedPrecondition);
}

}  // namespace
}  // namespace sixpoint::metrology
