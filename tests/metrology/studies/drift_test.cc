#include "metrology/studies/drift.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "metrology/statistics/distributions.h"

namespace sixpoint::metrology {
namespace {

TEST(Distributions, HaveTheTablesValues) {
  EXPECT_NEAR(FisherQuantile(0.95, 2, 9), 4.2565, 1e-4);
  EXPECT_NEAR(FisherUpperTail(2.94, 9, 24), 0.0167, 2e-4);  // Montgomery, table 14.4: 0.017
  EXPECT_NEAR(ChiSquaredQuantile(0.975, 10), 20.483, 1e-3);
  EXPECT_NEAR(StudentQuantile(0.975, 5), 2.5706, 1e-4);
}

TEST(Drift, AStepIsMeasuredInCombinedUncertainties) {
  // Change 0.5 against sqrt(0.03^2 + 0.04^2) = 0.05: ten.
  const auto drift = AssessDrift({{0, 1.0, 0.03}, {1, 1.5, 0.04}}, {});
  ASSERT_TRUE(drift.ok());
  EXPECT_NEAR(drift->steps.at(0).change, 0.5, 1e-12);
  EXPECT_NEAR(drift->steps[0].ratio, 10, 1e-9);
  EXPECT_TRUE(drift->step_alarm);
  EXPECT_FALSE(drift->line.has_value());
  DriftOptions tolerant;
  tolerant.coverage_factor = 8;
  EXPECT_FALSE(AssessDrift({{0, 1.0, 0.03}, {1, 1.35, 0.04}}, tolerant)->step_alarm);
}

TEST(Drift, ASlowDriftThatNoStepShowsIsATrend) {
  std::vector<DatedEstimate> estimates;
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0, 0.01);
  for (int i = 0; i < 12; ++i) estimates.push_back({10.0 * i, 0.012 * i + noise(random), 0.01});
  const auto drift = AssessDrift(estimates, {});
  ASSERT_TRUE(drift.ok());
  EXPECT_FALSE(drift->step_alarm);
  EXPECT_TRUE(drift->trend_alarm);
  EXPECT_NEAR(drift->line->slope_per_day, 0.0012, 3.5 * drift->line->slope_standard_uncertainty_per_day);
}

TEST(Drift, SlopeIsThatOfTheClosedForm) {
  // Equal weights: slope = sum (t - 1)(x - mean) / 2 = 3 / 2, residuals 0.5, -1, 0.5 (sum of squares 1.5).
  const auto drift = AssessDrift({{0, 0, 1}, {1, 0, 1}, {2, 3, 1}}, {});
  ASSERT_TRUE(drift->line.has_value());
  EXPECT_NEAR(drift->line->slope_per_day, 1.5, 1e-12);
  EXPECT_NEAR(drift->line->scatter_ratio, std::sqrt(1.5), 1e-12);
  EXPECT_NEAR(drift->line->slope_standard_uncertainty_per_day, std::sqrt(1.5 / 2), 1e-12);
}

TEST(Drift, AlarmsFalselyNoMoreOftenThanTheFactorSays) {
  // 2000 machines that do not move, eight calibrations each: a step is one of seven at 0.27 %, a trend 0.27 %.
  std::mt19937_64 random(7);
  std::normal_distribution<double> noise(0, 1);
  int steps = 0, trends = 0, slack_trends = 0;
  for (int machine = 0; machine < 2000; ++machine) {
    std::vector<DatedEstimate> estimates, irreproducible;
    for (int i = 0; i < 8; ++i) {
      const double x = noise(random);
      estimates.push_back({static_cast<double>(i), x, 1});
      irreproducible.push_back({static_cast<double>(i), 4 * x, 1});
    }
    const auto drift = AssessDrift(estimates, {});
    steps += drift->step_alarm;
    trends += drift->trend_alarm;
    slack_trends += AssessDrift(irreproducible, {})->trend_alarm;
  }
  EXPECT_LT(steps, 60);  // expected 2000 * 7 * 0.0027 = 38, less what neighbours share; sigma 6
  EXPECT_GT(steps, 15);
  EXPECT_LT(trends, 15);        // expected at most 5.4
  EXPECT_LT(slack_trends, 15);  // the scatter is four times what is stated, and is not read as a trend
}

TEST(Drift, ALimitHoldsAgainstTheFirstValue) {
  DriftOptions options;
  options.limit = 0.1;
  const auto drift = AssessDrift({{0, 0, 1}, {1, 0.09, 1}, {2, 0.11, 1}}, options);
  EXPECT_FALSE(drift->steps.at(0).limit_alarm);
  EXPECT_TRUE(drift->steps.at(1).limit_alarm);
  EXPECT_FALSE(drift->step_alarm);
  EXPECT_TRUE(drift->limit_alarm);
}

TEST(Drift, RefusesWhatItCannotJudge) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(AssessDrift({{0, nan, 1}}, {}).status().message(), "estimates[0].value: NaN, want a number");
  EXPECT_EQ(AssessDrift({{0, 0, 0}}, {}).status().message(), "estimates[0].standard_uncertainty: 0, want > 0");
  EXPECT_FALSE(AssessDrift({{1, 0, 1}, {0, 0, 1}}, {}).ok());
  EXPECT_TRUE(AssessDrift({}, {}).ok());
}

}  // namespace
}  // namespace sixpoint::metrology
