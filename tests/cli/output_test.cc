#include "cli/output.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace sixpoint::cli {
namespace {

using ::testing::HasSubstr;

TEST(TimeOf, ReadsDaysAndTimes) {
  EXPECT_EQ(TimeOf("--since", "1970-01-02")->seconds(), 86400);
  EXPECT_EQ(TimeOf("--since", "1970-01-01 00:01:00Z")->seconds(), 60);
  EXPECT_EQ(TimeOf("--since", "1970-01-01T01:00:00+01:00")->seconds(), 0);
  EXPECT_THAT(std::string(TimeOf("--since", "yesterday").status().message()),
              HasSubstr("--since: yesterday, want a time"));
}

TEST(NameText, TakesAnIdOrTheNameThatAnotherCommandPrinted) {
  EXPECT_EQ(NameText("scans", "s1"), "scans/s1");
  EXPECT_EQ(NameText("scans", "scans/s1"), "scans/s1");
  EXPECT_EQ(CalibrationNameText("c1"), "calibrations/c1");
  EXPECT_EQ(CalibrationNameText("calibrations/c1"), "calibrations/c1");
}

TEST(NameText, TakesAnIdThatIsCalledAsItsCollection) { EXPECT_EQ(NameText("scans", "scans"), "scans/scans"); }

}  // namespace
}  // namespace sixpoint::cli
