#include "metrology/uncertainty/error_source.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "metrology/kinematics/linear_axes.h"
#include "metrology/scanner/line_scanner.h"
#include "metrology/uncertainty/thermal_expansion.h"

namespace sixpoint::metrology {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

RotaryAxes SomeAxes() {
  RotaryAxes axes;
  axes.a = {Eigen::Vector3d(2e-3, 1, -1e-3).normalized(), {26, 54, -193}};
  axes.b = {Eigen::Vector3d(1, -3e-3, 2e-3).normalized(), {26.1, 54.2, -193.1}};
  return axes;
}

SensorPose SomeSensor() {
  SensorPose sensor = SensorPose::Exact();
  sensor.rotation = RotationFromCardan({0.002, 0.008, 0.005});
  sensor.t_sm_mm = {14, -41, 85};
  sensor.field = ScannerField::Of(66, 25, 20 * M_PI / 180);
  return sensor;
}

CalibrationParameter ParameterAt(int index) {
  const auto at = [&](const auto& parameters, int first) {
    return parameters[static_cast<std::size_t>(index - first)];
  };
  if (index < kFirstAxisParameter) return at(kSensorParameters, 0);
  if (index < kFirstFieldParameter) return at(kAxisParameters, kFirstAxisParameter);
  if (index < kFirstLinearParameter) return at(kFieldParameters, kFirstFieldParameter);
  return at(kLinearParameters, kFirstLinearParameter);
}

TEST(ErrorSource, ARootIsItsCovarianceWhateverTheUnits) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  Eigen::Matrix<double, kCalibrationParameterCount, 5> factor;
  for (int i = 0; i < factor.rows(); ++i)
    for (int j = 0; j < factor.cols(); ++j)
      factor(i, j) = normal(random) * (ParameterAt(i).unit == ParameterUnit::kRad ? 1e-6 : 1e-3);
  const CalibrationCovariance covariance = factor * factor.transpose();
  const ErrorSource source = SourceOf("some", covariance);
  EXPECT_EQ(source.parameters_per_sigma.cols(), 5);
  const CalibrationCovariance again = CovarianceOf(std::vector<ErrorSource>{source, source});
  const Eigen::VectorXd sigma = covariance.diagonal().cwiseSqrt();
  const Eigen::MatrixXd difference =
      sigma.cwiseInverse().asDiagonal() * (again - 2 * covariance) * sigma.cwiseInverse().asDiagonal();
  EXPECT_LT(difference.cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_EQ(SourceOf("none", CalibrationCovariance::Zero()).parameters_per_sigma.cols(), 0);
}

// A probe that is off by o puts scanner and axes off by o together: every point of a scan comes to lie o away, at any angles.
TEST(ErrorSource, ATouchOffsetShiftsEveryPointAlike) {
  const RotaryAxes axes = SomeAxes();
  const SensorPose sensor = SomeSensor();
  const ErrorSource source = TouchOffset(6e-4, axes.a.direction, axes.b.direction);
  ASSERT_EQ(source.parameters_per_sigma.cols(), 3);
  const Eigen::Vector3d in_sensor(150, 4, -6), v0(-100, -100, 200);
  for (const auto& [a, b] : {std::pair(0.0, 0.0), std::pair(0.7, -1.2), std::pair(-0.9, 3.0)}) {
    const Eigen::Vector3d zero =
        axes.MachineFromZero(a, b).inverse(Eigen::Isometry) * sensor.MachineFromSensor(in_sensor, v0);
    const Eigen::Matrix3d moved =
        ZeroPointSensitivity(in_sensor, zero, a, b, sensor, axes) * source.parameters_per_sigma;
    EXPECT_LT((moved - 6e-4 * Eigen::Matrix3d::Identity()).norm(), 1e-12) << a << " " << b;
  }
}

TEST(ErrorSource, AScannersFieldHasItsRootMeanSquareOverTheMeasuringField) {
  const SensorPose sensor = SomeSensor();
  const ErrorSource source = ScannerFieldSource(FieldCovarianceOf(2e-3, std::nullopt), FieldResponse::Zero());
  const auto terms_of_draws = source.parameters_per_sigma.middleRows<kFieldParameterCount>(kFirstFieldParameter);
  double sum = 0;
  Eigen::Matrix<double, kFieldParameterCount, kFieldParameterCount> products;
  products.setZero();
  constexpr int kSteps = 200;
  for (int i = 0; i < kSteps; ++i)
    for (int k = 0; k < kSteps; ++k) {
      const auto terms = sensor.field.TermsAt(sensor.field.half_width_mm * (2 * (i + 0.5) / kSteps - 1),
                                              sensor.field.half_range_mm * (2 * (k + 0.5) / kSteps - 1));
      sum += (terms * terms_of_draws).squaredNorm();
      products += terms.transpose() * terms / (kSteps * kSteps);
    }
  EXPECT_NEAR(std::sqrt(sum) / kSteps, 2e-3, 2e-6);
  EXPECT_LT((products - decltype(products)::Identity()).cwiseAbs().maxCoeff(), 1e-3);  // orthogonal: none is another's
  EXPECT_EQ(ScannerField().TermsAt(3, 4).norm(), 0);
  const double out = 2 * sensor.field.half_width_mm;
  EXPECT_EQ((sensor.field.TermsAt(out, 0) - sensor.field.TermsAt(sensor.field.half_width_mm, 0)).norm(), 0);
}

// A part that is longer by u and turned on true axes is longer by u at every angle, about the place where all coordinates are 0: as if
// the linear axes read everything stretched, the rotary axes included.
TEST(ErrorSource, AnExpansionStretchesThePartAtAnyAngle) {
  const RotaryAxes axes = SomeAxes();
  const SensorPose sensor = SomeSensor();
  const ErrorSource source = Expansion("warm", 1e-4, LineResponse(axes));
  const Eigen::Vector3d in_sensor(150, 4, -6), v0(-100, -100, 200);
  for (const auto& [a, b] : {std::pair(0.0, 0.0), std::pair(0.7, -1.2), std::pair(-0.9, 3.0)}) {
    const Eigen::Vector3d zero =
        axes.MachineFromZero(a, b).inverse(Eigen::Isometry) * sensor.MachineFromSensor(in_sensor, v0);
    const Eigen::Vector3d moved =
        ZeroPointSensitivity(in_sensor, zero, a, b, sensor, axes) * source.parameters_per_sigma;
    EXPECT_LT((moved - 1e-4 * zero).norm(), 1e-12) << a << " " << b;
  }
}

TEST(ThermalExpansion, IsThePartsLessTheScales) {
  // Nickel, 100 mm, 5 K: 6.25 um; on steel scales as warm, 11.5: 0.5 um.
  const ExpansionCoefficient nickel{12.5e-6, 0.5e-6}, steel{11.5e-6, 0.3e-6};
  const Temperature warm{25, 0.2};
  const Stretch alone = StretchOf(nickel, warm, {}, {});
  EXPECT_NEAR(100 * (alone.ratio - 1), 6.25e-3, 1e-12);
  EXPECT_NEAR(alone.by_coefficients, 5 * 0.5e-6, 1e-15);
  EXPECT_NEAR(alone.by_temperatures, 0.2 * std::hypot(12.5e-6, 0.5e-6), 1e-15);
  const Stretch both = StretchOf(nickel, warm, steel, warm);
  EXPECT_NEAR(100 * (both.ratio - 1), 0.5e-3, 1e-12);
  EXPECT_NEAR(both.by_coefficients, 5 * std::hypot(0.5e-6, 0.3e-6), 1e-15);
  const Stretch bounded = StretchOf(nickel, Within(5), {}, {});
  EXPECT_EQ(bounded.ratio, 1);
  EXPECT_EQ(bounded.by_coefficients, 0);
  EXPECT_NEAR(bounded.by_temperatures, 5 / std::sqrt(3.0) * std::hypot(12.5e-6, 0.5e-6), 1e-15);
}

TEST(ErrorSource, DegreesOfFreedomAddAsWelchAndSatterthwaiteSay) {
  EXPECT_EQ(EffectiveDegreesOfFreedom({{"a", 2, 7}}), 7);
  EXPECT_NEAR(EffectiveDegreesOfFreedom({{"a", 3, 5}, {"b", 3, 5}}), 10, 1e-12);
  EXPECT_NEAR(EffectiveDegreesOfFreedom({{"a", 1, 4}, {"b", 1, kInfinite}}), 16, 1e-12);
  EXPECT_EQ(EffectiveDegreesOfFreedom({{"a", 1, kInfinite}}), kInfinite);
  EXPECT_EQ(EffectiveDegreesOfFreedom({}), kInfinite);
  EXPECT_EQ(WideningOf(0.95, kInfinite), 1);
  EXPECT_NEAR(WideningOf(0.95, 7), 2.364624 / 1.959964, 1e-4);  // tables of Student's distribution
  EXPECT_NEAR(WideningOf(0.95, 3), 3.182446 / 1.959964, 1e-4);
}

// 95 % of a value whose sources are known to few degrees of freedom: intervals that were not widened would cover 88 to 92 %.
TEST(ErrorSource, WidenedIntervalsCover) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  for (const int freedom : {3, 7, 14}) {
    std::chi_squared_distribution<double> chi2(freedom);
    constexpr int kDraws = 20'000;
    int inside = 0, unwidened = 0;
    for (int draw = 0; draw < kDraws; ++draw) {
      const double estimated = chi2(random) / freedom, known = 0.5;
      const double error = normal(random) + std::sqrt(known) * normal(random);
      const std::vector<UncertaintyComponent> budget = {{"few", estimated, static_cast<double>(freedom)},
                                                        {"known", known, kInfinite}};
      const double u = std::sqrt(estimated + known);
      inside += std::abs(error) <= 1.959964 * u * WideningOf(0.95, EffectiveDegreesOfFreedom(budget));
      unwidened += std::abs(error) <= 1.959964 * u;
    }
    std::printf("%d degrees of freedom: %.1f %% (not widened %.1f %%)\n", freedom, 100.0 * inside / kDraws,
                100.0 * unwidened / kDraws);
    EXPECT_GT(100.0 * inside / kDraws, 93);
    EXPECT_LT(100.0 * inside / kDraws, 97.5);
  }
}

// What two results share shows: an arm that swung between them is two sources, the calibration that both rest on is one.
TEST(ErrorSource, AnArmsSwingsAddForThePose) {
  SensorCovariance spread = SensorCovariance::Identity() * 4e-6;
  const std::vector<ErrorSource> sources = {ArmSwing("calibrated", spread, 14), ArmSwing("scanned", spread, 14)};
  EXPECT_EQ(sources[0].degrees_of_freedom, 14);
  std::vector<ErrorSource> acting = sources;
  PoseSensitivity sensitivity = PoseSensitivity::Zero();
  sensitivity.leftCols<6>().setIdentity();
  ActOnPose(sensitivity, &acting);
  EXPECT_LT((PoseCovarianceOf(acting) - 2 * Matrix6d::Identity() * 4e-6).norm(), 1e-15);
}

// What was never computed has no draws that could be forgotten.
TEST(ErrorSource, OfNoNumberIsNone) {
  EXPECT_FALSE(SourceOf("x", NotYet<CalibrationCovariance>()).parameters_per_sigma.allFinite());
  EXPECT_GT(SourceOf("x", NotYet<CalibrationCovariance>()).parameters_per_sigma.cols(), 0);
  EXPECT_FALSE(SensorCalibrationSource(SensorPose().covariance, 10, "c").parameters_per_sigma.allFinite());
}

}  // namespace
}  // namespace sixpoint::metrology
