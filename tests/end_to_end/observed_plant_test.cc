// A plant as `sixpoint up` starts it, at work, watched by a real Prometheus with the file that `up` wrote for it: every expression of
// every dashboard and alert finds something to show.
#include <gmock/gmock.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "tests/end_to_end/plant_on_this_machine.h"
#include "tests/end_to_end/plant_processes.h"
#include "tests/support/becomes.h"
#include "tests/support/https_get.h"

namespace sixpoint::testing {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using namespace std::chrono_literals;
using ::testing::HasSubstr;

// Of the five services and the plant's own, and with the gateway, which has no database to be ready with.
constexpr std::size_t kServiceCount = 6, kTargetCount = kServiceCount + 1;

std::string Encoded(const std::string& text) {
  std::string encoded;
  for (const unsigned char c : text) {
    char hex[4];
    std::snprintf(hex, sizeof hex, "%%%02X", c);
    encoded += std::isalnum(c) ? std::string(1, static_cast<char>(c)) : hex;
  }
  return encoded;
}

// By "dashboard: panel", what is to be shown; of the alerts too, without the number that each is compared with.
struct Query {
  std::string where, expression;
};

fs::path ObserveFolder() {
  const char* const source = std::getenv("SIXPOINT_SOURCE_DIR");
  return fs::path(source == nullptr ? "." : source) / "deploy" / "observe";
}

std::vector<Query> QueriesOfDashboards() {
  std::vector<Query> queries;
  std::set<std::string> uids;
  for (const auto& file : fs::directory_iterator(ObserveFolder() / "dashboards")) {
    const json board = json::parse(ReadFile(file.path()), nullptr, false);
    EXPECT_TRUE(board.is_object()) << file.path();
    EXPECT_EQ(board["uid"].get<std::string>() + ".json", file.path().filename()) << "the uid is fixed";
    EXPECT_TRUE(uids.insert(board["uid"]).second);
    EXPECT_EQ(board["templating"]["list"][0]["name"], "DS_PROMETHEUS");
    std::set<int> ids;
    for (const json& panel : board["panels"]) {
      EXPECT_TRUE(ids.insert(panel["id"].get<int>()).second) << panel["title"];
      EXPECT_EQ(panel["datasource"]["uid"], "${DS_PROMETHEUS}") << panel["title"];
      for (const json& target : panel["targets"])
        queries.push_back({board["title"].get<std::string>() + ": " + panel["title"].get<std::string>(),
                           target["expr"].get<std::string>()});
    }
  }
  EXPECT_GE(uids.size(), 5u);
  return queries;
}

class ObservedPlantTest : public PlantOnThisMachine {
 protected:
  json Ask(const std::string& path) const {
    const HttpsAnswer answer =
        HttpsGet("http://127.0.0.1:" + std::to_string(port_ + 19) + "/api/v1/" + path, folder_ / "nobody");
    const json parsed = json::parse(answer.body, nullptr, false);
    return parsed.is_object() && parsed.contains("data") ? parsed["data"] : json::object();
  }
  std::size_t SeriesOf(const std::string& expression) const {
    const json data = Ask("query?query=" + Encoded(expression));
    return data.contains("result") ? data["result"].size() : 0;
  }
  std::size_t TargetsUp() const {
    std::size_t up = 0;
    const json targets = Ask("targets");
    for (const json& target : targets.value("activeTargets", json::array())) up += target["health"] == "up";
    return up;
  }
  // Every rule was evaluated, and none was wrong.
  std::vector<Query> QueriesOfAlerts() const {
    std::vector<Query> queries;
    const json groups = Ask("rules").value("groups", json::array());
    for (const json& group : groups)
      for (const json& rule : group["rules"]) {
        EXPECT_EQ(rule["health"], "ok") << rule.dump(1);
        EXPECT_NE(rule["state"], "firing") << rule.dump(1);
        const std::string expression = rule["query"];
        static const std::regex comparison(" [<>] -?[0-9.e+]+$");
        EXPECT_TRUE(std::regex_search(expression, comparison)) << expression;
        queries.push_back({rule["name"], std::regex_replace(expression, comparison, "")});
      }
    return queries;
  }
  bool RulesAreEvaluated() const {
    const std::string rules = Ask("rules").dump();
    return rules.find("\"health\":\"ok\"") != std::string::npos &&
           rules.find("\"health\":\"unknown\"") == std::string::npos;
  }
};

TEST_F(ObservedPlantTest, EveryDashboardAndAlertFindsSomethingToShow) {
  if (std::system("command -v prometheus promtool >/dev/null") != 0) GTEST_SKIP() << "SKIPPED: no prometheus";
  const Answer up = Up();
  ASSERT_EQ(up.exit_code, 0) << up.text;
  EXPECT_THAT(up.text, HasSubstr("metrics       https://" + At("127.0.0.1").substr(0, 10) + std::to_string(port_ + 20) +
                                 "/metrics"));
  const std::string config = data() + "/prometheus.yml";
  EXPECT_THAT(ShellOutput("promtool check config " + config), HasSubstr("SUCCESS"));
  const std::string log = (folder_ / "prometheus.log").string();
  Process prometheus(
      {"/usr/bin/prometheus", "--config.file=" + config, "--storage.tsdb.path=" + (folder_ / "tsdb").string(),
       "--web.listen-address=127.0.0.1:" + std::to_string(port_ + 19)},
      log);

  const std::string report = (folder_ / "report.json").string(), output = (folder_ / "demo.log").string();
  Process demo({PlantProcesses::Program("sixpoint-simulator"), "demo", "--server", At("127.0.0.1"), "--machines", "1",
                "--seed", "1", "--airfoil-pitch-mm", "0.4", "--pins-pitch-mm", "0.15", "--report", report},
               output);
  ASSERT_EQ(demo.Wait(240), 0) << ReadFile(output);
  EXPECT_TRUE(Becomes(60s, [&] { return TargetsUp() == kTargetCount; })) << Ask("targets").dump(1) << ReadFile(log);
  EXPECT_TRUE(Becomes(60s, [&] { return RulesAreEvaluated(); }));

  const auto value = [&](const std::string& expression) {
    const json data = Ask("query?query=" + Encoded(expression));
    return data.contains("result") && !data["result"].empty()
               ? std::stod(data["result"][0]["value"][1].get<std::string>())
               : -1;
  };
  // What is told is what the record says, to the last point.
  for (const auto& [metric, sql] : std::vector<std::pair<std::string, std::string>>{
           {"sum(sixpoint_registrations_total)", "SELECT count(*) FROM registrations"},
           {"sixpoint_registration_compute_seconds_count", "SELECT count(*) FROM registrations"},
           {"sixpoint_registrations_total{outcome='CONVERGED'}",
            "SELECT count(*) FROM registrations WHERE outcome = 'CONVERGED'"},
           {"sum(sixpoint_corrections_total)", "SELECT count(*) FROM corrections"},
           {"sum(sixpoint_inspections_total)", "SELECT count(*) FROM inspections"},
           {"sixpoint_ingest_scans_total", "SELECT count(*) FROM scans"},
           {"sixpoint_ingest_points_total", "SELECT sum(point_count) FROM scans"},
           {"sixpoint_ingest_blocks_total", "SELECT sum(block_count) FROM scans"},
           {"sixpoint_ingest_stored_bytes_total", "SELECT sum(stored_bytes) FROM scans"},
           {"sixpoint_blob_bytes{store='postgresql'}", "SELECT sum(kept_bytes) FROM blob_use"},
           {"sixpoint_record_head_sequence", "SELECT max(record_sequence) FROM record_names"}}) {
    const double wanted = std::stod("0" + Sql(sql));
    EXPECT_GT(wanted, 0) << sql;
    EXPECT_TRUE(Becomes(60s, [&] { return value(metric) == wanted; }))
        << metric << ": " << value(metric) << ", want " << wanted;
  }
  EXPECT_EQ(value("sixpoint_record_months_ahead"), 3);
  EXPECT_GE(value("sixpoint_blob_bytes{store='postgresql'}"), 1e5);
  EXPECT_TRUE(Becomes(60s, [&] { return value("count(sixpoint_calibration_age_seconds)") >= 2; }));
  EXPECT_EQ(value("sum(sixpoint_ready)"), kServiceCount);
  EXPECT_EQ(value("sum(sixpoint_denials_total)"), 0);

  std::vector<Query> queries = QueriesOfDashboards();
  const std::vector<Query> alerts = QueriesOfAlerts();
  EXPECT_GE(alerts.size(), 20u);
  queries.insert(queries.end(), alerts.begin(), alerts.end());
  // A rate has something to say once there are two scrapes.
  std::string missing;
  EXPECT_TRUE(Becomes(60s, [&] {
    missing.clear();
    for (const Query& query : queries)
      if (SeriesOf(query.expression) == 0) missing += query.where + ": " + query.expression + "\n";
    return missing.empty();
  })) << missing;
  std::printf("%zu expressions, each with at least one series; %.0f series in all\n", queries.size(),
              value("count({__name__=~'.+',job='sixpoint'})"));
}

}  // namespace
}  // namespace sixpoint::testing
