#include "metrology/inspection/verdict.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <utility>

namespace sixpoint::metrology {
namespace {

// ISO 14253-1, at and about its two limits: tolerance 60, expanded uncertainty 2.
TEST(Judge, ConformsOnlyInsideTheToleranceByItsUncertainty) {
  EXPECT_EQ(Judge(0, 2, 60), Verdict::kConform);
  EXPECT_EQ(Judge(58, 2, 60), Verdict::kConform);
  EXPECT_EQ(Judge(std::nextafter(58.0, 100), 2, 60), Verdict::kUndecidable);
  EXPECT_EQ(Judge(60, 2, 60), Verdict::kUndecidable);
  EXPECT_EQ(Judge(62, 2, 60), Verdict::kUndecidable);
  EXPECT_EQ(Judge(std::nextafter(62.0, 100), 2, 60), Verdict::kNotConform);
}

TEST(Judge, IsDecidedByTheLimitAloneWithoutUncertainty) {
  EXPECT_EQ(Judge(60, 0, 60), Verdict::kConform);
  EXPECT_EQ(Judge(60.001, 0, 60), Verdict::kNotConform);
}

TEST(Judge, NeverPassesWhatCannotBeJudged) {
  const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(Judge(nan, 2, 60), Verdict::kNotMeasured);
  EXPECT_EQ(Judge(1, nan, 60), Verdict::kNotMeasured);
  EXPECT_EQ(Judge(1, infinity, 60), Verdict::kNotMeasured);
  EXPECT_EQ(Judge(1, -1, 60), Verdict::kNotMeasured);
  EXPECT_EQ(Judge(1, 1, nan), Verdict::kNotMeasured);
}

// Values v with U = 2 between 0 and 10, by the guard band of each rule: conform up to 10 - guard, not conform from beyond 10 + guard.
TEST(Judge, TakesTheGuardBandOfItsRuleAtBothLimits) {
  const Limits limits{0, 10};
  for (const double factor : {0.0, 0.5, 1.0, 2.0}) {
    const DecisionRule rule{DecisionRule::Kind::kGuardBand, factor};
    const double guard = factor * 2, little = 1e-9;
    for (const auto& [limit, inward] : {std::pair(10.0, -1.0), std::pair(0.0, 1.0)}) {
      EXPECT_EQ(Judge(limit + inward * (guard + little), 2, limits, rule), Verdict::kConform) << factor;
      EXPECT_EQ(Judge(limit - inward * (guard + little), 2, limits, rule), Verdict::kNotConform) << factor;
      EXPECT_EQ(Judge(limit, 2, limits, rule), factor > 0 ? Verdict::kUndecidable : Verdict::kConform) << factor;
    }
  }
}

// ISO 14253-1:2017 asks for 95 % of conformance: beside one limit 1.645 standard uncertainties, and more where the other one is near.
TEST(Judge, ByProbabilityTakesTheTailsThatLieOutside) {
  const DecisionRule rule = DecisionRule::Probability();
  const Limits upper{std::nullopt, 10.0};
  const double guard = 1.6448536269514722, little = 1e-6;  // of u = 1
  EXPECT_EQ(Judge(10 - guard - little, 2, upper, rule), Verdict::kConform);
  EXPECT_EQ(Judge(10 - guard + little, 2, upper, rule), Verdict::kUndecidable);
  EXPECT_EQ(Judge(10 + guard - little, 2, upper, rule), Verdict::kUndecidable);
  EXPECT_EQ(Judge(10 + guard + little, 2, upper, rule), Verdict::kNotConform);
  // In the middle of limits at +-1.959964 u just 95 % lie inside.
  EXPECT_EQ(Judge(0, 2, {-1.95997, 1.95997}, rule), Verdict::kConform);
  EXPECT_EQ(Judge(0, 2, {-1.95995, 1.95995}, rule), Verdict::kUndecidable);
  EXPECT_EQ(Judge(10, 0, upper, rule), Verdict::kConform);
  EXPECT_EQ(Judge(10.001, 0, upper, rule), Verdict::kNotConform);
}

TEST(Judge, IsAsTheOneLimitRuleOfHolesByDefault) {
  for (double value = 0; value < 100; value += 0.25)
    EXPECT_EQ(Judge(value, 2, {std::nullopt, 60.0}, {}), Judge(value, 2, 60)) << value;
}

TEST(Judge, WithoutALimitEverythingConforms) { EXPECT_EQ(Judge(1e6, 1, {}, {}), Verdict::kConform); }

TEST(Worst, PutsNotConformFirstAndConformLast) {
  const Verdict order[] = {Verdict::kConform, Verdict::kUndecidable, Verdict::kNotMeasured, Verdict::kNotConform};
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) EXPECT_EQ(Worst(order[i], order[j]), order[i > j ? i : j]);
}

}  // namespace
}  // namespace sixpoint::metrology
