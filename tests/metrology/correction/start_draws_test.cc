// Draws of a start through the whole chain: against closed forms, and beside the first order.
#include "metrology/correction/start_draws.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "tests/metrology/correction/some_path.h"

namespace sixpoint::metrology {
namespace {

struct DrawCase {
  SomePlace place;
  NominalHoleGroup group{"G", {0.2, 0.1, std::sqrt(1 - 0.05)}, {}, {{"H1", {3, -20, 8}}, {"H2", {-4, 15, 30}}}, 0.05,
                         0.01};
  RegisteredPose pose;
  Drilling drilling;

  explicit DrawCase(std::mt19937_64 random = std::mt19937_64(21)) : place(random), pose(ExactPose(place.real)) {}
  CorrectedHoleGroup Corrected() const {
    return CorrectGroup(group, pose, place.nominal, SomeAxes(), SomeAxes(), kWideLimits, drilling).value();
  }
  std::vector<DrawnStart> Draw(int count, int threads = 2, std::uint64_t seed = 1) const {
    DrawOptions options;
    options.count = count;
    options.threads = threads;
    options.seed = seed;
    const auto drawn = DrawStarts(group, Corrected(), pose, SomeAxes(), drilling, options);
    EXPECT_TRUE(drawn.ok()) << drawn.status();
    return drawn.value_or(std::vector<DrawnStart>());
  }
};

ErrorSource Shift(const std::string& name, const Eigen::Vector3d& per_sigma_mm, double degrees_of_freedom) {
  ErrorSource source;
  source.name = name;
  source.degrees_of_freedom = degrees_of_freedom;
  source.parameters_per_sigma = Eigen::MatrixXd::Zero(kCalibrationParameterCount, 1);
  source.pose_per_sigma = Eigen::MatrixXd::Zero(6, 1);
  source.pose_per_sigma.bottomRows<3>() = per_sigma_mm;
  return source;
}

// 95 % of the lengths of three normal values lie below 2.7955 of their standard deviations.
TEST(StartDraws, OfAnEvenShiftAreThoseOfMaxwell) {
  DrawCase one;
  one.pose.noise.values.bottomRightCorner<3, 3>() = 4e-6 * Eigen::Matrix3d::Identity();  // 2 um
  for (const DrawnStart& start : one.Draw(40'000)) {
    EXPECT_NEAR(start.expanded_uncertainty_um, 2 * 2.7955, 0.05);
    EXPECT_LT(start.low_um, 2 * 2.7955);
    EXPECT_GT(start.high_um, 2 * 2.7955);
    ASSERT_EQ(start.components.size(), 1u);
    EXPECT_EQ(start.components[0].source, "noise of the scans");
    EXPECT_NEAR(start.components[0].rms_um, 2 * std::sqrt(3.0), 0.03);
  }
}

// Along one direction with five degrees of freedom: Student's 2.5706 instead of 1.96, its standard uncertainty unwidened.
TEST(StartDraws, AreAsWideAsTheirDegreesOfFreedom) {
  DrawCase one;
  one.pose.sources = {Shift("fixture", {0, 0.003, 0}, 5)};
  const auto drawn = one.Draw(40'000);
  EXPECT_NEAR(drawn[0].expanded_uncertainty_um, 3 * 2.5706, 0.15);
  const DrawnComponent& fixture = drawn[0].components[1];
  EXPECT_EQ(fixture.source, "fixture");
  EXPECT_NEAR(fixture.rms_um, 3, 0.05);
}

// Every kind of source at once: first order is right to the draws' own scatter.
TEST(StartDraws, AgreeWithFirstOrder) {
  DrawCase one;
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  const auto fill = [&](Eigen::Index rows, Eigen::Index columns, double angle, double shift, int period) {
    Eigen::MatrixXd values(rows, columns);
    for (Eigen::Index i = 0; i < rows; ++i)
      for (Eigen::Index j = 0; j < columns; ++j)
        values(i, j) = normal(random) * (i % period < period / 2 ? angle : shift);
    return values;
  };
  const Eigen::MatrixXd noise = fill(6, 6, 3e-6, 2e-4, 6);
  one.pose.noise.values = noise * noise.transpose();
  ErrorSource axes;
  axes.name = "rotation calibration";
  axes.degrees_of_freedom = std::numeric_limits<double>::infinity();
  axes.parameters_per_sigma = Eigen::MatrixXd::Zero(kCalibrationParameterCount, 8);
  axes.parameters_per_sigma.middleRows<kAxisParameterCount>(kFirstAxisParameter) = fill(8, 8, 4e-6, 2e-4, 4);
  axes.pose_per_sigma = fill(6, 8, 2e-6, 1e-4, 6);
  ErrorSource scales = axes;
  scales.name = "scales of the linear axes";
  scales.parameters_per_sigma.setZero();
  scales.parameters_per_sigma.middleRows<kLinearParameterCount>(kFirstLinearParameter) = fill(6, 8, 2e-6, 2e-6, 6);
  one.pose.sources = {axes, scales};
  one.pose.positioning.a.standard_uncertainty_rad = 4e-6;
  one.pose.positioning.b.standard_uncertainty_rad = 2e-6;
  one.drilling.stretch = 1 + 6e-5;
  one.drilling.tool_offset_mm = 1e-3;
  const CorrectedHoleGroup stated = one.Corrected();
  const auto drawn = one.Draw(40'000);
  ASSERT_EQ(drawn.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    const CorrectedHole& hole = stated.holes[i];
    EXPECT_EQ(drawn[i].name, hole.name);
    EXPECT_NEAR(drawn[i].expanded_uncertainty_um / hole.expanded_uncertainty_um, 1, 0.02) << i;
    ASSERT_EQ(drawn[i].components.size(), hole.components.size());
    for (const DrawnComponent& component : drawn[i].components) {
      const auto same =
          std::find_if(hole.components.begin(), hole.components.end(),
                       [&](const UncertaintyComponent& same_source) { return same_source.source == component.source; });
      ASSERT_NE(same, hole.components.end()) << component.source;
      EXPECT_NEAR(component.rms_um / std::sqrt(same->variance), 1, 0.02) << component.source;
    }
  }
}

TEST(StartDraws, AreTheSameOnAnyNumberOfThreads) {
  DrawCase one;
  one.pose.noise.values = 1e-8 * Matrix6d::Identity();
  const auto alone = one.Draw(3'100, 1), together = one.Draw(3'100, 4), other = one.Draw(3'100, 4, 2);
  EXPECT_EQ(alone[0].expanded_uncertainty_um, together[0].expanded_uncertainty_um);
  EXPECT_EQ(alone[1].components[0].rms_um, together[1].components[0].rms_um);
  EXPECT_NE(alone[0].expanded_uncertainty_um, other[0].expanded_uncertainty_um);
}

TEST(StartDraws, AreRefusedOrStopped) {
  DrawCase one;
  one.pose.noise.values = 1e-8 * Matrix6d::Identity();
  DrawOptions options;
  options.count = 999;
  EXPECT_THAT(std::string(DrawStarts(one.group, one.Corrected(), one.pose, SomeAxes(), {}, options).status().message()),
              ::testing::HasSubstr("draws: 999, want 1000 or more"));
  options.count = 5000;
  options.keep_going = [] { return false; };
  EXPECT_TRUE(absl::IsCancelled(DrawStarts(one.group, one.Corrected(), one.pose, SomeAxes(), {}, options).status()));
  CorrectedHoleGroup other = one.Corrected();
  other.name = "G2";
  EXPECT_FALSE(DrawStarts(one.group, other, one.pose, SomeAxes(), {}, {}).ok());
}

}  // namespace
}  // namespace sixpoint::metrology
