#include "metrology/studies/arm_study.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "metrology/cloud/draco_codec.h"
#include "metrology/frames/angles.h"
#include "metrology/statistics/spread.h"
#include "tests/metrology/calibration/artefact_sampler.h"

namespace sixpoint::metrology {
namespace {

using nlohmann::json;
using sixpoint::testing::ArtefactBench;
using ::testing::HasSubstr;

// Scans by a sensor that is displaced by known amounts.
struct Bench {
  std::vector<LineScan> scans;
  std::vector<Vector6d> truth;  // rotation vector and t_sm, against the first
  ArtefactBench bench = ArtefactBench::Usual();
};

Bench Displaced(int count, double noise_mm, unsigned seed) {
  Bench b;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, 1);
  const SensorPose first = b.bench.sensor;
  for (int i = 0; i < count; ++i) {
    Vector6d w = Vector6d::Zero();
    if (i > 0)
      for (int k = 0; k < 6; ++k) w(k) = normal(random) * (k < 3 ? 0.005 * kRadPerDeg : 5e-3);
    b.bench.sensor.rotation = RotationFromVector(w.head<3>()) * first.rotation;
    b.bench.sensor.t_sm_mm = first.t_sm_mm + w.tail<3>();
    b.scans.push_back(b.bench.Scan("s" + std::to_string(i), 0, noise_mm, &random));
    b.truth.push_back(w);
  }
  b.bench.sensor = first;
  return b;
}

Vector6d VectorOf(const ArmDisplacement& d) {
  Vector6d w;
  w << VectorFromRotation(RotationFromCardan(d.angles)), d.translation_mm;
  return w;
}

TEST(ArmStudy, FindsKnownDisplacementsWithinItsUncertainty) {
  const Bench b = Displaced(8, 2e-3, 3);
  ArmStudyOptions options;
  options.sensor = b.bench.sensor;
  options.optics = b.bench.optics;
  const auto found = StudyArm(b.scans, b.bench.artefact, options);
  ASSERT_TRUE(found.ok()) << found.status();
  ASSERT_EQ(found->size(), 8u);
  EXPECT_EQ(VectorOf(found->front()).norm(), 0);
  double chi = 0;
  for (std::size_t i = 1; i < found->size(); ++i) {
    const Vector6d error = VectorOf((*found)[i]) - b.truth[i];
    chi += error.dot((*found)[i].covariance.ldlt().solve(error)) / 7;
    // 100 000 points of 2 um: translations to 0.1 um, alpha to the same over 10 mm; beta rests on the cones' 1.5 mm.
    EXPECT_LT(error.tail<3>().norm(), 1e-3);
    EXPECT_LT(std::abs(error(0)), 0.002 * kRadPerDeg);
    EXPECT_LT(std::sqrt((*found)[i].covariance(1, 1)), 0.03 * kRadPerDeg);
    EXPECT_NEAR((*found)[i].residual_rms_mm, 2e-3, 0.1e-3);
  }
  // 7 x 6 normal values, the first scan's error in all: mean 6, standard deviation about 2.5.
  EXPECT_GT(chi, 1);
  EXPECT_LT(chi, 16);
}

TEST(ArmStudy, AFairCalibrationIsGoodEnough) {
  const Bench b = Displaced(6, 2e-3, 4);
  ArmStudyOptions options;
  options.optics = b.bench.optics;
  options.sensor = b.bench.sensor;
  const auto exact = StudyArm(b.scans, b.bench.artefact, options);
  options.sensor.rotation = RotationFromVector(0.02 * kRadPerDeg * Eigen::Vector3d(1, -1, 1)) * options.sensor.rotation;
  options.sensor.t_sm_mm += Eigen::Vector3d(0.01, 0.01, -0.01);
  const auto fair = StudyArm(b.scans, b.bench.artefact, options);
  ASSERT_TRUE(exact.ok() && fair.ok()) << exact.status() << fair.status();
  for (std::size_t i = 1; i < fair->size(); ++i) {
    const Vector6d change = VectorOf((*fair)[i]) - VectorOf((*exact)[i]);
    for (int k = 0; k < 6; ++k)
      EXPECT_LT(std::abs(change(k)), std::sqrt((*exact)[i].covariance(k, k))) << i << " " << k;
  }
}

TEST(ArmStudy, RefusesTooFewScansAndScansOfSomethingElse) {
  Bench b = Displaced(5, 2e-3, 5);
  ArmStudyOptions options;
  options.sensor = b.bench.sensor;
  options.optics = b.bench.optics;
  LineScan other = b.scans.back();
  b.scans.pop_back();
  EXPECT_THAT(std::string(StudyArm(b.scans, b.bench.artefact, options).status().message()),
              HasSubstr("scans: 4 of them, want at least 5"));
  for (Eigen::Vector3d& p : other.points_mm) p.z() = 0.1 * std::sin(p.x()) + 3 * std::cos(p.y());
  b.scans.push_back(other);
  const absl::Status refused = StudyArm(b.scans, b.bench.artefact, options).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("scans: s4: "));
}

// The fifteen scans of shared/data/plant-a, against the displacements that its simulator made.
TEST(ArmStudy, FindsTheDisplacementsOfPlantA) {
  const char* shared = std::getenv("SIXPOINT_SHARED_DIR");
  const std::string folder = std::string(shared == nullptr ? "../shared" : shared) + "/data/plant-a";
  std::ifstream data_file(folder + "/dataset.json"), truth_file(folder + "/truth.json");
  if (!data_file || !truth_file) GTEST_SKIP() << folder << " is absent: set SIXPOINT_SHARED_DIR";
  const json data = json::parse(data_file), truth = json::parse(truth_file);
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
  std::vector<LineScan> scans;
  for (const json& s : data.at("scans")) {
    if (s.at("kind") != "arm") continue;
    std::ifstream file(folder + "/" + s.at("file").get<std::string>(), std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(file)), {});
    auto points = DecodeBlock(bytes, s.at("point_count").get<std::int64_t>());
    ASSERT_TRUE(points.ok()) << points.status();
    LineScan& scan = scans.emplace_back();
    scan.id = s.at("id");
    for (int k = 0; k < 3; ++k) scan.v0_mm(k) = s.at("v0_mm").at(k);
    scan.points_mm = *std::move(points);
  }
  ASSERT_EQ(scans.size(), 15u);
  ArmStudyOptions options;
  for (int i = 0; i < 9; ++i)
    options.sensor.rotation(i / 3, i % 3) = truth.at("machine_from_sensor_rotation").at(i / 3).at(i % 3);
  for (int k = 0; k < 3; ++k) options.sensor.t_sm_mm(k) = truth.at("T_sm_mm").at(k);
  const auto found = StudyArm(scans, artefact, options);
  ASSERT_TRUE(found.ok()) << found.status();
  const auto truth_of = [&](std::size_t i, int k) { return truth.at("arm_displacements").at(i).at(k).get<double>(); };
  double chi[6] = {};
  for (std::size_t i = 1; i < found->size(); ++i) {
    const ArmDisplacement& d = (*found)[i];
    const double values[6] = {d.translation_mm.x(),        d.translation_mm.y(),       d.translation_mm.z(),
                              d.angles.alpha / kRadPerDeg, d.angles.beta / kRadPerDeg, d.angles.gamma / kRadPerDeg};
    for (int k = 0; k < 6; ++k) {
      const double u = std::sqrt(d.covariance((k + 3) % 6, (k + 3) % 6)) / (k < 3 ? 1 : kRadPerDeg);
      const double error = values[k] - (truth_of(i, k) - truth_of(0, k));
      std::printf("%s%9.5f (error %8.5f, u %.5f) ", k == 0 ? (d.scan + " ").c_str() : "", values[k], error, u);
      chi[k] += error * error / (u * u) / 14;
      EXPECT_LT(std::abs(error), 4.5 * u) << d.scan << " " << k;
    }
    std::printf("\n");
  }
  // Fourteen differences that share the first scan's error: far from 1 only if the uncertainty is wrong.
  for (int k = 0; k < 6; ++k) EXPECT_LT(chi[k], 4) << k;
}

}  // namespace
}  // namespace sixpoint::metrology
