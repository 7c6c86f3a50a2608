#include "cli/last_words.h"

#include <gtest/gtest.h>

namespace sixpoint::cli {
namespace {

std::string Line(const std::string& level, const std::string& message, const std::string& more = "") {
  return "{\"ts\":\"2026-11-22T15:00:00.000Z\",\"level\":\"" + level + "\",\"service\":\"ingest\",\"msg\":\"" +
         message + "\"" + more + "}\n";
}

TEST(LastWords, AreTheLastWarningOrError) {
  EXPECT_EQ(LastWordsOf(Line("info", "listening") + Line("warning", "not ready: schema version: 9, want 10")),
            "schema version: 9, want 10");
  EXPECT_EQ(LastWordsOf(Line("error", "cannot listen", ",\"address\":\"127.0.0.1:7401\"") + Line("info", "stopped")),
            "cannot listen 127.0.0.1:7401");
  EXPECT_EQ(LastWordsOf(Line("error", "cannot know its callers", ",\"why\":\"certificates: /x, want a key\"")),
            "cannot know its callers: certificates: /x, want a key");
}

TEST(LastWords, OfAnEarlierLifeDoNotCount) {
  EXPECT_EQ(LastWordsOf(Line("warning", "not ready: fsync: off") + Line("info", "serving")), "");
  EXPECT_EQ(LastWordsOf(Line("error", "cannot listen") + Line("info", "listening")), "");
  EXPECT_EQ(LastWordsOf(""), "");
}

TEST(LastWords, AreNotThoseOfACall) {
  EXPECT_EQ(LastWordsOf(Line("warning", "not ready: fsync: off") + Line("error", "call") +
                        Line("error", "Failed accept4", ",\"from\":\"grpc\"")),
            "fsync: off");
}

TEST(LastWords, MayBeNoLogLine) {
  EXPECT_EQ(LastWordsOf(Line("info", "stopped") + "sixpoint-ingest: --blob-store: no file /x\n"),
            "sixpoint-ingest: --blob-store: no file /x");
  EXPECT_EQ(LastWordsOf("[1, 2]\n{\"level\": 3}\n\x1b[2Jred\n").find('\x1b'), std::string::npos);
}

}  // namespace
}  // namespace sixpoint::cli
