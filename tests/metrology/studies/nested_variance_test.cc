#include "metrology/studies/nested_variance.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace sixpoint::metrology {
namespace {

using ::testing::HasSubstr;
using Table = std::vector<std::vector<std::vector<double>>>;  // outer, inner, values

std::vector<NestedObservation> Observations(const Table& table) {
  std::vector<NestedObservation> out;
  for (std::size_t i = 0; i < table.size(); ++i)
    for (std::size_t j = 0; j < table[i].size(); ++j)
      for (const double value : table[i][j]) out.push_back({std::to_string(i), std::to_string(j), value});
  return out;
}

// Montgomery, Design and Analysis of Experiments, example 14.1: purity less 93, three suppliers, four batches of each.
const Table kPurity = {{{1, -1, 0}, {-2, -3, -4}, {-2, 0, 1}, {1, 4, 0}},
                       {{1, -2, -3}, {0, 4, 2}, {-1, 0, -2}, {0, 3, 2}},
                       {{2, 4, 0}, {-2, 0, 2}, {1, -1, 2}, {3, 2, 1}}};
// Sokal and Rohlf, Biometry, box 10.1: wing lengths of mosquitoes, three cages, four females each, measured twice.
const Table kWings = {{{58.5, 59.5}, {77.8, 80.9}, {84.0, 83.6}, {70.1, 68.3}},
                      {{69.8, 69.8}, {56.0, 54.5}, {50.7, 49.3}, {63.8, 65.8}},
                      {{56.6, 57.5}, {77.8, 79.2}, {69.9, 69.2}, {62.1, 64.5}}};

TEST(NestedVariance, ReproducesMontgomerysTable) {
  const auto v = AnalyseNested(Observations(kPurity), {});
  ASSERT_TRUE(v.ok()) << v.status();
  EXPECT_TRUE(v->balanced);
  EXPECT_NEAR(v->outer.sum_of_squares, 15.06, 0.005);
  EXPECT_NEAR(v->inner.sum_of_squares, 69.92, 0.005);
  EXPECT_NEAR(v->repeat.sum_of_squares, 63.33, 0.005);
  EXPECT_NEAR(v->total_sum_of_squares, 148.31, 0.005);
  EXPECT_EQ(v->outer.degrees_of_freedom, 2);
  EXPECT_EQ(v->inner.degrees_of_freedom, 9);
  EXPECT_EQ(v->repeat.degrees_of_freedom, 24);
  EXPECT_NEAR(*v->outer.f, 0.97, 0.005);
  EXPECT_NEAR(*v->outer.p, 0.42, 0.005);
  EXPECT_NEAR(*v->inner.f, 2.94, 0.005);
  EXPECT_NEAR(*v->inner.p, 0.02, 0.005);
  EXPECT_NEAR(v->inner.variance, 1.71, 0.005);
  EXPECT_NEAR(v->repeat.variance, 2.64, 0.005);
  EXPECT_TRUE(v->outer.negative);  // F below 1
  EXPECT_EQ(v->outer.variance, 0);
  // 24 MS / chi-squared quantiles 39.364 and 12.401.
  EXPECT_NEAR(v->repeat.interval.lower, 63.33 / 39.364, 1e-3);
  EXPECT_NEAR(v->repeat.interval.upper, 63.33 / 12.401, 1e-3);
}

TEST(NestedVariance, ReproducesSokalAndRohlfsTable) {
  const auto v = AnalyseNested(Observations(kWings), {});
  ASSERT_TRUE(v.ok());
  EXPECT_NEAR(v->outer.sum_of_squares, 665.6758, 1e-3);
  EXPECT_NEAR(v->inner.sum_of_squares, 1720.6775, 1e-3);
  EXPECT_NEAR(v->repeat.sum_of_squares, 15.62, 1e-3);
  EXPECT_NEAR(*v->outer.f, 1.741, 1e-3);
  EXPECT_NEAR(*v->inner.f, 146.88, 0.01);
  EXPECT_NEAR(v->repeat.variance, 1.3017, 1e-4);
  EXPECT_NEAR(v->inner.variance, 94.94, 0.01);
  EXPECT_NEAR(v->outer.variance, 17.71, 0.01);
  EXPECT_NEAR(v->outer.percent + v->inner.percent + v->repeat.percent, 100, 1e-9);
  // Parts inside operators: gauge R&R = 17.71 + 1.30; categories = floor(1.41 sqrt(94.94 / 19.01)) = 3.
  EXPECT_NEAR(v->gauge_rr_variance, 19.01, 0.01);
  EXPECT_EQ(v->distinct_categories, 3);
  NestedOptions other;
  other.part_is_outer = true;
  EXPECT_NEAR(AnalyseNested(Observations(kWings), other)->gauge_rr_variance, 96.24, 0.01);
}

TEST(NestedVariance, AnOffsetAndAScaleChangeNothingElse) {
  Table moved = kWings;
  for (auto& outer : moved)
    for (auto& inner : outer)
      for (double& value : inner) value = 1e6 + 2 * value;
  const auto a = AnalyseNested(Observations(kWings), {}), b = AnalyseNested(Observations(moved), {});
  EXPECT_NEAR(b->outer.variance, 4 * a->outer.variance, 1e-6);
  EXPECT_NEAR(b->inner.interval.upper, 4 * a->inner.interval.upper, 1e-5);
  EXPECT_NEAR(b->mean, 1e6 + 2 * a->mean, 1e-6);
  EXPECT_NEAR(*b->outer.p, *a->outer.p, 1e-9);
  EXPECT_NEAR(a->mean_standard_uncertainty, std::sqrt(a->outer.mean_square / 24), 1e-9);
}

std::vector<NestedObservation> Simulated(std::mt19937_64* random, const std::vector<std::vector<int>>& counts,
                                         double outer_sigma, double inner_sigma, double repeat_sigma) {
  std::normal_distribution<double> normal(0, 1);
  std::vector<NestedObservation> out;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const double outer = outer_sigma * normal(*random);
    for (std::size_t j = 0; j < counts[i].size(); ++j) {
      const double inner = inner_sigma * normal(*random);
      for (int k = 0; k < counts[i][j]; ++k)
        out.push_back({std::to_string(i), std::to_string(j), 10 + outer + inner + repeat_sigma * normal(*random)});
    }
  }
  return out;
}

struct Coverage {
  double outer = 0, inner = 0, repeat = 0, gauge_rr = 0;               // of 95 % intervals
  double outer_variance = 0, inner_variance = 0, repeat_variance = 0;  // means of the estimates, unclipped
};

Coverage CoverageOf(const std::vector<std::vector<int>>& counts, int trials) {
  const double a = 2, b = 3, e = 1;  // standard deviations
  std::mt19937_64 random(11);
  Coverage c;
  for (int trial = 0; trial < trials; ++trial) {
    const auto v = AnalyseNested(Simulated(&random, counts, a, b, e), {});
    EXPECT_TRUE(v.ok());
    const auto holds = [](const Interval& i, double truth) { return i.lower <= truth && truth <= i.upper; };
    c.outer += holds(v->outer.interval, a * a) / static_cast<double>(trials);
    c.inner += holds(v->inner.interval, b * b) / static_cast<double>(trials);
    c.repeat += holds(v->repeat.interval, e * e) / static_cast<double>(trials);
    c.gauge_rr += holds(v->gauge_rr_interval, a * a + e * e) / static_cast<double>(trials);
    c.outer_variance += v->outer.variance / trials;
    c.inner_variance += v->inner.variance / trials;
    c.repeat_variance += v->repeat.variance / trials;
  }
  return c;
}

// 3000 seeds: the standard error of a coverage of 0.95 is 0.004.
TEST(NestedVariance, IntervalsHoldTheTruthAsOftenAsTheySay) {
  const Coverage c = CoverageOf(std::vector<std::vector<int>>(12, std::vector<int>(4, 3)), 3000);
  EXPECT_NEAR(c.repeat, 0.95, 0.016);  // exact
  EXPECT_NEAR(c.inner, 0.95, 0.016);
  EXPECT_NEAR(c.outer, 0.95, 0.02);  // approximate: Ting et al. find 0.94 to 0.97
  EXPECT_NEAR(c.gauge_rr, 0.95, 0.02);
  EXPECT_NEAR(c.repeat_variance, 1, 0.01);
  EXPECT_NEAR(c.inner_variance, 9, 0.15);
  EXPECT_NEAR(c.outer_variance, 4, 0.25);
}

TEST(NestedVariance, DataThatAreNotBalancedAreEstimatedWithoutBias) {
  std::vector<std::vector<int>> counts;
  for (int i = 0; i < 12; ++i)
    counts.push_back(i % 3 == 0   ? std::vector<int>{1, 4, 2, 3, 2}
                     : i % 3 == 1 ? std::vector<int>{3, 3}
                                  : std::vector<int>{2, 1, 5});
  const Coverage c = CoverageOf(counts, 3000);
  EXPECT_NEAR(c.repeat_variance, 1, 0.015);
  EXPECT_NEAR(c.inner_variance, 9, 0.2);
  EXPECT_NEAR(c.outer_variance, 4, 0.45);  // clipped at 0 in a few per cent of the trials
  EXPECT_NEAR(c.repeat, 0.95, 0.016);
  EXPECT_NEAR(c.inner, 0.95, 0.03);  // approximate here
  EXPECT_NEAR(c.outer, 0.95, 0.03);
}

TEST(NestedVariance, FindsEffectsThatAreNotThereAsOftenAsPSays) {
  std::mt19937_64 random(5);
  int outer = 0, inner = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    const auto v = AnalyseNested(Simulated(&random, std::vector<std::vector<int>>(5, {2, 2, 2}), 0, 0, 1), {});
    outer += *v->outer.p < 0.05;
    inner += *v->inner.p < 0.05;
  }
  EXPECT_NEAR(outer / 3000.0, 0.05, 0.016);
  EXPECT_NEAR(inner / 3000.0, 0.05, 0.016);
}

TEST(NestedVariance, RefusesWhatItCannotSeparate) {
  const auto message = [](const Table& table, NestedOptions options = {}) {
    return std::string(AnalyseNested(Observations(table), options).status().message());
  };
  EXPECT_EQ(message({}), "observations: 0 outer levels, want at least 2");
  EXPECT_EQ(message({{{1, 2}, {3, 4}}}), "observations: 1 outer levels, want at least 2");
  EXPECT_THAT(message({{{1, 2}}, {{3, 4}}}), HasSubstr("one inner level in each outer one"));
  EXPECT_THAT(message({{{1}, {2}}, {{3}, {4}}}), HasSubstr("one value at each inner level"));
  NestedOptions balanced;
  balanced.balanced_only = true;
  EXPECT_THAT(message({{{1, 2}, {3}}, {{3, 4}, {5, 6}}}, balanced), HasSubstr("observations: not balanced"));
  EXPECT_THAT(message({{{1, std::numeric_limits<double>::infinity()}}}),
              HasSubstr("observations[1].value: not finite, want a number"));
  // Values that do not vary at all: no F, no categories, no failure.
  const auto constant = AnalyseNested(Observations({{{1, 1}, {1, 1}}, {{1, 1}, {1, 1}}}), {});
  ASSERT_TRUE(constant.ok());
  EXPECT_FALSE(constant->inner.f.has_value());
  EXPECT_FALSE(constant->distinct_categories.has_value());
}

}  // namespace
}  // namespace sixpoint::metrology
