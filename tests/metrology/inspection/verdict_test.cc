#include "metrology/inspection/verdict.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

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

TEST(Worst, PutsNotConformFirstAndConformLast) {
  const Verdict order[] = {Verdict::kConform, Verdict::kUndecidable, Verdict::kNotMeasured, Verdict::kNotConform};
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) EXPECT_EQ(Worst(order[i], order[j]), order[i > j ? i : j]);
}

}  // namespace
}  // namespace sixpoint::metrology
