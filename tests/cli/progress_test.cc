#include "cli/progress.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <functional>
#include <string>

#include "tests/cli/terminal.h"

namespace sixpoint::cli {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

std::string OnAFile(const std::function<void()>& work) {
  ::testing::internal::CaptureStderr();
  work();
  return ::testing::internal::GetCapturedStderr();
}

TEST(ProgressLine, ChangesOnATerminalAndLeavesItEmpty) {
  const std::string seen = OnATerminal([] {
    ProgressLine line(/*quiet=*/false);
    line.Show("one");
    line.Show("two");
  });
  EXPECT_EQ(seen, "\r\x1b[Kone\r\x1b[Ktwo\r\x1b[K");
}

TEST(ProgressLine, SaysLittleElsewhere) {
  EXPECT_EQ(OnAFile([] {
              ProgressLine line(/*quiet=*/false);
              line.Show("one");
              line.Show("two");
            }),
            "");
  EXPECT_EQ(OnAFile([] { ProgressLine(/*quiet=*/false).Keep("the end"); }), "the end\n");
}

TEST(Progress, EndsWithHowFarItCame) {
  const std::string text = OnAFile([] {
    Progress progress("upload", "points", 2000, /*quiet=*/false);
    progress.Add(500);
    progress.Add(500);
  });
  EXPECT_THAT(text, StartsWith("upload [############............] 50 %  1 000 of 2 000 points"));
}

TEST(Elapsed, TellsTheSecondsOnATerminal) {
  const std::string seen = OnATerminal([] {
    const Elapsed elapsed("calibrating", /*quiet=*/false);
    usleep(1'300'000);
  });
  EXPECT_THAT(seen, HasSubstr("calibrating, 1 s"));
}

TEST(Progress, IsSilentWhereAProgramReads) {
  const auto all = [] {
    ProgressLine line(/*quiet=*/true);
    line.Show("one");
    line.Keep("two");
    Progress("upload", "points", 1, /*quiet=*/true).Add(1);
    const Elapsed elapsed("calibrating", /*quiet=*/true);
  };
  EXPECT_EQ(OnATerminal(all), "");
  EXPECT_EQ(OnAFile(all), "");
}

}  // namespace
}  // namespace sixpoint::cli
