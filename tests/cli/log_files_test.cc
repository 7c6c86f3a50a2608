// A program's log, read over the moments at which it is moved on.
#include "cli/log_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <random>

namespace sixpoint::cli {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;

class LogFilesTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "sixpoint-logs-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { fs::remove_all(folder_); }

  void Append(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::app | std::ios::binary) << text;
  }
  static std::string Line(int number) {
    char text[120];
    std::snprintf(text, sizeof text, "{\"ts\":\"2026-11-23T07:%02d:%02d.000Z\",\"level\":\"info\",\"msg\":\"%d\"}\n",
                  number / 60 % 60, number % 60, number);
    return text;
  }
  // As supervisord does it.
  void Rotate(const std::string& name, int kept = 4) const {
    for (int i = kept - 1; i >= 1; --i)
      if (fs::exists(folder_ / (name + "." + std::to_string(i))))
        fs::rename(folder_ / (name + "." + std::to_string(i)), folder_ / (name + "." + std::to_string(i + 1)));
    fs::rename(folder_ / name, folder_ / (name + ".1"));
    Append(name, "");
  }
  LogFile Open(const std::string& source, LogStart start = {}) const {
    return LogFile(folder_ / (source + ".log"), source, geteuid(), start);
  }
  static std::vector<std::string> Messages(LogFile* file) {
    std::vector<std::string> messages;
    while (const auto line = file->Next())
      messages.push_back(line->fields.is_object() ? FieldText(*line, "msg") : line->text);
    return messages;
  }
  fs::path folder_;
};

TEST_F(LogFilesTest, ReadsFromTheOldestOn) {
  Append("ingest.log.2", Line(1));
  Append("ingest.log.1", Line(2));
  Append("ingest.log", Line(3));
  LogFile file = Open("ingest");
  EXPECT_THAT(Messages(&file), ElementsAre("1", "2", "3"));
  Append("ingest.log", Line(4));
  EXPECT_THAT(Messages(&file), ElementsAre("4"));
}

// Whenever it is moved on, however often between two looks: each line once, in order, and one that was cut in two whole.
TEST_F(LogFilesTest, LosesNothingWhileItIsMovedOn) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    for (const auto& entry : fs::directory_iterator(folder_)) fs::remove(entry.path());
    std::mt19937 random(seed);
    LogFile file = Open("ingest");
    int written = 0;
    std::vector<std::string> read;
    std::string rest;
    while (written < 300 || !rest.empty()) {
      if (rest.empty()) rest = Line(++written);
      const std::size_t part = random() % 3 == 0 ? random() % rest.size() : rest.size();
      Append("ingest.log", rest.substr(0, part));
      rest.erase(0, part);
      if (random() % 7 == 0) Rotate("ingest.log", 19);
      if (random() % 5 == 0)
        for (const std::string& message : Messages(&file)) read.push_back(message);
    }
    for (const std::string& message : Messages(&file)) read.push_back(message);
    ASSERT_EQ(read.size(), 300u) << "seed " << seed;
    for (int i = 0; i < 300; ++i)
      ASSERT_EQ(read[static_cast<std::size_t>(i)], std::to_string(i + 1)) << "seed " << seed;
    EXPECT_FALSE(file.has_lost());
  }
}

TEST_F(LogFilesTest, SaysWhereLinesAreGone) {
  Append("ingest.log", Line(1));
  LogFile file = Open("ingest");
  EXPECT_THAT(Messages(&file), ElementsAre("1"));
  for (int i = 2; i <= 9; ++i) {
    Rotate("ingest.log", 2);
    Append("ingest.log", Line(i));
  }
  EXPECT_THAT(Messages(&file), ElementsAre("7", "8", "9"));
  EXPECT_TRUE(file.has_lost());
}

TEST_F(LogFilesTest, AFileThatIsCutBeginsAnew) {
  Append("ingest.log", Line(1) + Line(2));
  LogFile file = Open("ingest");
  EXPECT_THAT(Messages(&file), ElementsAre("1", "2"));
  fs::resize_file(folder_ / "ingest.log", 0);
  EXPECT_THAT(Messages(&file), ElementsAre());
  Append("ingest.log", Line(3));
  EXPECT_THAT(Messages(&file), ElementsAre("3"));
}

TEST_F(LogFilesTest, HoldsNoMoreThanALine) {
  Append("ingest.log", std::string(1 << 20, 'x') + "\n" + Line(1) + "half");
  LogFile file = Open("ingest");
  const auto first = file.Next();
  ASSERT_TRUE(first);
  EXPECT_EQ(first->text.size(), kLongestLine_bytes);
  EXPECT_EQ(FieldText(file.Next().value(), "msg"), "1");
  EXPECT_FALSE(file.Next());
  EXPECT_EQ(file.HalfLine().value().text, "half");
}

TEST_F(LogFilesTest, BeginsNearTheEnd) {
  for (int i = 1; i <= 100; ++i) Append(i <= 50 ? "ingest.log.1" : "ingest.log", Line(i));
  LogStart start;
  start.last_bytes = static_cast<std::int64_t>(Line(10).size() * 60);
  LogFile file = Open("ingest", start);
  const std::vector<std::string> messages = Messages(&file);
  EXPECT_GE(messages.size(), 55u);
  EXPECT_LE(messages.size(), 60u);
  EXPECT_EQ(messages.back(), "100");
}

TEST_F(LogFilesTest, ReadsOnlyItsOwnersFiles) {
  Append("secret", Line(1));
  fs::create_symlink(folder_ / "secret", folder_ / "ingest.log");
  LogFile link = Open("ingest");
  EXPECT_THAT(Messages(&link), ElementsAre());
  LogFile foreign(folder_ / "secret", "ingest", geteuid() + 1, {});
  EXPECT_THAT(Messages(&foreign), ElementsAre());
  fs::create_directory(folder_ / "plant.log");
  ASSERT_EQ(mkfifo((folder_ / "watchdog.log").c_str(), 0600), 0);
  for (const char* name : {"plant", "watchdog", "nothing"}) {
    LogFile file = Open(name);
    EXPECT_FALSE(file.Next()) << name;
  }
}

TEST_F(LogFilesTest, AllTogetherComeInTheOrderOfTime) {
  setenv("TZ", "UTC", 1);
  Append("plant.log", Line(1) + Line(4));
  Append("postgres.log",
         "2026-11-23 07:00:02.000 UTC [7] ERROR:  no\n2026-11-23 07:00:02.000 UTC [7] STATEMENT:  SELECT\n\tmore\n");
  Append("supervisord.log", "2026-11-23 07:00:03,500 INFO spawned: 'plant' with pid 7\n");
  Append("ingest.log", "terminate called\n" + Line(5));
  std::vector<LogFile> files =
      LogFilesIn(folder_, {"plant", "postgres", "supervisord", "ingest"}, geteuid(), LogStart());
  std::vector<std::string> rows;
  ForEachLogLine(&files, true, [&](const LogLine& line) {
    rows.push_back(RowOf(line).substr(17));
    return true;
  });
  EXPECT_THAT(
      rows,
      ElementsAre("01.000  info     plant         1", "02.000  error    postgres      ERROR:  no",
                  "02.000  error    postgres      STATEMENT:  SELECT", "02.000  error    postgres      ?more",
                  "03.500  info     supervisord   spawned: 'plant' with pid 7", "04.000  info     plant         4",
                  "05.000           ingest        terminate called", "05.000  info     ingest        5"));
}

}  // namespace
}  // namespace sixpoint::cli
