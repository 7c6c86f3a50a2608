#include "metrology/efficacy/crossed_variance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace sixpoint::metrology {
namespace {

// Two blades, two holes: by hand. Holes' means 1 and 5, blades -1 and +1 about them, interaction +-0.5.
TEST(CrossedVariance, OfABalancedTableIsTheAnalysisOfVariance) {
  const CrossedVariance v =
      AnalyseCrossed({{0, 0, 1 - 1 + 0.5}, {0, 1, 5 - 1 - 0.5}, {1, 0, 1 + 1 - 0.5}, {1, 1, 5 + 1 + 0.5}});
  EXPECT_EQ(v.within_freedom, 1);
  EXPECT_EQ(v.between_freedom, 1);
  EXPECT_NEAR(*v.within_variance, 4 * 0.25, 1e-12);
  // Mean square between 4, of two holes: (4 - 1) / 2.
  EXPECT_NEAR(*v.between_variance, (4.0 - 1.0) / 2, 1e-12);
  // Of holes 4 on one blade: squares 2 * 2 * 2^2 = 16 of one freedom, on two blades.
  EXPECT_EQ(v.hole_freedom, 1);
  EXPECT_NEAR(*v.hole_variance, (16.0 - 1.0) / 2, 1e-12);
}

TEST(CrossedVariance, WhatIsTheSameOnEveryBladeIsNoSpread) {
  std::vector<CrossedObservation> observations;
  for (int blade = 0; blade < 6; ++blade)
    for (int hole = 0; hole < 5; ++hole) observations.push_back({blade, hole, 0.01 * hole});
  const CrossedVariance v = AnalyseCrossed(observations);
  EXPECT_NEAR(*v.within_variance, 0, 1e-20);
  EXPECT_NEAR(*v.between_variance, 0, 1e-20);
}

TEST(CrossedVariance, OfTooLittleSaysNothing) {
  EXPECT_FALSE(AnalyseCrossed({}).within_variance);
  EXPECT_FALSE(AnalyseCrossed({{0, 0, 1}, {1, 1, 2}}).within_variance);  // no hole twice
  EXPECT_FALSE(AnalyseCrossed({{0, 0, 1}, {0, 1, 2}}).between_variance);
}

// A third of the holes missing: both components come out on the average. 400 tables of 10 x 8, standard error of the mean some 1 % and 2.5 %.
TEST(CrossedVariance, IsUnbiasedWhereHolesAreMissing) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  double within = 0, between = 0, holes = 0;
  for (int table = 0; table < 400; ++table) {
    std::vector<CrossedObservation> observations;
    for (int blade = 0; blade < 10; ++blade) {
      const double of_blade = 2 * normal(random);
      for (int hole = 0; hole < 8; ++hole)
        if (uniform(random) > 1.0 / 3) observations.push_back({blade, hole, hole + of_blade + 3 * normal(random)});
    }
    const CrossedVariance v = AnalyseCrossed(observations);
    within += *v.within_variance / 400;
    holes += *v.hole_variance / 400;
    between += (v.between_negative ? 0 : *v.between_variance) / 400;
  }
  EXPECT_NEAR(within, 9, 9 * 0.04);
  EXPECT_NEAR(between, 4, 4 * 0.1);
  EXPECT_NEAR(holes, 6, 6 * 0.1);  // 0 to 7, as drawn: their variance
}

}  // namespace
}  // namespace sixpoint::metrology
