#include "cli/log_line.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <set>

#include "cli/log_tree.h"

namespace sixpoint::cli {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

std::string CallLine(const std::string& msg, const std::string& span, const std::string& parent, int end_ms,
                     double dur_ms, const std::string& rpc = "/sixpoint.plant.v1.PlantService/GetBlade") {
  char ts[40];
  std::snprintf(ts, sizeof ts, "2026-11-23T07:00:00.%03dZ", end_ms);
  return nlohmann::json({{"ts", ts},
                         {"level", "info"},
                         {"service", "x"},
                         {"msg", msg},
                         {"trace_id", "t"},
                         {"span_id", span},
                         {"parent_span_id", parent},
                         {"rpc", rpc},
                         {"code", "OK"},
                         {"dur_ms", dur_ms}})
      .dump();
}

TEST(LogLine, ACallIsOneRow) {
  const LogLine line = ParseLogLine(
      "ingest",
      R"({"ts":"2026-11-23T07:20:43.123Z","level":"info","service":"ingest","version":"v","msg":"call","trace_id":"4bf9",)"
      R"("span_id":"00f0","rpc":"/sixpoint.ingest.v1.ScanService/GetScan","caller":"users/jane","code":"OK","dur_ms":2.14})");
  EXPECT_EQ(RowOf(line),
            "2026-11-23 07:20:43.123  info     ingest        ScanService/GetScan  OK  2.1 ms  users/jane  trace=4bf9");
}

TEST(LogLine, AMessageHasItsFields) {
  const LogLine line = ParseLogLine(
      "plant", R"({"ts":"2026-11-23T07:20:43.123Z","level":"error","msg":"cannot listen","why":"in use","count":3})");
  EXPECT_THAT(RowOf(line), HasSubstr("error    plant         cannot listen  count=3  why=in use"));
}

// Whatever stands in a log, a terminal gets printable characters alone, and a program JSON in ASCII.
TEST(LogLine, NothingReachesATerminalAsItIs) {
  std::mt19937 random(7);
  const std::string seeds[] = {"\x1b]0;owned\x07",
                               "\x1b[2J",
                               "\xc2\x9b"
                               "31m",
                               "\xe2\x80\xae",
                               "\xe2\x81\xa6",
                               "\r\b\x7f",
                               "{\"ts\":\"2026-11-23T07:20:43.123Z\",\"msg\":\"\\u001b[2J\\u009b\\u202e\"}",
                               "{\"msg\":{\"a\":[1,\"\\u001b\"]},\"x\\u001b\":\"\\u0007\"}",
                               "{\"rpc\":5,\"msg\":\"call\",\"dur_ms\":\"x\"}",
                               "2026-11-23 07:20:43.123 UTC [7] LOG:  ",
                               "{\"ts\":\"9999-99-99T99:99:99.999Z\"}",
                               "2026-"};
  for (int round = 0; round < 3000; ++round) {
    std::string text;
    for (int i = 0; i < 3; ++i) text += seeds[random() % std::size(seeds)];
    for (int i = 0; i < 3 && !text.empty() && round % 2 == 1; ++i)
      text[random() % text.size()] = static_cast<char>(random());
    for (const char* source : {"ingest", "postgres", "supervisord"}) {
      const LogLine line = ParseLogLine(source, text);
      const std::string row = RowOf(line), json = JsonOf(line);
      for (std::size_t i = 0; i < row.size(); ++i) {
        const auto c = static_cast<unsigned char>(row[i]);
        ASSERT_TRUE(c >= 0x20 && c != 0x7f) << round;
        ASSERT_FALSE(c == 0xc2 && static_cast<unsigned char>(row[i + 1]) < 0xa0);
      }
      ASSERT_THAT(row, Not(HasSubstr("\xe2\x80\xae")));
      ASSERT_THAT(row, Not(HasSubstr("\xe2\x81\xa6")));
      for (const char c : json) ASSERT_TRUE(c >= 0x20) << json;
      ASSERT_TRUE(nlohmann::json::parse(json, nullptr, false).is_object());
    }
  }
}

TEST(LogLine, NoCharacterTurnsTheDirection) {
  // All of Unicode's Bidi_Control.
  for (const char* turns : {"\u061c", "\u200e", "\u200f", "\u202a", "\u202b", "\u202c", "\u202d", "\u202e", "\u2066",
                            "\u2067", "\u2068", "\u2069"}) {
    EXPECT_EQ(ForTerminal(std::string("a") + turns + turns + "b"), "a??b");
    EXPECT_EQ(ForTerminal(turns), "?");
  }
  EXPECT_EQ(ForTerminal("\u0613\u2010\u2030 \u2065\u206a"), "\u0613\u2010\u2030 \u2065\u206a");
}

TEST(LogTree, IsWhoCalledWhom) {
  LogTree tree;
  // Written at each call's end: the innermost first.
  const auto add = [&](const char* source, const std::string& text) {
    EXPECT_TRUE(tree.Add(ParseLogLine(source, text)));
  };
  add("plant", CallLine("call", "c", "b", 40, 20));
  add("ingest", CallLine("called", "b", "a", 45, 30));
  add("ingest", CallLine("called", "d", "a", 80, 10, "/sixpoint.plant.v1.PlantService/GetMachine"));
  add("ingest", R"({"ts":"2026-11-23T07:00:00.050Z","level":"warning","msg":"odd","trace_id":"t","span_id":"a"})");
  add("ingest", CallLine("call", "a", "nobody", 100, 100, "/sixpoint.ingest.v1.ScanService/UploadScan"));
  const std::string text = tree.ToText();
  const std::size_t upload = text.find("ingest  ScanService/UploadScan"),
                    blade = text.find("  plant  PlantService/GetBlade"),
                    machine = text.find("PlantService/GetMachine  OK  (asked by it"), odd = text.find("warning: odd");
  EXPECT_LT(upload, odd);
  EXPECT_LT(odd, blade);
  EXPECT_LT(blade, machine);
  EXPECT_NE(machine, std::string::npos) << text;
  EXPECT_THAT(text, HasSubstr("(30.0 ms to who asked)"));
  EXPECT_THAT(text, HasSubstr("      20.0 ms"));
  const nlohmann::json json = tree.ToJson();
  ASSERT_EQ(json["calls"].size(), 3u);
  EXPECT_EQ(json["calls"][1]["depth"], 1);
  EXPECT_EQ(json["calls"][1]["dur_ms_to_who_asked"], 30);
  EXPECT_EQ(json["lines"].size(), 1u);
}

// Whatever the lines say of their parents, each call is there once; an outgoing one may be one row with its answer.
TEST(LogTree, NoCallIsLost) {
  std::mt19937 random(11);
  for (int round = 0; round < 2000; ++round) {
    LogTree tree;
    const int count = 1 + static_cast<int>(random() % 6);
    for (int i = 0; i < count; ++i)
      tree.Add(ParseLogLine("ingest", CallLine(random() % 3 == 0 ? "called" : "call", std::to_string(i),
                                               std::to_string(random() % 7), 10 + i, 1)));
    int seen = 0;
    std::set<std::string> spans;
    const nlohmann::json json = tree.ToJson();
    for (const nlohmann::json& call : json["calls"]) {
      seen += call.contains("dur_ms_to_who_asked") ? 2 : 1;
      EXPECT_TRUE(spans.insert(call["span_id"]).second) << round;
    }
    ASSERT_EQ(seen, count) << round << "\n" << tree.ToText();
  }
}

TEST(LogTree, LinesThatLieDoNotHangIt) {
  LogTree tree;
  for (const auto& [span, parent] :
       {std::pair("a", "a"), std::pair("b", "c"), std::pair("c", "b"), std::pair("a", "b")})
    tree.Add(ParseLogLine("ingest", CallLine("call", span, parent, 10, -1e300)));
  EXPECT_FALSE(tree.ToText().empty());
  EXPECT_EQ(tree.ToJson()["calls"].size(), 3u);
  LogTree full;
  const LogLine line = ParseLogLine("ingest", CallLine("call", "a", "", 10, 1));
  std::size_t count = 0;
  while (full.Add(line)) ++count;
  EXPECT_EQ(count, LogTree::kMost);
}

}  // namespace
}  // namespace sixpoint::cli
