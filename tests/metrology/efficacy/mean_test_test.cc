#include "metrology/efficacy/mean_test.h"

#include <gtest/gtest.h>

#include <cmath>

#include "metrology/efficacy/holm.h"

namespace sixpoint::metrology {
namespace {

// Johnson and Wichern, Applied Multivariate Statistical Analysis, example 5.1: T squared 7/9 against (9, 5).
const std::vector<Eigen::VectorXd> kThree = {Eigen::Vector2d(6 - 9, 9 - 5), Eigen::Vector2d(10 - 9, 6 - 5),
                                             Eigen::Vector2d(8 - 9, 3 - 5)};

TEST(MeanTest, ReproducesJohnsonAndWichern) {
  const MeanTest test = TestMean(kThree);
  ASSERT_TRUE(test.f && test.p);
  EXPECT_NEAR(*test.f, 7.0 / 9 * (3 - 2) / (2 * (3 - 1)), 1e-12);
  // With two components F's tail has a closed form: (1 + 2 F / (n - 2))^(-(n - 2) / 2).
  EXPECT_NEAR(*test.p, std::pow(1 + 2 * *test.f / 1, -0.5), 1e-12);
  EXPECT_NEAR(test.covariance(0, 1), -3, 1e-12);
}

// Student's table: of 4 degrees of freedom 2.7764 two-sided at 5 %.
TEST(MeanTest, OfOneComponentItIsStudentsTest) {
  std::vector<Eigen::VectorXd> values;
  for (const double v : {-2, -1, 0, 1, 2}) values.push_back(Eigen::VectorXd::Constant(1, v));
  const double standard = std::sqrt(2.5 / 5);
  for (Eigen::VectorXd& value : values) value.array() += 2.776445 * standard;
  const MeanTest test = TestMean(values);
  EXPECT_NEAR(test.standard_uncertainty[0], standard, 1e-12);
  EXPECT_NEAR(*test.p, 0.05, 1e-6);
}

TEST(MeanTest, SaysNothingOfTooFew) {
  EXPECT_FALSE(TestMean({kThree[0], kThree[1]}).p);
  EXPECT_FALSE(FurtherOne({kThree[0], kThree[1]}, kThree[2]));
}

// A linear change of both, turned and stretched, changes no probability.
TEST(MeanTest, ALinearChangeChangesNoProbability) {
  Eigen::Matrix2d change;
  change << 0.3, -2, 5, 0.7;
  std::vector<Eigen::VectorXd> changed;
  for (const Eigen::VectorXd& value : kThree) changed.push_back(change * value);
  EXPECT_NEAR(*TestMean(changed).p, *TestMean(kThree).p, 1e-9);
  const Eigen::VectorXd further = Eigen::Vector2d(5, 5);
  EXPECT_NEAR(*FurtherOne(changed, change * further), *FurtherOne(kThree, further), 1e-9);
}

// One value m before: t = (x - mean) / (s sqrt(1 + 1 / m)).
TEST(FurtherOne, OfOneComponentIsStudentsPrediction) {
  std::vector<Eigen::VectorXd> before;
  for (const double v : {-2, -1, 0, 1, 2}) before.push_back(Eigen::VectorXd::Constant(1, v));
  const double at_5_percent = 2.776445 * std::sqrt(2.5 * (1 + 1.0 / 5));
  EXPECT_NEAR(*FurtherOne(before, Eigen::VectorXd::Constant(1, at_5_percent)), 0.05, 1e-6);
}

// Holm 1979, as R's p.adjust(c(0.01, 0.04, 0.03, 0.005), "holm") has it.
TEST(HolmAdjusted, StepsDown) {
  const std::vector<double> adjusted = HolmAdjusted({0.01, 0.04, 0.03, 0.005});
  EXPECT_NEAR(adjusted[0], 0.03, 1e-15);
  EXPECT_NEAR(adjusted[1], 0.06, 1e-15);
  EXPECT_NEAR(adjusted[2], 0.06, 1e-15);
  EXPECT_NEAR(adjusted[3], 0.02, 1e-15);
  EXPECT_TRUE(HolmAdjusted({}).empty());
}

}  // namespace
}  // namespace sixpoint::metrology
