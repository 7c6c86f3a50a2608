#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "report/html.h"
#include "report/number_text.h"
#include "report/pdf_text.h"
#include "report/tell.h"
#include "tests/report/sample_report.h"

namespace sixpoint::report {
namespace {

using ::testing::HasSubstr;

std::string RefusalOf(const Report& report) { return std::string(Check(report).message()); }

Characteristic Good() {
  Characteristic c;
  c.id = "1", c.unit = "mm", c.upper = 0.1, c.value = 0.02, c.expanded_uncertainty = 0.004,
  c.verdict = Verdict::kConform;
  return c;
}

Report With(const Characteristic& c) {
  Report report;
  report.groups = {{"G", "", {c}}};
  return report;
}

TEST(Check, WhatWasNotMeasuredIsNeverAPass) {
  Characteristic c = Good();
  c.value.reset(), c.expanded_uncertainty.reset();
  for (const Verdict verdict : {Verdict::kConform, Verdict::kNotConform, Verdict::kUndecidable}) {
    c.verdict = verdict;
    EXPECT_THAT(RefusalOf(With(c)), HasSubstr("groups[0].characteristics[0].verdict"));
  }
  c.verdict = Verdict::kNotMeasured;
  EXPECT_EQ(RefusalOf(With(c)), "");
  c.value = 0.02;
  EXPECT_THAT(RefusalOf(With(c)), HasSubstr("verdict"));
  // A hole of which one tolerance was not looked at.
  Report report = With(Good());
  Hole hole;
  hole.id = "H1", hole.displacement_mm = {0, 0, 0.01}, hole.position_limit_mm = 0.1, hole.inclination_limit_deg = 1;
  hole.verdict = Verdict::kConform;
  report.holes = {hole};
  EXPECT_THAT(RefusalOf(report), HasSubstr("holes[0].verdict"));
  report.holes[0].inclination_deg = 0.1;
  EXPECT_EQ(RefusalOf(report), "");
  report.holes[0] = {};
  report.holes[0].verdict = Verdict::kUndecidable;
  EXPECT_THAT(RefusalOf(report), HasSubstr("holes[0].verdict"));
}

TEST(Check, ABladeIsConformOnlyIfAllOfItIs) {
  Report report;
  report.verdict = Verdict::kConform;
  EXPECT_THAT(RefusalOf(report), HasSubstr("nothing was judged"));
  report = With(Good());
  report.verdict = Verdict::kConform;
  EXPECT_EQ(RefusalOf(report), "");
  Characteristic c = Good();
  c.id = "missing", c.value.reset(), c.expanded_uncertainty.reset(), c.verdict = Verdict::kNotMeasured;
  report.groups[0].characteristics.push_back(c);
  EXPECT_THAT(RefusalOf(report), HasSubstr("missing is NOT_MEASURED"));
  report.verdict = Verdict::kNotMeasured;
  EXPECT_EQ(RefusalOf(report), "");
}

TEST(Check, WhatNobodyJudgesHasNoVerdictAndHidesNone) {
  Report report = With(Good());
  Characteristic chord;
  chord.id = "chord", chord.unit = "mm", chord.value = 33.4, chord.judged = false;
  report.sections.emplace_back().parameters = {chord};
  report.verdict = Verdict::kConform;
  EXPECT_EQ(RefusalOf(report), "");
  report.groups.clear();
  EXPECT_THAT(RefusalOf(report), HasSubstr("nothing was judged"));
  report.verdict = Verdict::kNotMeasured;
  report.sections[0].parameters[0].verdict = Verdict::kConform;
  EXPECT_THAT(RefusalOf(report), HasSubstr("parameters[0].verdict: CONFORM, want none"));
  report.sections[0].parameters[0] = chord;
  report.sections[0].parameters[0].upper = 34;
  EXPECT_THAT(RefusalOf(report), HasSubstr("parameters[0].limits"));
  Hole hole;
  hole.judged = false, hole.position_limit_mm = 0.1;
  report.holes = {hole};
  EXPECT_THAT(RefusalOf(report), HasSubstr("holes[0].limits"));
}

TEST(Check, NamesTheFieldOfNumbersThatNobodyCanTell) {
  constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
  Characteristic c = Good();
  c.value = kNoNumber;
  EXPECT_THAT(RefusalOf(With(c)), HasSubstr("characteristics[0].value"));
  c = Good(), c.nominal = 1e300;
  EXPECT_THAT(RefusalOf(With(c)), HasSubstr("characteristics[0].nominal"));
  c = Good(), c.expanded_uncertainty = -1;
  EXPECT_THAT(RefusalOf(With(c)), HasSubstr("expanded_uncertainty"));
  c = Good(), c.lower = 3;
  EXPECT_THAT(RefusalOf(With(c)), HasSubstr("lower"));
  Report report = VaneReport(24, 12);
  EXPECT_EQ(RefusalOf(report), "");
  report.sections[1].outlines.measured[0].points[3].x_mm = kNoNumber;
  EXPECT_THAT(RefusalOf(report), HasSubstr("sections[1].outlines."));
  report = VaneReport(24, 12);
  report.traceability.scans[2].sha256 = "abc";
  EXPECT_THAT(RefusalOf(report), HasSubstr("scans[2].sha256"));
  report.traceability.scans[2].sha256.clear();
  report.regions[2].values = RegionDeviation::Values{};
  EXPECT_THAT(RefusalOf(report), HasSubstr("regions[2].seen_area_mm2"));
}

TEST(Told, CutsTamesAndLeavesNothingThatMisleads) {
  EXPECT_EQ(Told("plain \u00fc"), "plain \u00fc");
  const std::string cut = Told(std::string(65536, 'x'));
  EXPECT_EQ(cut.size(), kLongestText);
  EXPECT_EQ(cut.substr(cut.size() - 3), "...");
  EXPECT_EQ(Told(std::string("a\0\n\x1b", 4)), "a???");
  EXPECT_EQ(Told("a\u202eb\u200bc\u2066"), "a?b?c?");
  EXPECT_EQ(Told("\u2316 \u2300 0.2"), "position \u2300 0.2");
  EXPECT_LE(Told(std::string(80, ' ') +
                 "\u2330\u2330\u2330\u2330\u2330\u2330\u2330\u2330\u2330\u2330\u2330\u2330\u2330\u2330")
                .size(),
            kLongestText);
}

TEST(Numbers, AreFixedWithAMinusOfTheirOwnAndNeverMinusZero) {
  EXPECT_EQ(Fixed(-0.00001, 4), "0.0000");
  EXPECT_EQ(Fixed(-1.25, 1), "\u22121.2");
  EXPECT_EQ(Signed(0.04, 1), "0.0");
  EXPECT_EQ(Signed(2, 1), "+2.0");
  EXPECT_EQ(Grouped(1234567), "1\u00a0234\u00a0567");
  // A limit is never told as another.
  EXPECT_EQ(DecimalsFor("mm", {0.1}), 4);
  EXPECT_EQ(DecimalsFor("mm", {0.00625, std::nullopt}), 5);
}

TEST(PdfText, TurnsRunsFromTheRightAndKeepsNumbers) {
  const auto sight = [](const std::string& text) {
    std::string out;
    for (const char32_t c : InOrderOfSight(CodePoints(text))) AppendUtf8(c, &out);
    return out;
  };
  EXPECT_EQ(sight("abc 123"), "abc 123");
  EXPECT_EQ(sight("x \u05d0\u05d1 \u05d2 12"), "x \u05d2 \u05d1\u05d0 12");
}

}  // namespace
}  // namespace sixpoint::report
