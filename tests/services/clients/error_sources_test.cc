#include "services/clients/error_sources.h"

#include <gmock/gmock.h>

#include <numeric>

namespace sixpoint::clients {
namespace {

using metrology::Matrix6d;
using ::testing::ElementsAre;

constexpr double kFreedom = 14;

FetchedArmStudy Arm() {
  FetchedArmStudy arm;
  arm.spread.covariance = 4e-6 * Matrix6d::Identity();
  arm.spread.degrees_of_freedom = kFreedom;
  return arm;
}

struct Stated {
  plant::v1::Machine machine;
  plant::v1::Part part;
  ingest::v1::ScanHeader scan;
  FetchedSensorCalibration sensor;
  FetchedRotationCalibration rotation;

  Stated() {
    machine.set_name("machines/m1");
    scan.set_scan_id("s");
    sensor.name = "calibrations/c";
    rotation.axes.a.direction = Eigen::Vector3d::UnitY();
    rotation.axes.b.direction = Eigen::Vector3d::UnitX();
  }
  std::vector<metrology::ErrorSource> Sources(const std::optional<FetchedArmStudy>& arm) const {
    const auto sources = FurtherSources({machine, part, scan}, sensor, rotation, arm);
    EXPECT_TRUE(sources.ok()) << sources.status();
    return sources.value_or(std::vector<metrology::ErrorSource>());
  }
};

std::vector<std::string> NamesOf(const std::vector<metrology::ErrorSource>& sources) {
  std::vector<std::string> names;
  for (const metrology::ErrorSource& source : sources) names.push_back(source.name);
  return names;
}

double FreedomOf(const std::vector<metrology::ErrorSource>& sources) {
  return std::accumulate(sources.begin(), sources.end(), 0.0,
                         [](double sum, const auto& source) { return sum + source.degrees_of_freedom; });
}

// Of the shift along X, mm^2.
double VarianceOf(const std::vector<metrology::ErrorSource>& sources) { return metrology::CovarianceOf(sources)(3, 3); }

TEST(ErrorSources, OfOneSwingTheArmIsThereTwice) {
  Stated stated;
  stated.sensor.arm_series = "c";
  stated.scan.set_arm_series("s1");
  const auto sources = stated.Sources(Arm());
  EXPECT_THAT(NamesOf(sources),
              ElementsAre("arm when calibrated, calibrations/c", "arm when scanned, machines/m1, s1"));
  EXPECT_NEAR(VarianceOf(sources), 8e-6, 1e-12);
  EXPECT_NEAR(FreedomOf(sources), kFreedom, 1e-9);
  stated.scan.set_arm_series("c");  // nobody touched it since
  EXPECT_TRUE(stated.Sources(Arm()).empty());
  EXPECT_TRUE(stated.Sources(std::nullopt).empty());
}

// Over four swings a quarter of it is left of when it was calibrated.
TEST(ErrorSources, OfSeveralSwingsTheirMean) {
  Stated stated;
  for (const char* series : {"c", "a1", "a2", "a3"})
    stated.sensor.arm_shares.push_back({series, 0.25 * Matrix6d::Identity()});
  stated.scan.set_arm_series("s1");
  const auto other = stated.Sources(Arm());
  EXPECT_THAT(NamesOf(other), ElementsAre("arm when calibrated, calibrations/c", "arm when scanned, machines/m1, s1"));
  EXPECT_NEAR(VarianceOf(other), 4e-6 * (0.25 + 1), 1e-12);
  EXPECT_NEAR(FreedomOf(other), kFreedom, 1e-9);
  // A scan of a swing that calibrated is off the mean by three quarters of where the arm stood then, and by the others' quarter each.
  stated.scan.set_arm_series("a2");
  const auto same = stated.Sources(Arm());
  EXPECT_THAT(NamesOf(same),
              ElementsAre("arm when calibrated, calibrations/c, without a2", "arm when scanned, machines/m1, a2"));
  EXPECT_NEAR(VarianceOf(same), 4e-6 * (3 * 0.0625 + 0.5625), 1e-12);
  EXPECT_NEAR(FreedomOf(same), kFreedom, 1e-9);
}

TEST(ErrorSources, OfAMeasuredFieldWhatIsLeft) {
  Stated stated;
  stated.machine.mutable_error_sources()->set_scanner_field_um(3);
  const auto field_of = [&] {
    return metrology::CovarianceOf(stated.Sources(std::nullopt)).diagonal().segment<9>(14).eval();
  };
  EXPECT_NEAR(field_of().sum(), 9e-6, 1e-12);
  stated.sensor.sensor.measured_field.emplace();
  stated.sensor.sensor.measured_field->covariance_mm2 = 1e-8 * metrology::FieldCovariance::Identity();
  stated.sensor.sensor.measured_field->stated_mm = 3e-3;
  EXPECT_NEAR(field_of().sum(), 9e-8, 1e-14);
  stated.machine.mutable_error_sources()->set_scanner_field_um(6);  // it is known worse by now
  EXPECT_NEAR(field_of().sum(), 4 * 9e-8, 1e-14);
  stated.machine.mutable_error_sources()->clear_scanner_field_um();
  EXPECT_NEAR(field_of().sum(), 9e-8, 1e-14);
}

}  // namespace
}  // namespace sixpoint::clients
