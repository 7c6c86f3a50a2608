#include "metrology/calibration/feature_search.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/metrology/calibration/artefact_sampler.h"

namespace sixpoint::metrology {
namespace {

using sixpoint::testing::ArtefactBench;
using ::testing::HasSubstr;

// Greatest distance, in the plane, of a feature's place from where the scan's own model has it. The sensor frame is sheared
// by half a degree at most: 0.1 mm over the plate's half diagonal, and the search promises 0.1 mm besides.
constexpr double kPromisedMm = 0.2;
double Miss(const ArtefactBench& bench, const LineScan& scan, const ArtefactSighting& found) {
  double worst = 0;
  for (const PlaneFeature& cone : bench.artefact.cones) {
    const Eigen::Vector3d in_artefact(cone.centre_mm.x(), cone.centre_mm.y(), 0);
    const Eigen::Vector3d off = bench.sensor.MachineFromSensor(found.sensor_from_artefact * in_artefact, scan.v0_mm) -
                                bench.machine_from_artefact * in_artefact;
    worst = std::max(worst, off.norm());
  }
  return worst;
}

class FeatureSearch : public ::testing::Test {
 protected:
  FeatureSearch() : bench(ArtefactBench::Usual()), random(3), scan(bench.Scan("s", 10, 2e-3, &random)) {}
  void ExpectFound(const ArtefactBench& of) {
    const auto found = FindArtefact(scan, of.artefact);
    ASSERT_TRUE(found.ok()) << found.status();
    EXPECT_EQ(found->matched_features, 6);
    EXPECT_LT(Miss(of, scan, *found), kPromisedMm);
  }
  // A level face beside the plate, denser than the plate.
  void AddFace(double first_x, double last_x, double z) {
    for (double x = first_x; x < last_x; x += 0.1)
      for (double y = -11; y < 11; y += 0.05) scan.points_mm.emplace_back(x, y, z);
  }
  ArtefactBench bench;
  std::mt19937_64 random;
  LineScan scan;
};

TEST_F(FeatureSearch, AnyTurnAndTilt) {
  for (const double turn_deg : {-20.0, -7.0, 13.0, 20.0, 120.0, 180.0})
    for (const double tilt_deg : {-4.0, 4.0}) {
      ArtefactBench turned = ArtefactBench::Usual(turn_deg);
      turned.machine_from_artefact.rotate(
          Eigen::AngleAxisd(tilt_deg * M_PI / 180, Eigen::Vector3d(1, 1, 0).normalized()));
      scan = turned.Scan("s", 10, 2e-3, &random);
      SCOPED_TRACE(turn_deg);
      const auto found = FindArtefact(scan, turned.artefact);
      ASSERT_TRUE(found.ok()) << found.status();
      EXPECT_LT(Miss(turned, scan, *found), kPromisedMm) << tilt_deg;
    }
}

TEST_F(FeatureSearch, BesideAFixtureLargerThanThePlate) {
  const size_t plate = scan.points_mm.size();
  AddFace(14, 45, 6);
  AddFace(-45, -14, 2);
  ASSERT_GT(scan.points_mm.size(), 2 * plate);
  ExpectFound(bench);
}

TEST_F(FeatureSearch, ThroughMissingProfilesAndColumns) {
  // A millimetre of profiles out of every cone, and every fourth reading anywhere.
  Points kept;
  size_t i = 0;
  for (const Eigen::Vector3d& p : scan.points_mm) {
    const Eigen::Vector3d at = bench.machine_from_artefact.inverse() * bench.sensor.MachineFromSensor(p, scan.v0_mm);
    const bool gap = std::abs(at.x() + 3) < 0.5 || std::abs(at.x() - 4) < 0.5 || std::abs(at.y() - 1) < 0.2;
    if (!gap && ++i % 4 != 0) kept.push_back(p);
  }
  scan.points_mm = kept;
  ExpectFound(bench);
}

TEST_F(FeatureSearch, AmongReflectionsInTheCones) {
  for (Eigen::Vector3d& p : scan.points_mm) {
    const Eigen::Vector3d at = bench.machine_from_artefact.inverse() * bench.sensor.MachineFromSensor(p, scan.v0_mm);
    for (const PlaneFeature& cone : bench.artefact.cones)
      if ((at.head<2>() - cone.centre_mm - Eigen::Vector2d(1, 0.3)).norm() < 0.6) p.z() += 0.7;
  }
  ExpectFound(bench);
}

TEST_F(FeatureSearch, RefusesAFixtureAlone) {
  scan.points_mm.clear();
  AddFace(-12, 12, 1);
  const auto found = FindArtefact(scan, bench.artefact);
  ASSERT_FALSE(found.ok());
  EXPECT_THAT(
      std::string(found.status().message()),
      ::testing::AllOf(HasSubstr("pattern of cones and slots was not found"), HasSubstr("0 round and 0 square")));
}

TEST_F(FeatureSearch, RefusesAPatternThatFitsInTwoPoses) {
  bench.artefact.slots.clear();
  bench.artefact.cones.clear();
  for (const double deg : {0.0, 120.0, 240.0})
    bench.artefact.cones.push_back({"C" + std::to_string(static_cast<int>(deg)),
                                    {5 * std::cos(deg * M_PI / 180), 5 * std::sin(deg * M_PI / 180)}});
  scan = bench.Scan("s", 10, 2e-3, &random);
  const auto found = FindArtefact(scan, bench.artefact);
  ASSERT_FALSE(found.ok());
  EXPECT_THAT(std::string(found.status().message()), HasSubstr("two poses of the artefact fit equally well"));
}

}  // namespace
}  // namespace sixpoint::metrology
