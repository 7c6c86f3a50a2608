#include "metrology/inspection/pin.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "metrology/frames/angles.h"
#include "metrology/inspection/hole_error.h"
#include "metrology/inspection/largest_cluster.h"
#include "metrology/kinematics/rotary_axes.h"
#include "tests/metrology/inspection/simulated_pin.h"

namespace sixpoint::metrology {
namespace {

using ::testing::HasSubstr;

// On an oblique surface, metres from the part's origin as real CAD is.
NominalPin Nominal() {
  NominalPin nominal;
  nominal.start_mm = {6357.5, 9.1, -20};
  nominal.axis = Eigen::Vector3d(-0.65, 0.76, -0.03).normalized();
  nominal.normal = Eigen::Vector3d(-0.27, 0.96, 0.05).normalized();
  nominal.hole_diameter_mm = 0.44;
  nominal.hole_depth_mm = 6;
  return nominal;
}

// Displaced along the surface and tilted.
SimulatedPin Drilled(const NominalPin& nominal, const Eigen::Vector2d& shift_mm, const Eigen::Vector2d& tilt) {
  SimulatedPin pin;
  pin.start_mm = nominal.start_mm + TangentBasis(nominal.normal) * shift_mm;
  pin.axis = (nominal.axis + TangentBasis(nominal.axis) * tilt).normalized();
  return pin;
}

std::vector<Eigen::Vector3d> AllRound(const Eigen::Vector3d& axis, int count, double span_deg = 360) {
  const Eigen::Matrix<double, 3, 2> across = TangentBasis(axis);
  std::vector<Eigen::Vector3d> views;
  for (int i = 0; i < count; ++i) {
    const double angle = span_deg * kRadPerDeg * i / count;
    views.push_back((-axis * 0.6 + std::cos(angle) * across.col(0) + std::sin(angle) * across.col(1)).normalized());
  }
  return views;
}

HoleError ErrorOf(const NominalPin& nominal, const PinFit& fit) {
  return HoleErrorOf(nominal, fit, fit.noise_covariance);
}

TEST(FitPin, FindsTheAxisExactlyWithoutNoise) {
  const NominalPin nominal = Nominal();
  SimulatedPin pin = Drilled(nominal, {0.05, -0.03}, {4e-3, 6e-3});
  pin.noise_mm = 0;
  std::mt19937_64 random(1);
  const PinFit fit = FitPin(nominal, SeenFrom(pin, AllRound(nominal.axis, 6), 500, &random));
  ASSERT_TRUE(fit.measured) << fit.reason;
  const HoleError error = ErrorOf(nominal, fit);
  EXPECT_LT((error.start_in_part_mm - pin.start_mm).norm(), 1e-6);
  EXPECT_LT((error.axis_in_part - pin.axis).norm(), 1e-6);
  EXPECT_NEAR(fit.radius_mm, pin.radius_mm, 1e-6);
  EXPECT_NEAR(error.position_mm, std::hypot(0.05, 0.03), 1e-6);
  EXPECT_NEAR(error.inclination_rad, std::atan(std::hypot(4e-3, 6e-3)), 1e-6);
}

// Over many pins, seen all round or from one side only: no bias, and the stated uncertainty holds as often as k = 2 says.
TEST(FitPin, StatesWhatManyPinsConfirm) {
  for (const double span_deg : {360.0, 150.0}) {
    constexpr int kPins = 300;
    int position_inside = 0, inclination_inside = 0;
    Eigen::Vector3d bias = Eigen::Vector3d::Zero();
    double position_squares = 0;
    std::mt19937_64 random(7);
    std::normal_distribution<double> normal;
    for (int i = 0; i < kPins; ++i) {
      const NominalPin nominal = Nominal();
      const SimulatedPin pin = Drilled(nominal, {0.03 * normal(random), 0.03 * normal(random)},
                                       {4e-3 * normal(random), 4e-3 * normal(random)});
      const PinFit fit = FitPin(nominal, SeenFrom(pin, AllRound(nominal.axis, 4, span_deg), 150, &random));
      ASSERT_TRUE(fit.measured) << fit.reason;
      const HoleError error = ErrorOf(nominal, fit);
      const double true_position = (pin.start_mm - nominal.start_mm).norm();
      const double true_inclination = std::acos(std::min(1.0, pin.axis.dot(nominal.axis)));
      position_inside += std::abs(error.position_mm - true_position) <= 2 * error.position_standard_uncertainty_mm;
      inclination_inside +=
          std::abs(error.inclination_rad - true_inclination) <= 2 * error.inclination_standard_uncertainty_rad;
      bias += (error.start_in_part_mm - pin.start_mm) / kPins;
      position_squares += (error.start_in_part_mm - pin.start_mm).squaredNorm();
    }
    // 95.4 % of 300, less or more four standard deviations.
    EXPECT_GT(position_inside, 0.954 * kPins - 15) << span_deg;
    EXPECT_GT(inclination_inside, 0.954 * kPins - 15) << span_deg;
    EXPECT_LT(position_inside, kPins) << span_deg;
    const double rms = std::sqrt(position_squares / kPins);
    EXPECT_LT(rms, 1e-3) << span_deg;
    EXPECT_LT(bias.norm(), 4 * rms / std::sqrt(kPins)) << span_deg;
  }
}

TEST(FitPin, IsNotMovedByChipsAndWrongPoints) {
  const NominalPin nominal = Nominal();
  const SimulatedPin pin = Drilled(nominal, {0.04, 0.02}, {3e-3, -2e-3});
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> anywhere(-0.5, 0.5);
  Points points = SeenFrom(pin, AllRound(nominal.axis, 6), 300, &random);
  const PinFit clean = FitPin(nominal, points);
  for (int i = 0; i < 180; ++i)
    points.push_back(nominal.start_mm + nominal.axis * (2 + 4 * anywhere(random)) +
                     TangentBasis(nominal.axis) * Eigen::Vector2d(anywhere(random), anywhere(random)));
  const PinFit fit = FitPin(nominal, points);
  ASSERT_TRUE(fit.measured) << fit.reason;
  EXPECT_LT((fit.offset_mm - clean.offset_mm).norm(), 0.5e-3);
  EXPECT_LT((fit.slope - clean.slope).norm(), 0.2e-3);
}

// Half as many points as the pin's own, on another pin that stands 0.8 mm beside it.
TEST(FitPin, LeavesOutAPinThatStandsApart) {
  const NominalPin nominal = Nominal();
  const SimulatedPin pin = Drilled(nominal, {0.04, 0.02}, {3e-3, -2e-3});
  SimulatedPin other = pin;
  other.start_mm += 0.8 * TangentBasis(nominal.axis).col(0);
  std::mt19937_64 random(5);
  Points points = SeenFrom(pin, AllRound(nominal.axis, 6), 300, &random);
  const PinFit alone = FitPin(nominal, points);
  const Points others = SeenFrom(other, AllRound(nominal.axis, 6), 150, &random);
  points.insert(points.begin(), others.begin(), others.end());
  const PinFit fit = FitPin(nominal, points);
  ASSERT_TRUE(fit.measured) << fit.reason;
  EXPECT_LT((fit.offset_mm - alone.offset_mm).norm(), 0.1e-3);
  ASSERT_FALSE(fit.used.empty());
  EXPECT_GE(*std::min_element(fit.used.begin(), fit.used.end()), others.size());
  PinLimits all_points;
  all_points.apart_mm = 0;
  EXPECT_FALSE(FitPin(nominal, points, all_points).measured);
}

TEST(FitPin, SaysWhyAHoleWasNotMeasured) {
  const NominalPin nominal = Nominal();
  const SimulatedPin pin = Drilled(nominal, {0.02, 0.02}, {0, 0});
  std::mt19937_64 random(4);
  const auto reason = [&](const SimulatedPin& seen, const std::vector<Eigen::Vector3d>& views, int count) {
    const PinFit fit = FitPin(nominal, SeenFrom(seen, views, count, &random));
    EXPECT_FALSE(fit.measured);
    return fit.reason;
  };
  EXPECT_THAT(FitPin(nominal, {}).reason, HasSubstr("0 points"));
  EXPECT_THAT(reason(pin, AllRound(nominal.axis, 4), 10), HasSubstr("points"));
  SimulatedPin thick = pin;
  thick.radius_mm = 0.4;
  EXPECT_THAT(reason(thick, AllRound(nominal.axis, 4), 300), HasSubstr("diameter 0.80"));
  SimulatedPin stub = pin;
  stub.length_mm = 0.8;
  EXPECT_THAT(reason(stub, AllRound(nominal.axis, 4), 300), HasSubstr("of its length"));
  EXPECT_THAT(reason(pin, {AllRound(nominal.axis, 4)[0]}, 40), HasSubstr("points"));
  PinLimits whole;
  whole.least_arc_deg = 300;
  EXPECT_THAT(FitPin(nominal, SeenFrom(pin, {AllRound(nominal.axis, 4)[0]}, 1000, &random), whole).reason,
              HasSubstr("deg of the circumference"));
}

// Points that are no cylinder: a chip, a smear.
TEST(FitPin, DoesNotMeasureAHeapOfPoints) {
  const NominalPin nominal = Nominal();
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> anywhere(-0.5, 0.5);
  Points points;
  for (int i = 0; i < 2000; ++i)
    points.push_back(nominal.start_mm + nominal.axis * (2 + 4 * anywhere(random)) +
                     TangentBasis(nominal.axis) * Eigen::Vector2d(anywhere(random), anywhere(random)));
  const PinFit fit = FitPin(nominal, points);
  EXPECT_FALSE(fit.measured);
  EXPECT_FALSE(fit.reason.empty());
}

// The start is where the axis meets the surface's tangent plane, whatever the obliquity.
TEST(HoleErrorOf, PutsTheStartIntoTheTangentPlane) {
  const NominalPin nominal = Nominal();
  SimulatedPin pin = Drilled(nominal, {0.06, 0}, {8e-3, 0});
  pin.noise_mm = 0;
  std::mt19937_64 random(6);
  const PinFit fit = FitPin(nominal, SeenFrom(pin, AllRound(nominal.axis, 6), 300, &random));
  const HoleError error = ErrorOf(nominal, fit);
  EXPECT_NEAR((error.start_in_part_mm - nominal.start_mm).dot(nominal.normal), 0, 1e-9);
}

// Every pair of them would be looked at: minutes.
TEST(LargestCluster, IsNotLookedForInOnePlace) {
  Points near, far;
  for (int i = 0; i < 50'000; ++i) {
    near.emplace_back(1e-6 * i, 0, 0);
    far.emplace_back(0.1 * i, 0, 0);
  }
  EXPECT_TRUE(LargestCluster(near, 0.15).empty());
  EXPECT_EQ(LargestCluster(far, 0.15).size(), far.size());
}

// Half of a pin, as a scan from one side has it: its certificate says how far its axis lies behind what was seen, unless the scanner sees
// the pin otherwise. Within the stated uncertainty either way, as often as k = 2 says or more.
TEST(FitPin, AGaugePinsDiameterIsAnObservation) {
  for (const double seen_otherwise_mm : {0.0, 0.004, -0.004}) {
    SCOPED_TRACE(seen_otherwise_mm);
    std::mt19937_64 random(3);
    std::normal_distribution<double> normal;
    int inside = 0;
    double u_without_mm = 0, u_with_mm = 0;
    constexpr int kPins = 60;
    for (int i = 0; i < kPins; ++i) {
      NominalPin nominal = Nominal();
      SimulatedPin pin = Drilled(nominal, 0.02 * Eigen::Vector2d(normal(random), normal(random)),
                                 2e-3 * Eigen::Vector2d(normal(random), normal(random)));
      pin.radius_mm += seen_otherwise_mm / 2;
      const Points points = SeenFrom(pin, AllRound(nominal.axis, 4, 90), 60, &random);
      const PinFit without = FitPin(nominal, points);
      nominal.gauge = GaugePin{0.44 + 5e-4 * normal(random), 5e-4, 0};
      const PinFit with = FitPin(nominal, points);
      ASSERT_TRUE(without.measured && with.measured) << without.reason << with.reason;
      EXPECT_EQ(with.radius_mm, without.radius_mm);  // as seen
      const HoleError error = ErrorOf(nominal, with);
      const double true_mm = (pin.start_mm - nominal.start_mm).norm();
      inside += std::abs(error.position_mm - true_mm) <= 2 * error.position_standard_uncertainty_mm;
      u_without_mm += std::sqrt(without.noise_covariance.topLeftCorner<2, 2>().trace()) / kPins;
      u_with_mm += std::sqrt(with.noise_covariance.topLeftCorner<2, 2>().trace()) / kPins;
    }
    EXPECT_GE(inside, kPins * 88 / 100);
    EXPECT_LE(u_with_mm, u_without_mm);
  }
}

}  // namespace
}  // namespace sixpoint::metrology
