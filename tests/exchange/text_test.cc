#include "exchange/text.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "exchange/verdicts.h"

namespace sixpoint::exchange {
namespace {

using std::chrono::nanoseconds;
using std::chrono::seconds;
using std::chrono::system_clock;

TEST(DecimalText, ReadsBackToTheBit) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> mantissa(-1, 1);
  std::uniform_int_distribution<int> exponent(-16, 40);
  for (int i = 0; i < 100000; ++i) {
    const double value = std::ldexp(mantissa(random), exponent(random));
    const std::string text = DecimalText(value);
    EXPECT_EQ(text.find_first_of("eE"), std::string::npos) << text;
    EXPECT_TRUE(std::abs(value) < 1e-6 || NumberOf(text) == value) << text;
    EXPECT_NEAR(*NumberOf(text), value, 1e-22) << text;
    EXPECT_LE(text.size(), 26u) << text;
  }
  EXPECT_EQ(DecimalText(0), "0");
  EXPECT_EQ(DecimalText(0.1), "0.1");
  EXPECT_EQ(DecimalText(-12), "-12");
  EXPECT_EQ(DecimalText(3.552713678800501e-15), "0.0000000000000035527137");
  EXPECT_EQ(DecimalText(1e-300), "0");
}

TEST(NumberOf, TakesWholeFiniteNumbersOnly) {
  EXPECT_EQ(NumberOf(" +1.5\n"), 1.5);
  for (const char* text : {"", " ", "1,5", "1.5mm", "nan", "inf", "1e999", "+-1", "0x10", "--1"})
    EXPECT_FALSE(NumberOf(text)) << text;
}

TEST(TimeText, ReadsBackToTheNanosecond) {
  const system_clock::time_point time(seconds(1795000000) + nanoseconds(123456789));
  EXPECT_EQ(TimeText(time), "2026-11-18T11:06:40.123456789Z");
  EXPECT_EQ(TimeOf(TimeText(time)), time);
  EXPECT_EQ(TimeOf("2026-11-18T12:06:40.5+01:00"), system_clock::time_point(nanoseconds(1795000000500000000)));
  EXPECT_EQ(TimeText(system_clock::time_point(seconds(0))), "1970-01-01T00:00:00Z");
  for (const char* text : {"", "2026", "2026-02-30T00:00:00Z", "2026-11-18T24:00:00Z", "2026-11-18T14:26:40.Z",
                           "9999-01-01T00:00:00Z", "2026-11-18T14:26:40+1:00", "2026-11-18 14:26:40"})
    EXPECT_FALSE(TimeOf(text)) << text;
}

TEST(DottedTime, ReadsBackToTheSecond) {
  const system_clock::time_point time(seconds(1795000000));
  EXPECT_EQ(DottedTimeText(time), "18.11.2026/11:06:40");
  EXPECT_EQ(DottedTimeOf("18.11.2026/11:06:40"), time);
  EXPECT_EQ(DottedTimeOf("18.11.2026/11:06"), time - seconds(40));
  EXPECT_TRUE(DottedTimeOf("18.11.2026"));
  for (const char* text : {"", "18.11.26/14:26:40", "31.02.2026/00:00:00", "18.11.2026/14", "18.11.2026/11:06:40Z"})
    EXPECT_FALSE(DottedTimeOf(text)) << text;
}

TEST(Text, ThatXmlCannotHoldIsNotPlain) {
  EXPECT_TRUE(IsPlainText("a\tb\r\n <&> \xc3\xbc"));
  for (const std::string& text :
       {std::string(1, '\0'), std::string("\x0f"), std::string("\xff"), std::string("\xef\xbf\xbf")})
    EXPECT_FALSE(IsPlainText(text));
}

TEST(Uuid, IsTheLastPartOfAName) {
  EXPECT_EQ(UuidOf("inspections/0198a3c0-0000-7000-8000-000000000001"), "0198a3c0-0000-7000-8000-000000000001");
  for (const char* text :
       {"", "inspections/1", "x0198a3c0-0000-7000-8000-000000000001", "0198a3c0_0000-7000-8000-000000000001"})
    EXPECT_FALSE(UuidOf(text)) << text;
}

// The table of docs/exchange.md, verdicts.
TEST(Verdicts, AreTheSameBothWays) {
  const struct {
    Verdict verdict;
    const char *name, *qif, *inspection;
  } rows[] = {{Verdict::kConform, "CONFORM", "PASS", "PASS"},
              {Verdict::kNotConform, "NOT_CONFORM", "FAIL", "FAIL"},
              {Verdict::kUndecidable, "UNDECIDABLE", "INDETERMINATE", "UNKNOWN"},
              {Verdict::kNotMeasured, "NOT_MEASURED", "NOT_ANALYZED", "NOT_MEASURED"}};
  for (const auto& row : rows) {
    EXPECT_EQ(VerdictName(row.verdict), row.name);
    EXPECT_EQ(VerdictNamed(row.name), row.verdict);
    EXPECT_EQ(QifStatus(row.verdict), row.qif);
    EXPECT_EQ(VerdictOfQifStatus(row.qif), row.verdict);
    EXPECT_EQ(QifInspectionStatus(row.verdict), row.inspection);
    EXPECT_EQ(VerdictOfQifInspectionStatus(row.inspection), row.verdict);
  }
  EXPECT_EQ(VerdictOfQifStatus("REWORK"), Verdict::kNotConform);
  for (const char* status : {"SYSERROR", "UNDEFINED", "BASIC_OR_TED", "", "pass"})
    EXPECT_FALSE(VerdictOfQifStatus(status)) << status;
}

}  // namespace
}  // namespace sixpoint::exchange
