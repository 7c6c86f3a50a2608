#include "metrology/calibration/field_estimate.h"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <functional>
#include <random>

#include "metrology/calibration/sensor_calibration.h"
#include "tests/metrology/calibration/artefact_sampler.h"

namespace sixpoint::metrology {
namespace {

using sixpoint::testing::ArtefactBench;
using Off = std::function<double(double, double)>;

// Three waves, of root mean square sigma about their mean over -half to half: no polynomial.
Off DrawWaves(double sigma_mm, double shortest_mm, double longest_mm, double half_mm, std::mt19937_64* random) {
  struct Wave {
    double per_y, per_z, phase, height;
  };
  std::uniform_real_distribution<double> turn(0, 2 * M_PI), length(shortest_mm, longest_mm);
  std::normal_distribution<double> normal;
  std::vector<Wave> waves;
  for (int i = 0; i < 3; ++i) {
    const double along = turn(*random), per_mm = 2 * M_PI / length(*random);
    waves.push_back({per_mm * std::cos(along), per_mm * std::sin(along), turn(*random), normal(*random)});
  }
  const auto at = [waves](double y, double z) {
    double off = 0;
    for (const Wave& w : waves) off += w.height * std::cos(w.per_y * y + w.per_z * z + w.phase);
    return off;
  };
  double mean = 0, square = 0;
  constexpr int kSteps = 20;
  for (int i = 0; i < kSteps * kSteps; ++i) {
    const double off =
        at(half_mm * (2 * (i / kSteps + 0.5) / kSteps - 1), half_mm * (2 * (i % kSteps + 0.5) / kSteps - 1));
    mean += off / (kSteps * kSteps);
    square += off * off / (kSteps * kSteps);
  }
  const double scale = sigma_mm * normal(*random) / std::sqrt(square - mean * mean);
  return [=](double y, double z) { return scale * (at(y, z) - mean); };
}

ScannerField Field() { return ScannerField::Of(66, 25, 20 * M_PI / 180); }

// A plate under the line, at these heights and places of it; where it stands along z, and how it is turned, is found from the readings.
std::vector<FieldResidual> Look(const std::vector<double>& heights_mm, const std::vector<double>& places_mm,
                                const Off& field, const Off& form, double noise_mm, std::mt19937_64* random) {
  std::normal_distribution<double> noise(0, noise_mm);
  std::vector<FieldResidual> residuals;
  std::vector<double> on_plate;
  for (const double z : heights_mm)
    for (const double place : places_mm)
      for (double y = -11; y <= 11; y += 1) {
        if (std::abs(y + place) > 13) continue;
        residuals.push_back({field(y + place, z) + form(y, 0) + noise(*random), Field().SeriesAt(y + place, z),
                             FlatnessTermsAt({0, y / 12}), noise_mm * noise_mm, true});
        on_plate.push_back(y);
      }
  const auto count = static_cast<Eigen::Index>(residuals.size());
  Eigen::MatrixXd pose(count, 2), all(count, 1 + kFieldSeriesCount + kFlatnessTermCount);
  for (Eigen::Index k = 0; k < count; ++k) {
    const FieldResidual& one = residuals[static_cast<std::size_t>(k)];
    pose.row(k) << 1, on_plate[static_cast<std::size_t>(k)];
    all.row(k) << one.off_mm, one.by_field, one.by_flatness;
  }
  all -= pose * pose.householderQr().solve(all);
  for (Eigen::Index k = 0; k < count; ++k) {
    FieldResidual& one = residuals[static_cast<std::size_t>(k)];
    one.off_mm = all(k, 0);
    one.by_field = all.row(k).segment<kFieldSeriesCount>(1);
    one.by_flatness = all.row(k).tail<kFlatnessTermCount>();
  }
  return residuals;
}

// What taking it off leaves at places all over the measuring field, beside what is stated of it.
struct Left {
  double squares_mm2 = 0, stated_mm2 = 0, before_mm2 = 0;
  int count = 0, covered = 0;
};
void LookAtLeft(const Off& field, const MeasuredField& measured, Left* left) {
  const ScannerField of = Field();
  double mean = 0;
  std::vector<std::pair<double, double>> seen;
  for (double y = -0.9; y < 1; y += 0.3)
    for (double z = -0.9; z < 1; z += 0.3) {
      const double y_mm = y * of.half_width_mm, z_mm = z * of.half_range_mm;
      const auto terms = of.TermsAt(y_mm, z_mm);
      const double off = field(y_mm, z_mm) - terms.dot(measured.terms_mm);
      seen.emplace_back(off, terms.dot(measured.covariance_mm2 * terms.transpose()));
      mean += off / 49;
      left->before_mm2 += std::pow(field(y_mm, z_mm), 2);
    }
  for (const auto& [off, variance_mm2] : seen) {
    left->squares_mm2 += std::pow(off - mean, 2);  // the constant is T_sm's
    left->stated_mm2 += variance_mm2;
    left->covered += std::abs(off - mean) <= 1.96 * std::sqrt(variance_mm2) ? 1 : 0;
    ++left->count;
  }
}

// The procedure: five heights at three places of the line. A field that is no polynomial, a plate that is not flat.
TEST(FieldEstimate, FindsAFieldAndSaysHowWell) {
  for (const double shortest_mm : {20.0, 30.0, 60.0}) {
    Left left;
    for (std::uint64_t seed = 1; seed <= 200; ++seed) {
      std::mt19937_64 random(seed);
      const Off field = DrawWaves(8e-3, shortest_mm, 2 * shortest_mm, 13, &random);
      const Off form = DrawWaves(5e-4, 15, 40, 12, &random);
      const auto seen = Look({-12, -6, 0, 6, 12}, {-5, 0, 5}, field, form, 1e-4, &random);
      LookAtLeft(field, EstimateField(seen, 8e-3, 5e-4), &left);
    }
    const double real = std::sqrt(left.squares_mm2 / left.count), stated = std::sqrt(left.stated_mm2 / left.count);
    std::printf("waves from %.0f mm: 8 um stated, %.2f um real, %.2f left, %.2f stated of it, 95 %% covers %.1f\n",
                shortest_mm, 1e3 * std::sqrt(left.before_mm2 / left.count), 1e3 * real, 1e3 * stated,
                100.0 * left.covered / left.count);
    EXPECT_GT(100.0 * left.covered / left.count, 93) << shortest_mm;
    EXPECT_LT(stated, (shortest_mm < 30 ? 0.4 : 0.2) * 8e-3) << shortest_mm;
  }
}

// Two heights say nothing of what bends between them: there the prior stays.
TEST(FieldEstimate, LeavesWhatIsNotSeenAsUncertainAsItWas) {
  const Eigen::VectorXd prior_mm = FieldCovarianceOf(2e-3, std::nullopt).diagonal().cwiseSqrt();
  std::mt19937_64 random(5);
  const Off none = [](double, double) { return 0.0; };
  const MeasuredField two = EstimateField(Look({-10, 10}, {0}, none, none, 1e-4, &random), 2e-3, 5e-4);
  const Eigen::VectorXd sigma = two.covariance_mm2.diagonal().cwiseSqrt();
  EXPECT_GT(sigma[4], 0.9 * prior_mm[4]);  // zz
  EXPECT_GT(sigma[7], 0.9 * prior_mm[7]);  // yzz
  EXPECT_LT(sigma[5], 0.8 * prior_mm[5]);  // yyy
  EXPECT_LT(sigma[3], 0.5 * prior_mm[3]);  // yz
  const MeasuredField five =
      EstimateField(Look({-12, -6, 0, 6, 12}, {-5, 0, 5}, none, none, 1e-4, &random), 2e-3, 5e-4);
  for (int k = 0; k < kFieldParameterCount; ++k)
    EXPECT_LT(std::sqrt(five.covariance_mm2(k, k)), 0.6 * prior_mm[k])
        << kFieldParameters[static_cast<std::size_t>(k)].name;
}

// A plate that is not flat is not taken for a field, where it is known how flat it is; moved along the line it shows itself.
TEST(FieldEstimate, TellsAPlatesFormFromAField) {
  Left once, moved;
  for (std::uint64_t seed = 1; seed <= 1000; ++seed) {
    std::mt19937_64 random(seed);
    const Off field = DrawWaves(1e-3, 30, 60, 13, &random), form = DrawWaves(3e-3, 20, 60, 12, &random);
    LookAtLeft(field, EstimateField(Look({-10, 10}, {0}, field, form, 1e-4, &random), 1e-3, 3e-3), &once);
    LookAtLeft(field, EstimateField(Look({-10, 10}, {-5, -2, 0, 2, 5}, field, form, 1e-4, &random), 1e-3, 3e-3),
               &moved);
  }
  EXPECT_GT(100.0 * once.covered / once.count, 93);
  EXPECT_GT(100.0 * moved.covered / moved.count, 93);
  EXPECT_LT(moved.stated_mm2, 0.8 * once.stated_mm2);
}

// The whole calibration, of scans with a field of 3 um: where it maps points of the measuring field to, beside what it says of that.
TEST(FieldEstimate, ACalibrationTakesTheFieldOff) {
  const ArtefactBench bench = ArtefactBench::Usual();
  double before_mm2 = 0, after_mm2 = 0;
  int count = 0, covered = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    std::mt19937_64 random(seed);
    const Off field = DrawWaves(3e-3, 30, 60, 13, &random);
    std::vector<LineScan> scans;
    for (const double z : {-11.0, 0.0, 11.0}) {
      scans.push_back(bench.Scan("z" + std::to_string(z), z, bench.optics.noise_mm, &random));
      for (Eigen::Vector3d& p : scans.back().points_mm) p.z() += field(p.y(), p.z());
    }
    SensorCalibrationOptions options;
    options.optics = bench.optics;
    options.field = Field();
    const ArtefactTouch touch = bench.Touch(bench.touch_noise_mm, &random);
    const auto without = CalibrateSensor(scans, bench.artefact, touch, options);
    options.field_standard_uncertainty_mm = 3e-3;
    const auto with = CalibrateSensor(scans, bench.artefact, touch, options);
    ASSERT_TRUE(without.ok() && with.ok()) << without.status() << with.status();
    ASSERT_TRUE(with->converged && with->sensor.measured_field.has_value() && with->field_response.has_value());
    EXPECT_FALSE(without->sensor.measured_field.has_value());
    for (const double y : {-11.0, -5.0, 0.0, 5.0, 11.0})
      for (const double z : {-10.0, -5.0, 0.0, 5.0, 10.0}) {
        const Eigen::Vector3d reading(0, y, z + field(y, z)),
            truth = bench.sensor.MachineFromSensor({0, y, z}, {0, 0, 0});
        const auto off = [&](const SensorPose& sensor) {
          return (sensor.MachineFromSensor(sensor.WithoutField(reading), {0, 0, 0}) - truth).z();
        };
        const SensorPose& sensor = with->sensor;
        const Eigen::Matrix<double, 1, 6> by_pose = sensor.ParameterJacobian(reading).row(2);
        const Eigen::Matrix<double, 1, 9> by_field =
            sensor.FieldJacobian(reading).row(2) + by_pose * *with->field_response;
        const double variance_mm2 = by_pose.dot(sensor.covariance * by_pose.transpose()) +
                                    by_field.dot(sensor.measured_field->covariance_mm2 * by_field.transpose());
        before_mm2 += std::pow(off(without->sensor), 2);
        after_mm2 += std::pow(off(sensor), 2);
        covered += std::abs(off(sensor)) <= 1.96 * std::sqrt(variance_mm2) ? 1 : 0;
        ++count;
      }
  }
  std::printf("rms along Z %.2f um, %.2f without the field, 95 %% covers %.1f\n", 1e3 * std::sqrt(before_mm2 / count),
              1e3 * std::sqrt(after_mm2 / count), 100.0 * covered / count);
  EXPECT_LT(after_mm2, 0.5 * before_mm2);
  EXPECT_GT(100.0 * covered / count, 90);
}

TEST(FieldEstimate, WidensWhereMoreIsStatedByNow) {
  MeasuredField measured;
  measured.covariance_mm2 = 4e-8 * FieldCovariance::Identity();
  measured.stated_mm = 2e-3;
  EXPECT_EQ(FieldCovarianceOf(2e-3, measured), measured.covariance_mm2);
  EXPECT_EQ(FieldCovarianceOf(1e-3, measured), measured.covariance_mm2);
  EXPECT_NEAR(FieldCovarianceOf(6e-3, measured)(0, 0), 9 * 4e-8, 1e-20);
  EXPECT_NEAR(FieldCovarianceOf(6e-3, std::nullopt).trace(), 36e-6, 1e-18);
}

}  // namespace
}  // namespace sixpoint::metrology
