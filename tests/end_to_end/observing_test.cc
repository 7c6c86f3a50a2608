// What a plant writes of itself: one trace through all services, nothing that is secret, and `sixpoint logs` that reads it.
#include <gmock/gmock.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <thread>

#include "tests/end_to_end/plant_on_this_machine.h"
#include "tests/end_to_end/plant_processes.h"

namespace sixpoint::testing {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;

class ObservingTest : public PlantOnThisMachine {
 protected:
  // A scan of the artefact as a program without names sends it, within a trace of its own.
  Answer UploadScan(const std::string& id, const std::string& traceparent) {
    const fs::path cloud = folder_ / "cloud.xyz",
                   examples = fs::path(std::getenv("SIXPOINT_SOURCE_DIR")) / "docs/examples";
    std::ofstream points(cloud);
    points.precision(17);
    for (int profile = 0; profile < 40; ++profile)
      for (int column = 0; column < 200; ++column)
        points << 0.2 * profile << " " << 0.05 * column - 5 + 0.0001234567 << " " << 0.1 * std::sin(column) << "\n";
    points.close();
    setenv("TRACEPARENT", traceparent.c_str(), 1);
    for (const char* kind : {"machine", "artefact"}) {
      const Answer added =
          Run({kind, "add", (examples / (std::string(kind) + ".yaml")).string(), "--server", At("127.0.0.1")});
      EXPECT_EQ(added.exit_code, 0) << added.text;
    }
    const auto id_of = [&](const char* kind) {
      return json::parse(Run({kind, "list", "--json", "--server", At("127.0.0.1")}).text)[0]["name"].get<std::string>();
    };
    machine_ = id_of("machine");
    const Answer answer = Run({"scan",
                               "upload",
                               cloud.string(),
                               "--machine",
                               machine_.substr(9),
                               "--subject",
                               id_of("artefact"),
                               "--kind",
                               "artefact",
                               "--v0-mm",
                               "-60,-90,281",
                               "--a-deg",
                               "0",
                               "--b-deg",
                               "0",
                               "--pitch-mm",
                               "0.2",
                               "--scan-id",
                               id,
                               "--server",
                               At("127.0.0.1")});
    unsetenv("TRACEPARENT");
    return answer;
  }
  json Logs(std::vector<std::string> words) {
    words.insert(words.begin(), {"logs", "--data", data(), "--json"});
    return json::parse(Run(words).text, nullptr, false);
  }
  std::string AllLogs() const {
    std::string all;
    for (const auto& entry : fs::directory_iterator(data() + "/log")) all += ReadFile(entry.path().string());
    return all;
  }
  std::string machine_;
};

constexpr char kTraceId[] = "4bf92f3577b34da6a3ce929d0e0e4736";

TEST_F(ObservingTest, OneTraceRunsThroughAllServices) {
  ASSERT_EQ(Up().exit_code, 0);
  const Answer uploaded = UploadScan("s-1", std::string("00-") + kTraceId + "-00f067aa0ba902b7-01");
  ASSERT_EQ(uploaded.exit_code, 0) << uploaded.text;
  json trace;
  // A line is written once its call has ended, a moment after its client knows.
  for (int i = 0; i < 100; ++i) {
    trace = Logs({"--trace", kTraceId});
    if (trace.is_object() && trace.dump().find("UploadScan") != std::string::npos) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }
  ASSERT_TRUE(trace.is_object());
  EXPECT_EQ(trace["trace_id"], kTraceId);
  const json *upload = nullptr, *machine = nullptr;
  for (const json& call : trace["calls"]) {
    if (call["rpc"] == "/sixpoint.ingest.v1.ScanService/UploadScan") upload = &call;
    if (call["rpc"] == "/sixpoint.plant.v1.PlantService/GetMachine" && upload != nullptr) machine = &call;
  }
  ASSERT_NE(upload, nullptr);
  ASSERT_NE(machine, nullptr) << trace.dump(1);
  EXPECT_EQ((*upload)["service"], "ingest");
  EXPECT_EQ((*upload)["scan"], "scans/s-1");
  EXPECT_EQ((*upload)["machine"], machine_);
  EXPECT_THAT((*upload)["caller"].get<std::string>(), HasSubstr("users/"));
  EXPECT_EQ((*machine)["service"], "plant");
  EXPECT_EQ((*machine)["caller"], "services/ingest");
  EXPECT_EQ((*machine)["depth"], (*upload)["depth"].get<int>() + 1);
  EXPECT_GE((*machine)["dur_ms_to_who_asked"].get<double>(), 0);
  EXPECT_EQ(trace["calls"][0]["depth"], 0);
  const std::string tree = Run({"logs", "--data", data(), "--trace", std::string(kTraceId).substr(0, 8)}).text;
  EXPECT_THAT(tree, HasSubstr("ingest  ScanService/UploadScan  OK"));
  EXPECT_THAT(tree, HasSubstr("plant  PlantService/GetMachine  OK  services/ingest"));

  // Each span once, each parent of a callee there, times within each other.
  std::set<std::string> spans;
  std::istringstream lines(AllLogs());
  for (std::string text; std::getline(lines, text);) {
    const json line = json::parse(text, nullptr, false);
    if (!line.is_object() || !line.contains("resourceSpans") || line["trace_id"] != kTraceId) continue;
    const json& span = line["resourceSpans"][0]["scopeSpans"][0]["spans"][0];
    EXPECT_TRUE(spans.insert(span["spanId"].get<std::string>()).second);
    EXPECT_EQ(span["traceId"], kTraceId);
    EXPECT_LT(text.size(), 2048u);
  }
  EXPECT_GE(spans.size(), trace["calls"].size());

  // By what it is about.
  const Answer about = Run({"logs", "--data", data(), "--scan", "s-1"});
  EXPECT_THAT(about.text, HasSubstr("ScanService/UploadScan"));
  EXPECT_THAT(about.text, Not(HasSubstr("ListMachines")));
  // The id that a failure names leads to its trace.
  const Answer failed = Run({"scan", "show", "nothing", "--server", At("127.0.0.1")});
  EXPECT_EQ(failed.exit_code, 1);
  const std::size_t at = failed.text.find("trace: ");
  ASSERT_NE(at, std::string::npos) << failed.text;
  std::string found;
  for (int i = 0; i < 50 && found.find("NOT_FOUND") == std::string::npos; ++i)
    found = Run({"logs", "--data", data(), "--trace", failed.text.substr(at + 7, 32)}).text;
  EXPECT_THAT(found, HasSubstr("ScanService/GetScan  NOT_FOUND"));
}

// Passwords, keys, codes, tokens and clouds that come by are in no log.
TEST_F(ObservingTest, NothingSecretIsWritten) {
  ASSERT_EQ(Up().exit_code, 0);
  ASSERT_EQ(UploadScan("s-2", "").exit_code, 0);
  const std::string offered =
      Run({"certs", "offer", "machines/m-9", "--data", data(), "--server", At("127.0.0.1")}).text;
  std::string code;
  std::istringstream printed(offered);
  for (std::string word; printed >> word;)
    if (word.size() >= 20 && word.find('-') != std::string::npos && word.find('/') == std::string::npos) code = word;
  ASSERT_NE(code, "") << offered;
  std::string wrong = code;
  wrong[2] = wrong[2] == 'A' ? 'B' : 'A';
  for (const std::string& tried : {wrong, code})
    EXPECT_EQ(
        Run({"certs", "take", "--code", tried, "--folder", (folder_ / "m9").string(), "--server", At("127.0.0.1")})
                .exit_code == 0,
        tried == code);
  const std::string key = "-----BEGIN PRIVATE KEY-----\\nMIGHAgEAMBsecretkeyMHcCAQ\\n-----END PRIVATE KEY-----";
  for (const char* rpc : {"PlantService/GetMachine", "ScanService/GetScan"})
    EXPECT_NE(
        Run({"call", rpc, "{\"name\": \"" + key + " password=topsecret\"}", "--server", At("127.0.0.1")}).exit_code, 0);
  // A service with a password in its connection string, which it cannot use, and a database that it cannot reach.
  for (const char* database :
       {"host=/nowhere password=topsecret dbname=x", "host=/nowhere password=top secret-too dbname=x",
        "postgresql://sixpoint:topsecret@127.0.0.1:1/x"}) {
    Process service({PlantProcesses::Program("sixpoint-ingest"), "--listen", "unix:" + (folder_ / "s").string(),
                     "--database", database, "--certificates", data() + "/certificates/ingest", "--revoked",
                     data() + "/certificates/revoked.pem"},
                    data() + "/log/other.log");
    for (int i = 0; i < 100 && ReadFile(data() + "/log/other.log").find("not ready") == std::string::npos; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  ASSERT_EQ(Run({"down", "--data", data()}).exit_code, 0);
  const std::string logs = AllLogs();
  EXPECT_THAT(logs, HasSubstr("UploadScan"));
  for (const char* secret : {"topsecret", "secret-too", "secretkey", "PRIVATE KEY", "0.00012345", "-4.99987"})
    EXPECT_THAT(logs, Not(HasSubstr(secret))) << secret;
  // The codes, as they are printed and without what parts them, and the lines of every private key that there is.
  for (std::string secret : {code, wrong}) {
    EXPECT_EQ(logs.find(secret), std::string::npos);
    secret.erase(std::remove(secret.begin(), secret.end(), '-'), secret.end());
    EXPECT_EQ(logs.find(secret), std::string::npos);
  }
  int keys = 0;
  for (const auto& entry : fs::recursive_directory_iterator(data())) {
    if (entry.path().extension() != ".pem") continue;
    std::istringstream pem(ReadFile(entry.path().string()));
    bool in_key = false;
    for (std::string line; std::getline(pem, line);) {
      if (line.find("PRIVATE KEY") != std::string::npos) in_key = line.find("BEGIN") != std::string::npos;
      if (!in_key || line.find("-----") != std::string::npos) continue;
      EXPECT_EQ(logs.find(line), std::string::npos) << entry.path();
      ++keys;
    }
  }
  EXPECT_GE(keys, 7);
  // And every line that a service wrote is one object, with what all of them have.
  int count = 0;
  for (const std::string& area : PlantProcesses::Areas()) {
    std::istringstream lines(ReadFile(data() + "/log/" + area + ".log"));
    for (std::string text; std::getline(lines, text); ++count) {
      const json line = json::parse(text, nullptr, false);
      ASSERT_TRUE(line.is_object()) << text;
      for (const char* field : {"ts", "level", "service", "version", "msg"}) EXPECT_TRUE(line.contains(field)) << text;
      EXPECT_EQ(line["service"], area);
    }
  }
  EXPECT_GT(count, 20);
}

TEST_F(ObservingTest, TheLogsOfAllProgramsInOneOrder) {
  ASSERT_EQ(Up().exit_code, 0);
  const std::string ingest = data() + "/log/ingest.log";
  ServiceShellOutput("printf \"\\033[2J\\302\\233 owned\\n{\\\"msg\\\":\\\"half\" >> " + ingest);
  const Answer all = Run({"logs", "--data", data(), "--lines", "0"});
  EXPECT_EQ(all.exit_code, 0);
  for (const std::string& area : PlantProcesses::Areas()) EXPECT_THAT(all.text, HasSubstr("  " + area + " "));
  EXPECT_THAT(all.text, HasSubstr("postgres      LOG:  database system is ready to accept connections"));
  EXPECT_THAT(all.text, HasSubstr("supervisord   spawned: 'ingest' with pid"));
  EXPECT_THAT(all.text, HasSubstr("?[2J?? owned"));
  EXPECT_THAT(all.text, HasSubstr("{\"msg\":\"half"));
  EXPECT_EQ(all.text.find('\x1b'), std::string::npos);
  std::istringstream rows(all.text);
  std::string before;
  for (std::string row; std::getline(rows, row); before = row.substr(0, 23))
    EXPECT_LE(before, row.substr(0, 23)) << row;
  const Answer few = Run({"logs", "postgres", "--data", data(), "-n", "2"});
  EXPECT_EQ(std::count(few.text.begin(), few.text.end(), '\n'), 2);
  EXPECT_EQ(Run({"logs", "nobody", "--data", data()}).exit_code, 2);
  EXPECT_EQ(Run({"logs", "--trace", "xyz", "--data", data()}).exit_code, 1);
  EXPECT_THAT(Run({"logs", "--trace", "00000000", "--data", data()}).text,
              HasSubstr("want one of which these logs still have a line"));

  // What comes is shown, over the file's being moved on.
  ServiceShellOutput("printf \"\\\"}\\n\" >> " + ingest);
  const std::string followed = (folder_ / "followed").string();
  Process follow({PlantProcesses::Program("sixpoint"), "logs", "ingest", "--follow", "--data", data(), "-n", "5"},
                 followed);
  const auto shown = [&](const std::string& text) {
    for (int i = 0; i < 300 && ReadFile(followed).find(text) == std::string::npos; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    return ReadFile(followed);
  };
  EXPECT_THAT(shown("half"), HasSubstr("half"));
  ServiceShellOutput("mv " + ingest + " " + ingest + ".1; echo later > " + ingest);
  EXPECT_THAT(shown("later"), HasSubstr("later"));
  follow.Kill();
}

}  // namespace
}  // namespace sixpoint::testing
