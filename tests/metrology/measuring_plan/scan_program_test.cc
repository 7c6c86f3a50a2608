#include "metrology/measuring_plan/scan_program.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "refusal/refusal.h"
#include "tests/metrology/measuring_plan/plan_scenes.h"

namespace sixpoint::metrology {
namespace {

struct Planned {
  std::shared_ptr<const Surface> surface = SurfaceOf(CylinderMesh(10, 30, 60));
  PlanTask task = TaskOf(*surface);
  MeasuringPlan plan;
  std::string program;
  Planned() {
    auto made = MakeMeasuringPlan(task);
    EXPECT_TRUE(made.ok()) << made.status();
    plan = *std::move(made);
    auto written = WriteScanProgram(plan, task.chain, {});
    EXPECT_TRUE(written.ok()) << written.status();
    program = *std::move(written);
  }
  absl::Status Prove(const std::string& text) const { return ProveScanProgram(text, plan, task.chain, {}); }
  std::vector<std::string> Lines() const {
    std::vector<std::string> lines;
    std::istringstream in(program);
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    return lines;
  }
};
std::string Joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

TEST(ScanProgram, IsProvenByItsReader) {
  const Planned planned;
  ASSERT_GE(planned.plan.portions.size(), 4u);
  EXPECT_TRUE(planned.Prove(planned.program).ok()) << planned.Prove(planned.program) << "\n" << planned.program;
  const auto count = [&](const std::string& word) {
    const auto lines = planned.Lines();
    return static_cast<std::size_t>(
        std::count_if(lines.begin(), lines.end(), [&](const std::string& line) { return line.rfind(word, 0) == 0; }));
  };
  EXPECT_EQ(count("G1 "), planned.plan.portions.size());
  EXPECT_EQ(count("M62 "), planned.plan.portions.size());
  EXPECT_EQ(count("M63 "), planned.plan.portions.size());
}

// Whatever single line is lost, the program is not the plan's any more, but for comments, modes that were in force, and what leads nowhere.
TEST(ScanProgram, IsNotProvenWithoutAnyOfItsMoves) {
  const Planned planned;
  const std::vector<std::string> lines = planned.Lines();
  int refused = 0, moves = 0;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const bool moves_axes = lines[i].rfind("G0", 0) == 0 || lines[i].rfind("G1", 0) == 0;
    if (!moves_axes && lines[i].rfind("M62", 0) != 0) continue;
    std::vector<std::string> without = lines;
    without.erase(without.begin() + static_cast<std::ptrdiff_t>(i));
    ++moves;
    const bool ok = planned.Prove(Joined(without)).ok();
    refused += ok ? 0 : 1;
    EXPECT_FALSE(ok) << "line " << i + 1 << ": " << lines[i];
  }
  EXPECT_EQ(refused, moves);
  EXPECT_GT(moves, 20);
}

// Any digit of a coordinate that counts.
TEST(ScanProgram, IsNotProvenWithAnyCoordinateElsewhere) {
  const Planned planned;
  const std::vector<std::string> lines = planned.Lines();
  int changed = 0;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (lines[i].rfind("G0", 0) != 0 && lines[i].rfind("G1", 0) != 0) continue;
    for (std::size_t at = 3; at < lines[i].size(); ++at) {
      if (lines[i][at] != '.') continue;
      std::vector<std::string> other = lines;
      char& digit = other[i][at + 2];  // hundredths
      digit = digit == '9' ? '0' : static_cast<char>(digit + 1);
      EXPECT_FALSE(planned.Prove(Joined(other)).ok()) << other[i];
      ++changed;
    }
  }
  EXPECT_GT(changed, 10 * static_cast<int>(planned.plan.portions.size()));  // at least 9 of a sweep, and its angles
}

TEST(ScanProgram, SweepsAreByFeedWithTheOutputOnAndAllElseByRapid) {
  const Planned planned;
  const auto with = [&](const std::string& what, const std::string& by) {
    std::string text = planned.program;
    text.replace(text.find(what), what.size(), by);
    return planned.Prove(text);
  };
  EXPECT_FALSE(with("G1 ", "G0 ").ok());
  EXPECT_FALSE(with("F1800.0000", "F3600").ok());
  EXPECT_FALSE(with("M62 P1\n", "M63 P1\n").ok());
  EXPECT_FALSE(with("G21 G90", "G20 G90").ok());
  EXPECT_FALSE(with("G21 G90", "G21 G91").ok());
  EXPECT_FALSE(with("M30\n", "G0 X0.0000\nM30\n").ok());
  EXPECT_FALSE(with("M63 P1\n", "M63 P1\nM62 P1\n").ok());
}

TEST(ScanProgram, NamesFromOutsideEndNoComment) {
  Planned planned;
  planned.plan.portions[0].region = "D1) G0 Z-500 (";
  ScanProgramOptions options;
  options.remarks = {"OF parts/p1) G0 Z-400\nG0 Z-400"};
  const auto program = WriteScanProgram(planned.plan, planned.task.chain, options);
  ASSERT_TRUE(program.ok());
  EXPECT_TRUE(planned.Prove(*program).ok()) << planned.Prove(*program);
  EXPECT_NE(program->find("\n(OF parts/p1? G0 Z-400?G0 Z-400)\n"), std::string::npos) << *program;
  EXPECT_NE(program->find(", D1??G0?Z-500??: V0 "), std::string::npos) << *program;
}

TEST(ScanProgram, WhatIsNotTakenIsRefusedByItsName) {
  const Planned planned;
  const auto field = [&](const JointChain& chain, const ScanProgramOptions& options) {
    const auto violations = ViolationsOf(WriteScanProgram(planned.plan, chain, options).status());
    return violations.empty() ? std::string() : violations[0].field;
  };
  EXPECT_EQ(field(planned.task.chain, {0, 1, {}}), "feed_mm_per_min");
  EXPECT_EQ(field(planned.task.chain, {100, -1, {}}), "output");
  EXPECT_EQ(field(planned.task.chain, {100, 64, {}}), "output");
  std::vector<Joint> joints = planned.task.chain.joints();
  joints[2].axis = "U";
  const auto named = JointChain::Make({joints[0], joints[1]}, {joints[2], joints[3], joints[4]});
  ASSERT_TRUE(named.ok());
  EXPECT_EQ(field(*named, {}), "kinematics");
}

}  // namespace
}  // namespace sixpoint::metrology
