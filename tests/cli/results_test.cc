#include "cli/plant_run/results.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "services/runtime/geometry_proto.h"
#include "tests/cli/small_dataset.h"

namespace sixpoint::cli {
namespace {

using ::testing::HasSubstr;

constexpr double kDegree = 3.14159265358979323846 / 180;

nlohmann::json RowsOf(const Eigen::MatrixXd& matrix) {
  nlohmann::json rows = nlohmann::json::array();
  for (int r = 0; r < matrix.rows(); ++r) {
    rows.push_back(nlohmann::json::array());
    for (int c = 0; c < matrix.cols(); ++c) rows[r].push_back(matrix(r, c));
  }
  return rows;
}
nlohmann::json ListOf(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

// A plant whose truth is known in closed form, chosen without symmetry so that a transposed or swapped field shows.
struct KnownPlant {
  Eigen::Matrix3d machine_from_sensor =
      Eigen::AngleAxisd(0.02, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  Eigen::Vector3d t_sm_mm{1.25, -2.5, 3.0625};
  Eigen::Vector3d centre_mm{26.6, 54.9, -193.3};
  Eigen::Isometry3d zero_from_part =
      Eigen::Translation3d(-30, 12, 7) * Eigen::AngleAxisd(0.7, Eigen::Vector3d(0.2, 0.9, -0.3).normalized());
  nlohmann::json dataset = SmallDataset();
  nlohmann::json truth;
  PlantRunResult result;

  Eigen::Vector3d About(const Eigen::Vector3d& axis, double angle_deg, const Eigen::Vector3d& p) const {
    return Eigen::AngleAxisd(angle_deg * kDegree, axis) * (p - centre_mm) + centre_mm;
  }

  KnownPlant() {
    MakeDataset();
    MakeTruth();
    MakeResult();
  }

  void MakeDataset() {
    nlohmann::json group = dataset["part"]["hole_groups"][0];
    dataset["part"]["hole_groups"] = nlohmann::json::array();
    for (const char* name : {"G1", "G2"}) {
      group["name"] = name;
      group["holes"] = nlohmann::json::array();
      for (int i = 0; i < 6; ++i) {
        group["holes"].push_back({{"name", "H" + std::to_string(i + 1)},
                                  {"start_in_part_mm", {10.0 + i, 0.5 * i * i, name[1] * 0.25}},
                                  {"normal_in_part", {0, 0, 1}}});
      }
      dataset["part"]["hole_groups"].push_back(group);
    }
    dataset["sphere_poses"] = nlohmann::json::array();
    for (const auto& [a, b, use] :
         {std::tuple(0, 0, "fit"), std::tuple(40, 70, "fit"), std::tuple(-30, 110, "check")}) {
      const Eigen::Vector3d carried =
          About(Eigen::Vector3d::UnitY(), a, About(Eigen::Vector3d::UnitX(), b, Eigen::Vector3d(90, 20, -150)));
      dataset["sphere_poses"].push_back({{"a_deg", a}, {"b_deg", b}, {"centre_mm", ListOf(carried)}, {"use", use}});
    }
  }

  void MakeTruth() {
    truth = {{"machine_from_sensor_rotation", RowsOf(machine_from_sensor)},
             {"T_sm_mm", ListOf(t_sm_mm)},
             {"a_axis", {{"direction", {0, 1, 0}}, {"point", ListOf(centre_mm)}}},
             {"b_axis", {{"direction", {1, 0, 0}}, {"point", ListOf(centre_mm)}}},
             {"zero_from_part", RowsOf(zero_from_part.matrix())},
             {"correction", nlohmann::json::array()},
             {"drilled_holes", nlohmann::json::array()}};
    for (const char* name : {"G1", "G2"}) {
      nlohmann::json holes = nlohmann::json::array();
      for (int i = 0; i < 6; ++i) {
        holes.push_back({{"name", "H" + std::to_string(i + 1)}, {"start_table_mm", {100.0 + i, 3.0 * i, -50.0}}});
        truth["drilled_holes"].push_back({{"group", name},
                                          {"hole", "H" + std::to_string(i + 1)},
                                          {"position_error_mm", 0.01 * i},
                                          {"inclination_error_deg", 0.1 * i}});
      }
      truth["correction"].push_back(
          {{"group", name}, {"real_axes", {{"a_deg", 1.5}, {"b_deg", -40.25}}}, {"holes", holes}});
    }
  }

  void MakeResult() {
    result.sensor.emplace();
    auto* sensor = result.sensor->mutable_sensor();
    for (int i = 0; i < 9; ++i) sensor->add_machine_from_sensor_rotation(machine_from_sensor(i / 3, i % 3));
    runtime::ToProto(t_sm_mm, sensor->mutable_t_sm_mm());
    result.rotation.emplace();
    auto* rotation = result.rotation->mutable_rotation();
    runtime::ToProto(metrology::AxisLine{Eigen::Vector3d::UnitY(), centre_mm}, rotation->mutable_a_axis());
    runtime::ToProto(metrology::AxisLine{Eigen::Vector3d::UnitX(), centre_mm}, rotation->mutable_b_axis());
    for (const char* method : {"six-point", "airfoil", "local"}) {
      RegisteredBlade& entry = result.registrations.emplace_back();
      entry.blade = "SN-0001";
      entry.method = method;
      runtime::ToProto(zero_from_part, entry.registration.mutable_zero_from_part());
      for (int i = 0; i < 36; ++i) entry.registration.mutable_covariance()->add_values(i % 7 == 0 ? 1e-6 : 0);
      entry.registration.mutable_evidence()->set_outcome(registration::v1::OUTCOME_CONVERGED);
      CorrectedBlade& corrected = result.corrections.emplace_back();
      corrected.blade = "SN-0001";
      corrected.method = method;
      for (const char* name : {"G1", "G2"}) {
        auto* group = corrected.correction.add_groups();
        group->set_group(name);
        group->set_a_deg(1.5);
        group->set_b_deg(-40.25);
        for (int i = 0; i < 6; ++i) {
          auto* hole = group->add_holes();
          hole->set_hole("H" + std::to_string(i + 1));
          runtime::ToProto(Eigen::Vector3d(100.0 + i, 3.0 * i, -50), hole->mutable_start_mm());
          hole->set_expanded_uncertainty_um(1);
        }
      }
    }
    InspectedBlade& inspected = result.inspections.emplace_back();
    inspected.blade = "SN-0001";
    for (const char* name : {"G1", "G2"}) {
      for (int i = 0; i < 6; ++i) {
        auto* hole = inspected.inspection.add_holes();
        hole->set_group(name);
        hole->set_hole("H" + std::to_string(i + 1));
        hole->set_position_error_mm(0.01 * i);
        hole->set_inclination_error_deg(0.1 * i);
        hole->set_position_expanded_uncertainty_um(1);
        hole->set_verdict(inspection::v1::VERDICT_CONFORM);
      }
    }
  }
};

TEST(Results, HaveTheFieldsOfTheIssue) {
  const nlohmann::json out = ResultsToJson(KnownPlant().result);
  EXPECT_EQ(out["calibration"]["sensor"]["machine_from_sensor_rotation"].size(), 3u);
  EXPECT_EQ(out["calibration"]["sensor"]["standard_uncertainty"]["t_sm_mm"].size(), 3u);
  for (const char* key : {"point_c_mm", "a_axis", "b_axis", "residual_rms_um", "check_rms_um"}) {
    EXPECT_TRUE(out["calibration"]["rotation"].contains(key)) << key;
  }
  const nlohmann::json& registration = out["registration"][0];
  for (const char* key : {"blade", "method", "scans", "residual_rms_um", "points_used", "iterations", "seconds"}) {
    EXPECT_TRUE(registration.contains(key)) << key;
  }
  EXPECT_EQ(registration["zero_from_part"].size(), 4u);
  EXPECT_EQ(registration["zero_from_part"][3], nlohmann::json({0, 0, 0, 1}));
  EXPECT_EQ(registration["covariance"].size(), 6u);
  EXPECT_EQ(registration["covariance"][5].size(), 6u);
  const nlohmann::json& correction = out["correction"][0];
  for (const char* key : {"blade", "method", "group", "a_deg", "b_deg", "a_nominal_deg", "b_nominal_deg"}) {
    EXPECT_TRUE(correction.contains(key)) << key;
  }
  for (const char* key : {"name", "start_table_mm", "nominal_start_table_mm", "u95_um"}) {
    EXPECT_TRUE(correction["holes"][0].contains(key)) << key;
  }
  for (const char* key : {"min", "max", "rms"}) EXPECT_TRUE(out["inspection"][0]["deviation_um"].contains(key)) << key;
  for (const char* key : {"ingest", "calibration", "registration", "correction", "inspection"}) {
    EXPECT_TRUE(out["timing_s"].contains(key)) << key;
  }
}

TEST(Results, KeepEveryBitOfADouble) {
  PlantRunResult result;
  result.sensor.emplace().mutable_sensor()->mutable_t_sm_mm()->set_x_mm(0.1 + 0.2);
  const nlohmann::json read = nlohmann::json::parse(ResultsToJson(result).dump());
  EXPECT_EQ(read["calibration"]["sensor"]["t_sm_mm"][0].get<double>(), 0.1 + 0.2);
}

TEST(Results, WhatWasNotMeasuredIsNullNotZero) {
  PlantRunResult result;
  auto* hole = result.inspections.emplace_back().inspection.add_holes();
  hole->set_verdict(inspection::v1::VERDICT_NOT_MEASURED);
  hole->set_reason("no pin found");
  const nlohmann::json out = ResultsToJson(result)["inspection"][0]["holes"][0];
  EXPECT_TRUE(out["position_error_mm"].is_null());
  EXPECT_TRUE(out["inclination_error_deg"].is_null());
  EXPECT_EQ(out["verdict"], "NOT_MEASURED");
  EXPECT_EQ(out["reason"], "no pin found");
}

TEST(Results, AFailedStepIsTold) {
  PlantRunResult result;
  result.failures.push_back({"registration", "blade:SN-9", "local", "TOO_LITTLE_OVERLAP", "overlap 0.1"});
  const nlohmann::json out = ResultsToJson(result);
  EXPECT_EQ(out["failures"][0]["outcome"], "TOO_LITTLE_OVERLAP");
  EXPECT_THAT(ResultsToText(result), HasSubstr("TOO_LITTLE_OVERLAP"));
}

TEST(Results, TextShowsNominalBesideCorrected) {
  const std::string text = ResultsToText(KnownPlant().result);
  EXPECT_THAT(text, HasSubstr("corrections of SN-0001"));
  EXPECT_THAT(text, HasSubstr("105.0000"));
  EXPECT_THAT(text, HasSubstr("-40.2500"));
}

// The judge knows nothing of the product; here it is given a truth that equals the result, so every row must hold.
TEST(Results, TheJudgeReadsThem) {
  const char* shared = std::getenv("SIXPOINT_SHARED_DIR");
  const std::string judge = std::string(shared == nullptr ? "" : shared) + "/tools/judge_plant.py";
  if (shared == nullptr || !std::filesystem::exists(judge)) GTEST_SKIP() << "../shared/tools/judge_plant.py is absent";
  if (std::system("/usr/bin/python3 -c 'import numpy' 2>/dev/null") != 0) GTEST_SKIP() << "python3-numpy is absent";
  const std::filesystem::path folder = std::filesystem::path(::testing::TempDir()) / "sixpoint_results_test";
  std::filesystem::create_directories(folder);
  const KnownPlant plant;
  std::ofstream(folder / "dataset.json") << plant.dataset;
  std::ofstream(folder / "truth.json") << plant.truth;
  std::ofstream(folder / "results.json") << ResultsToJson(plant.result);
  const std::string command = "/usr/bin/python3 " + judge + " " + folder.string() + " " +
                              (folder / "results.json").string() + " --level full 2>&1";
  FILE* pipe = popen(command.c_str(), "r");
  ASSERT_NE(pipe, nullptr);
  std::string output;
  std::array<char, 4096> buffer;
  for (std::size_t n; (n = fread(buffer.data(), 1, buffer.size(), pipe)) > 0;) output.append(buffer.data(), n);
  EXPECT_EQ(pclose(pipe), 0) << output;
  EXPECT_THAT(output, HasSubstr("14 of 14 rows hold"));
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace sixpoint::cli
