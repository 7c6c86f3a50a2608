// Whether recorded results come out again: after a demo through the real processes, with everything that the plant may do since.
#include <gmock/gmock.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "tests/end_to_end/plant_processes.h"
#include "tests/support/call.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::testing {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

constexpr int kNotUsable = 4;

class ReplayTest : public ::testing::Test {
 protected:
  struct Answer {
    int exit_code = -1;
    json said;
  };

  // Of what the map and the sections have.
  static std::string DrawingOf(const json& registration) {
    return "id: replayed\npart: " + registration.at("part").get<std::string>().substr(6) + "\npart_revisions: [" +
           registration.at("part_revision").dump() + R"(]
drawing_number: "1"
drawing_revision: A
part_number: "1"
part_name: demo blade
decision_rule: {kind: iso-14253-1, edition: "2017"}
sections: [{section: "z 15", height_mm: 15, half_width_mm: 0.1}]
characteristics:
  - {characteristic: "1", name: form, requirement: "profile 0.8", reference_location: "1", class: major,
     quantity: profile-form, unit: mm, zone: half-width, upper_limit: 0.4, decision_rule: {kind: iso-14253-1, edition: "2013"}}
  - {characteristic: "2", name: chord, requirement: "20 to 40", reference_location: "1", class: major,
     quantity: section-chord, algorithm: caliper, section: "z 15", unit: mm, lower_limit: 1, upper_limit: 100}
)";
  }
  void SetUp() override {
    for (const std::string& area : PlantProcesses::Areas())
      ASSERT_TRUE(plant_.WaitUntilUp(area, 30)) << area << "\n" << plant_.Logs();
    Process demo({PlantProcesses::Program("sixpoint-simulator"), "demo", "--server", plant_.server(), "--machines", "1",
                  "--seed", "7", "--airfoil-pitch-mm", "0.4", "--pins-pitch-mm", "0.15"},
                 plant_.folder() + "/demo.log");
    ASSERT_GE(demo.Wait(200), 0) << ReadFile(plant_.folder() + "/demo.log");
    const Answer registered = Run({"registration", "list", "--json"});
    const std::string newest = registered.said.at(0).at("name").get<std::string>();
    const Answer mapped = Run({"deviation", "map", newest, "--profile", "-0.4,0.4", "--form", "--json"});
    ASSERT_EQ(mapped.exit_code, 0) << mapped.said.dump(1);
    const Answer cut = Run({"section", "measure", newest, "--heights", "15,22,30", "--json"});
    ASSERT_EQ(cut.exit_code, 0) << cut.said.dump(1);
    EXPECT_TRUE(cut.said.at("sections").at(1).value("reason", "").empty()) << cut.said.dump(1);
    const std::string drawing = plant_.folder() + "/drawing.yaml";
    std::ofstream(drawing) << DrawingOf(registered.said.at(0));
    ASSERT_EQ(Run({"drawing", "add", drawing, "--json"}).exit_code, 0);
    const std::string inspected = Run({"inspection", "list", "--json"}).said.at(0).at("name");
    const std::string serial = mapped.said.at("blade").get<std::string>().substr(7);
    const Answer assessed =
        Run({"assess", "--blade", serial, "--drawing", "replayed", "--results",
             mapped.said.at("name").get<std::string>() + "," + cut.said.at("name").get<std::string>() + "," + inspected,
             "--json"});
    ASSERT_EQ(assessed.exit_code, 0) << assessed.said.dump(1);
    for (const char* noun : {"registration", "correction", "inspection", "deviation", "section", "assessment"}) {
      std::vector<std::string> of_noun;
      for (const json& one : Run({noun, "list", "--json"}).said) of_noun.push_back(one["name"]);
      ASSERT_THAT(of_noun, Not(IsEmpty())) << noun;
      names_.insert(names_.end(), of_noun.begin(), of_noun.end());
      newest_[noun] = of_noun.front();
    }
  }
  std::string Text(std::vector<std::string> arguments, int* exit_code = nullptr) {
    arguments.insert(arguments.begin(), PlantProcesses::Program("sixpoint"));
    arguments.insert(arguments.end(), {"--server", plant_.server()});
    const std::string file = plant_.folder() + "/answer_" + std::to_string(++run_count_);
    Process run(arguments, file);
    const int ended = run.Wait(120);
    if (exit_code != nullptr) *exit_code = ended;
    return ReadFile(file);
  }
  Answer Run(const std::vector<std::string>& arguments) {
    Answer answer;
    const std::string text = Text(arguments, &answer.exit_code);
    answer.said = json::parse(text.substr(std::min(text.find_first_of("[{"), text.size())), nullptr, false);
    if (answer.said.is_discarded()) std::printf("%s\n", text.c_str());
    return answer;
  }
  Answer Replay(const std::string& name) { return Run({"replay", name, "--json"}); }
  void ExpectTheSameBits(const std::string& when) {
    for (const std::string& name : names_) {
      const Answer answer = Replay(name);
      EXPECT_EQ(answer.exit_code, 0) << when << ": " << answer.said.dump(1);
      EXPECT_EQ(answer.said.value("outcome", ""), "REPLAY_OUTCOME_SAME_BITS") << when << ": " << answer.said.dump(1);
    }
  }
  void StartAgain(const std::vector<std::string>& flags) {
    for (const char* area : {"registration", "correction", "inspection"}) {
      plant_.Kill(area);
      plant_.Start(area, flags);
      ASSERT_TRUE(plant_.WaitUntilUp(area, 30)) << plant_.Logs();
    }
  }
  // As a superuser who leaves no trace.
  void Sql(const std::string& statement) {
    auto transaction = database_.database()->Begin(Soon());
    ASSERT_TRUE(transaction.ok());
    ASSERT_TRUE(transaction->Execute("SET LOCAL session_replication_role = replica").ok());
    const auto done = transaction->Execute(statement);
    ASSERT_TRUE(done.ok()) << done.status();
    ASSERT_TRUE(transaction->Commit().ok());
  }
  std::int64_t Count(const std::string& table) {
    auto transaction = database_.database()->Begin(Soon());
    return transaction->Execute("SELECT count(*) FROM " + table)->Int(0, 0);
  }
  // The newest correction again, by a machining model of its part that this adds; what comes of it is replayed with the others.
  void CorrectByModel() {
    const std::string of_old = Run({"correction", "show", Id("correction"), "--json"}).said["registration"];
    const json registration = Run({"registration", "show", of_old, "--json"}).said;
    const std::string part_id = registration["part"].get<std::string>().substr(std::string("parts/").size());
    const json part = Run({"part", "show", part_id, "--json"}).said;
    json operations = json::array();
    std::ofstream nc_template(plant_.folder() + "/program.nc");
    nc_template << "G21 G90\n";
    for (const json& group : part["hole_groups"]) {
      const std::string name = group["group"];
      operations.push_back(
          {{"operation", "OP-" + name},
           {"hole_group", name},
           {"electrode", {{"diameter_mm", group["diameter_mm"]}, {"length_mm", 200}, {"wear_mm", 0.1}}}});
      for (const json& hole : group["holes"]) {
        const std::string mark = " (SIXPOINT " + name + "/" + hole["hole"].get<std::string>() + ")\n";
        nc_template << "G0 Z400\nA0 B0 X0 Y0" << mark << "G1 Z0 F200" << mark << "M62 P1\nM63 P1\n";
      }
    }
    nc_template << "G0 Z400\nM30\n";
    nc_template.close();
    std::ofstream(plant_.folder() + "/model.json")
        << json{{"id", "edm"}, {"part", part_id}, {"operations", operations}};
    const Answer added =
        Run({"model", "add", plant_.folder() + "/model.json", "--template", plant_.folder() + "/program.nc", "--json"});
    ASSERT_EQ(added.exit_code, 0) << added.said.dump(1);
    EXPECT_EQ(added.said["name"], "machining_models/edm");
    const Answer corrected = Run({"correct", "--registration", of_old, "--model", "edm", "--json"});
    ASSERT_TRUE(corrected.said.contains("machining_model")) << corrected.said.dump(1);
    EXPECT_EQ(corrected.said["machining_model"], "machining_models/edm@1");
    EXPECT_EQ(corrected.said["checks"].back()["kind"], "RELEASE_CHECK_KIND_TOOL_CYLINDER") << corrected.said.dump(1);
    EXPECT_TRUE(corrected.said["checks"].back().value("passed", false)) << corrected.said["checks"].dump(1);
    names_.push_back(corrected.said["name"]);
    // A later revision is another thing: what rests on the first one still does.
    std::ofstream(plant_.folder() + "/program.nc", std::ios::app) << "(revised)\n";
    EXPECT_EQ(
        Run({"model", "add", plant_.folder() + "/model.json", "--template", plant_.folder() + "/program.nc", "--json"})
            .said["revision"],
        2);
    const std::string recalled = Text({"recall", "machining_models/edm@1", "--json"});
    EXPECT_THAT(recalled, HasSubstr(corrected.said["name"].get<std::string>()));
    EXPECT_THAT(Text({"recall", "machining_models/edm@2", "--json"}), Not(HasSubstr("corrections/")));
    EXPECT_THAT(Text({"model", "list"}), HasSubstr("edm"));
    EXPECT_THAT(Text({"model", "show", "edm@1", "--only-template"}), Not(HasSubstr("(revised)")));
    EXPECT_THAT(Text({"correct", "--registration", of_old, "--model", "none"}), HasSubstr("sixpoint model list"));
  }
  std::string Id(const std::string& noun) const { return newest_.at(noun).substr(newest_.at(noun).find('/') + 1); }

  ThrowawayDatabase database_;
  PlantProcesses plant_{database_.conninfo()};
  std::vector<std::string> names_;
  std::map<std::string, std::string> newest_;  // by noun
  int run_count_ = 0;
};

TEST_F(ReplayTest, WhateverTheThreadsAndWhateverIsInForceNow) {
  ASSERT_GE(names_.size(), 5u);
  CorrectByModel();
  ExpectTheSameBits("at once");
  StartAgain({"--threads", "1"});
  ExpectTheSameBits("on one thread");
  StartAgain({"--threads", "5"});
  ExpectTheSameBits("on five");
  // What it was made by is in force no more.
  int withdrawn_count = 0;
  for (const json& calibration : Run({"calibration", "list", "--json"}).said) {
    const std::string name = calibration["name"];
    withdrawn_count +=
        Run({"calibration", "withdraw", name.substr(name.find('/') + 1), "--reason", "dropped", "--json"}).exit_code ==
        0;
  }
  ASSERT_GE(withdrawn_count, 2);
  ExpectTheSameBits("after its calibrations were withdrawn");
}

TEST_F(ReplayTest, SaysWhatDiffers) {
  const std::string inspection = newest_["inspection"];
  // A superuser makes a hole better than it is.
  Sql("UPDATE inspection_holes SET position_error_mm = position_error_mm / 2 WHERE inspection_id = '" +
      Id("inspection") + "' AND position_index = 3");
  Answer answer = Replay(inspection);
  EXPECT_EQ(answer.exit_code, kNotUsable);
  EXPECT_EQ(answer.said["outcome"], "REPLAY_OUTCOME_DIFFERS");
  ASSERT_THAT(answer.said["differences"], SizeIs(1)) << answer.said.dump(1);
  EXPECT_EQ(answer.said["differences"][0]["kind"], "DIFFERENCE_KIND_RESULT");
  EXPECT_EQ(answer.said["differences"][0]["field"], "holes[3].position_error_mm");

  // Another version, or another computer, is named even where it computes the same.
  Sql("UPDATE corrections SET software_version = '0.0.9+before', computed_on = NULL WHERE correction_id = '" +
      Id("correction") + "'");
  answer = Replay(newest_["correction"]);
  EXPECT_EQ(answer.said["outcome"], "REPLAY_OUTCOME_SAME_BITS") << answer.said.dump(1);
  ASSERT_THAT(answer.said["differences"], SizeIs(2)) << answer.said.dump(1);
  EXPECT_EQ(answer.said["differences"][0]["kind"], "DIFFERENCE_KIND_SOFTWARE");
  EXPECT_EQ(answer.said["differences"][0]["recorded"], "0.0.9+before");
  EXPECT_EQ(answer.said["differences"][1]["kind"], "DIFFERENCE_KIND_COMPUTER");

  // One byte of one block of its scans.
  Sql("UPDATE blobs SET bytes = set_byte(bytes, 100, get_byte(bytes, 100) # 1) WHERE sha256 = (SELECT blob_sha256 FROM "
      "scan_blocks JOIN inspection_scans USING (scan_key) WHERE inspection_id = '" +
      Id("inspection") + "' LIMIT 1)");
  answer = Replay(inspection);
  EXPECT_EQ(answer.exit_code, kNotUsable);
  EXPECT_EQ(answer.said["outcome"], "REPLAY_OUTCOME_IMPOSSIBLE") << answer.said.dump(1);
  EXPECT_EQ(answer.said["differences"][0]["kind"], "DIFFERENCE_KIND_BYTES");

  answer = Replay("inspections/4a3b1a52-2f0f-4f55-bd0b-0f7e1f0f8a11");
  EXPECT_NE(answer.exit_code, 0);
  EXPECT_NE(answer.exit_code, kNotUsable);
}

// One JSON object a line.
std::vector<json> LinesOf(const std::string& text) {
  std::vector<json> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    json one = json::parse(line, nullptr, false);
    if (one.is_object()) lines.push_back(std::move(one));
  }
  return lines;
}

using RejudgeTest = ReplayTest;

TEST_F(RejudgeTest, ANewRecordNamesTheOldAndSaysWhatFlips) {
  const std::string old = newest_["inspection"];
  const std::string id = "5d0f4a52-2f0f-4f55-bd0b-0f7e1f0f8a11";
  const auto first = LinesOf(Text({"rejudge", old, "--request-id", id, "--json"}));
  ASSERT_THAT(first, SizeIs(1));
  const std::string anew = first[0]["inspection"]["name"];
  EXPECT_NE(anew, old);
  EXPECT_EQ(first[0]["inspection"]["rejudges"], old);
  EXPECT_EQ(first[0]["flips"], false);
  EXPECT_THAT(first[0]["flipped_holes"], IsEmpty());
  // Nothing changed between, so neither did the figures.
  json before = Run({"inspection", "show", Id("inspection"), "--json"}).said, now = first[0]["inspection"];
  EXPECT_EQ(now["holes"], before["holes"]);
  EXPECT_EQ(Replay(anew).said["outcome"], "REPLAY_OUTCOME_SAME_BITS");
  // The same call again: no other record.
  const auto again = LinesOf(Text({"rejudge", old, "--request-id", id, "--json"}));
  ASSERT_THAT(again, SizeIs(1));
  EXPECT_EQ(again[0]["inspection"]["name"], anew);

  // The old one says otherwise: by the calibration that both rest on, both are judged.
  Sql("UPDATE inspections SET verdict = 'NOT_CONFORM' WHERE inspection_id = '" + Id("inspection") + "'");
  Sql("UPDATE inspection_holes SET verdict = 'NOT_CONFORM' WHERE inspection_id = '" + Id("inspection") +
      "' AND position_index = 5");
  std::string sensor;
  for (const json& one : Run({"calibration", "list", "--json"}).said)
    if (one["kind"] == "CALIBRATION_KIND_SENSOR") sensor = one["name"];
  std::this_thread::sleep_for(std::chrono::milliseconds(1100));  // a recall is of whole seconds that are over
  const auto of_recall = LinesOf(Text({"rejudge", sensor, "--json"}));
  ASSERT_THAT(of_recall, SizeIs(1));  // the other one judges the same scans
  EXPECT_EQ(of_recall[0]["rejudged"], old);
  EXPECT_EQ(of_recall[0]["flips"], true);
  ASSERT_THAT(of_recall[0]["flipped_holes"], SizeIs(1)) << of_recall[0].dump(1);
  EXPECT_EQ(of_recall[0]["flipped_holes"][0]["before"], "VERDICT_NOT_CONFORM");
  EXPECT_EQ(of_recall[0]["total_count"], 2);
  EXPECT_EQ(of_recall[0]["flip_count"], 1);
  EXPECT_EQ(Count("inspections WHERE rejudges IS NOT NULL"), 2);

  // Its calibration is gone: refused one by one, with the reason; nothing is recorded.
  Run({"calibration", "withdraw", sensor.substr(sensor.find('/') + 1), "--reason", "dropped", "--json"});
  std::this_thread::sleep_for(std::chrono::milliseconds(1100));
  const auto refused = LinesOf(Text({"rejudge", sensor, "--json"}));
  ASSERT_THAT(refused, SizeIs(1));
  for (const json& one : refused) EXPECT_THAT(one["refusal"]["reason"].get<std::string>(), HasSubstr("CALIBRATION_"));
  EXPECT_EQ(Count("inspections WHERE rejudges IS NOT NULL"), 2);
}

TEST_F(RejudgeTest, RefusesWhatItCannotMean) {
  EXPECT_THAT(Text({"rejudge", "sensors/nobody", "--before", "2100-01-01"}), HasSubstr("recorded_before"));
  EXPECT_THAT(Text({"rejudge", "sensors/nobody"}), HasSubstr("0 judged anew"));
  EXPECT_THAT(Text({"rejudge", "inspections/4a3b1a52-2f0f-4f55-bd0b-0f7e1f0f8a11"}), HasSubstr("INSPECTION_NOT_FOUND"));
  EXPECT_THAT(Text({"rejudge", "calibrations/4a3b1a52-2f0f-4f55-bd0b-0f7e1f0f8a11"}), HasSubstr("NOT_FOUND"));
  EXPECT_THAT(Text({"rejudge", newest_["inspection"], "--sensor-calibration", "4a3b1a52-2f0f-4f55-bd0b-0f7e1f0f8a11"}),
              HasSubstr("sensor_calibration"));
}

}  // namespace
}  // namespace sixpoint::testing
