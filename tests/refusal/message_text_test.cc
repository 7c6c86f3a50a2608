#include "refusal/message_text.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <limits>

namespace sixpoint {
namespace {

TEST(NumberText, IsTheNumberAsItWasGiven) {
  EXPECT_EQ(NumberText(-0.025), "-0.025");
  EXPECT_EQ(NumberText(0.1 + 0.2), "0.30000000000000004");
  EXPECT_EQ(NumberText(1'000'000), "1000000");
  EXPECT_EQ(NumberText(1e300), "1e+300");
}

TEST(NumberText, ReadsBackAsTheSameNumber) {
  for (const double value : {0.1, 1.0 / 3, 1e-300, -2.5, 202.7765, 4.9e-324, 123456789.0, 1e15, -1e15 + 1})
    EXPECT_EQ(std::strtod(NumberText(value).c_str(), nullptr), value);
}

TEST(NumberText, SaysWhatIsNoNumber) {
  for (const auto text : {NumberText, Rounded}) {
    EXPECT_EQ(text(std::numeric_limits<double>::quiet_NaN()), "NaN");
    EXPECT_EQ(text(std::numeric_limits<double>::infinity()), "inf");
    EXPECT_EQ(text(-std::numeric_limits<double>::infinity()), "-inf");
  }
}

TEST(Rounded, KeepsSixDigitsAndNoZerosBehind) {
  EXPECT_EQ(Rounded(0.1 + 0.2), "0.3");
  EXPECT_EQ(Rounded(89.99999999999999), "90");
  EXPECT_EQ(Rounded(12.3456789), "12.3457");
}

// Neither the controls of ASCII nor those that UTF-8 has beside them (U+0080 to U+009F), which terminals obey as well.
TEST(Tame, LeavesNoControlCharacter) {
  EXPECT_EQ(Tame("\x1b[2J\x7f\n", 80), "?[2J??");
  EXPECT_EQ(Tame("\xc2\x9b"
                 "31m \xc2\x80 \xc2\x9f",
                 80),
            "??31m ?? ??");
  EXPECT_EQ(Tame("\xc2\xa0\xc2\xb5\xc3\xa4 \xe2\x82\xac", 80), "\xc2\xa0\xc2\xb5\xc3\xa4 \xe2\x82\xac");
  EXPECT_EQ(Tame("\xc2", 80), "?");
}

}  // namespace
}  // namespace sixpoint
