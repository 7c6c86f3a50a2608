// A tilt-rotary table (B carries C) through the real services and the engineer's tool, by its own letters.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/end_to_end/plant_processes.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::testing {
namespace {

using nlohmann::json;

class OtherAxes : public ::testing::Test {
 protected:
  void SetUp() override {
    for (const std::string area : {"plant", "ingest", "calibration"})
      ASSERT_TRUE(plant_.WaitUntilUp(area, 30)) << area << "\n" << plant_.Logs();
  }

  struct Answer {
    int exit_code = -1;
    std::string text;
    json out() const { return json::parse(text, nullptr, false); }
  };
  Answer Run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), PlantProcesses::Program("sixpoint"));
    for (const char* option : {"--server", plant_.server().c_str(), "--json"}) arguments.emplace_back(option);
    const std::string log = plant_.folder() + "/sixpoint_" + std::to_string(++run_count_) + ".log";
    Process process(arguments, log);
    Answer answer;
    answer.exit_code = process.Wait(60);
    answer.text = ReadFile(log);
    return answer;
  }
  static std::string Example(const std::string& name) {
    const char* source = std::getenv("SIXPOINT_SOURCE_DIR");
    return std::string(source ? source : ".") + "/docs/examples/" + name;
  }
  std::string Write(const std::string& name, const std::string& text) const {
    const std::string file = plant_.folder() + "/" + name;
    std::ofstream(file) << text;
    return file;
  }

  ThrowawayDatabase database_;
  PlantProcesses plant_{database_.conninfo()};
  int run_count_ = 0;
};

TEST_F(OtherAxes, AreRegisteredAndCalibratedByTheirOwnLetters) {
  const Answer added = Run({"machine", "add", Example("machine_bc.yaml")});
  ASSERT_EQ(added.exit_code, 0) << added.text << plant_.Logs();

  // The file's poses were made about lines a little off the record's, and rounded to 0.1 um.
  const Answer calibrated =
      Run({"calibrate", "rotation", "--machine", "nrc-1", "--poses", Example("sphere_poses_bc.yaml")});
  ASSERT_EQ(calibrated.exit_code, 0) << calibrated.text << plant_.Logs();
  const json rotation = calibrated.out().at("rotation");
  EXPECT_EQ(rotation.at("axes"), json({"B", "C"}));
  const auto number = [](const json& in, const std::string& key) {
    return in.contains(key) ? in[key].get<double>() : 0;
  };
  const json& b = rotation.at("a_axis").at("direction");
  const json& c = rotation.at("b_axis").at("direction");
  EXPECT_NEAR(number(b, "x") / number(b, "y"), 2e-4, 3e-6);
  EXPECT_NEAR(number(b, "z") / number(b, "y"), -1e-4, 3e-6);
  EXPECT_NEAR(number(c, "x") / number(c, "z"), -1e-4, 3e-6);
  EXPECT_NEAR(number(c, "y") / number(c, "z"), 3e-4, 3e-6);
  EXPECT_NEAR(number(rotation.at("point_c_mm"), "z_mm"), -140.482, 2e-4);
  EXPECT_LT(number(rotation, "check_rms_um"), 0.3);

  // Another machine's letters are refused, and named.
  const Answer other = Run({"calibrate", "rotation", "--machine", "nrc-1", "--poses", Example("sphere_poses.yaml")});
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_NE(other.text.find("a_deg: unknown"), std::string::npos) << other.text;
  EXPECT_NE(other.text.find("c_deg: missing"), std::string::npos) << other.text;
}

TEST_F(OtherAxes, ScansAreSentByTheirOwnLetters) {
  ASSERT_EQ(Run({"machine", "add", Example("machine_bc.yaml")}).exit_code, 0);
  ASSERT_EQ(Run({"artefact", "add", Example("artefact.yaml")}).exit_code, 0);
  std::string cloud;
  for (int i = 0; i < 100; ++i) cloud += std::to_string(0.1 * (i / 10)) + " " + std::to_string(0.1 * (i % 10)) + " 0\n";
  const std::string file = Write("cloud.xyz", cloud);
  const std::vector<std::string> upload = {"scan",      "upload",           file,     "--machine", "nrc-1",
                                           "--subject", "artefact:plate-1", "--kind", "artefact",  "--v0-mm",
                                           "0,0,0",     "--pitch-mm",       "0.1",    "--scan-id", "s1"};
  const auto with = [&](const std::vector<std::string>& more) {
    std::vector<std::string> all = upload;
    all.insert(all.end(), more.begin(), more.end());
    return Run(all);
  };
  const Answer missing = with({"--b-deg", "30"});
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_NE(missing.text.find("--c-deg: nothing, want where machines/nrc-1 held its axis C"), std::string::npos)
      << missing.text;
  const Answer foreign = with({"--a-deg", "0", "--b-deg", "30", "--c-deg", "200"});
  EXPECT_EQ(foreign.exit_code, 1);
  EXPECT_NE(foreign.text.find("does not ride on A"), std::string::npos) << foreign.text;
  const Answer beyond = with({"--b-deg", "130", "--c-deg", "200"});
  EXPECT_EQ(beyond.exit_code, 1);
  EXPECT_NE(beyond.text.find("header.a_deg: 130"), std::string::npos) << beyond.text;
  const Answer stored = with({"--b-deg", "30", "--c-deg", "200"});
  ASSERT_EQ(stored.exit_code, 0) << stored.text << plant_.Logs();
  const json header = stored.out().at("scan").at("header");
  EXPECT_EQ(header.at("a_deg"), 30);
  EXPECT_EQ(header.at("b_deg"), 200);
}

// A machine with one rotary axis is a machine; what needs two says so.
TEST_F(OtherAxes, OneAloneIsRefusedWhereTwoAreWanted) {
  std::string machine = ReadFile(Example("machine_bc.yaml"));
  const std::size_t tilt = machine.find("  - {axis: B");
  machine.erase(tilt, machine.find('\n', tilt) + 1 - tilt);
  ASSERT_EQ(Run({"machine", "add", Write("one.yaml", machine)}).exit_code, 0);
  const Answer refused = Run({"calibrate", "rotation", "--machine", "nrc-1", "--poses", Example("sphere_poses.yaml")});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_NE(refused.text.find("KINEMATICS_UNSUITABLE"), std::string::npos) << refused.text;
  EXPECT_NE(refused.text.find("1 rotary joints, want two"), std::string::npos) << refused.text;
}

}  // namespace
}  // namespace sixpoint::testing
