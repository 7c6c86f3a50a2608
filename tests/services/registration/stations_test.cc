// Three blades in one fixture, each scan of all of them: what the service makes of a scan's station.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "services/runtime/geometry_proto.h"
#include "tests/services/registration/fake_plant.h"

namespace sixpoint::registration {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using ::testing::HasSubstr;

constexpr double kPitchMm = 8, kCaptureMm = 3;

class StationsTest : public FakePlantTest {
 protected:
  // Flank to flank, 3 mm between them, each off by an error of its own.
  StationsTest() {
    Design(TrueBlade());
    std::mt19937_64 random(71);
    std::uniform_real_distribution<double> unit(-1, 1);
    for (int k = 0; k < 3; ++k) {
      const Isometry3d nominal = plant_.block.pose.zero_from_part * Eigen::Translation3d(0, kPitchMm * (k - 1), 0);
      plant::v1::Station& station = *plant_.plant.part.add_stations();
      station.set_station("s" + std::to_string(k + 1));
      station.set_capture_mm(kCaptureMm);
      runtime::ToProto(nominal, station.mutable_zero_from_part_nominal());
      metrology::Vector6d off;
      for (int i = 0; i < 6; ++i) off[i] = (i < 3 ? 0.005 : 0.6) * unit(random);
      truth_.push_back(metrology::Perturbed(nominal, off, nominal.translation()));
    }
    ScanAll({0, 1, 2});
  }

  // Each scan has what it would see of each that stands there.
  void ScanAll(const std::vector<std::size_t>& present) {
    const auto surface = *metrology::Surface::Prepare(TrueBlade());
    std::mt19937_64 random(73);
    std::uniform_int_distribution<std::size_t> pick(0, surface->mesh().vertices_mm.size() - 1);
    std::normal_distribution<double> beside(0, 0.5);
    for (std::size_t view = 0; view < plant_.scans.size(); ++view) {
      const Vector3d to_scanner =
          plant_.block.axes.MachineFromZero(0, plant_.block.b_deg[view] * M_PI / 180).linear().transpose() *
          plant_.block.sensor.rotation.col(2);
      metrology::Points points;
      for (const std::size_t k : present)
        for (int i = 0; i < 20'000;) {
          const metrology::SurfacePoint on = surface->Closest(surface->mesh().vertices_mm[pick(random)] +
                                                              Vector3d(beside(random), beside(random), beside(random)));
          if (!((truth_[k].linear() * on.normal).dot(to_scanner) > 0.25)) continue;
          points.push_back(plant_.block.pose.zero_from_part.inverse() * truth_[k] * on.point_mm);
          ++i;
        }
      ScanPoints(view, points);
    }
  }
  v1::RegisterRequest At(const std::string& station, v1::Method method = v1::METHOD_BEST_FIT) {
    for (auto& [name, scan] : plant_.ingest.scans) scan.mutable_header()->set_station(station);
    return Request(method);
  }
  double WorstUm(const v1::Registration& registration, std::size_t station) const {
    const Isometry3d pose = PoseOf(registration);
    double worst_um = 0;
    for (const Vector3d& p : {Vector3d(12, 0, 20), Vector3d(-12, 2, 20), Vector3d(12, 0, -20), Vector3d(-12, 2, -20)})
      worst_um = std::max(worst_um, 1e3 * (pose * p - truth_[station] * p).norm());
    return worst_um;
  }

  std::vector<Isometry3d> truth_;
};

// 80,000 points with 2 um along the ray: a tenth of a micrometre; six points a few times that.
TEST_F(StationsTest, EachFindsItsOwnBladeAndSaysWhereItStood) {
  for (std::size_t k = 0; k < 3; ++k) {
    const std::string station = "s" + std::to_string(k + 1);
    for (const v1::Method method : {v1::METHOD_BEST_FIT, v1::METHOD_SIX_POINT, v1::METHOD_LOCAL}) {
      v1::RegisterRequest request = At(station, method);
      request.mutable_options()->set_coarse_start(method == v1::METHOD_LOCAL);
      const v1::Registration registration = Register(request);
      ASSERT_EQ(registration.evidence().outcome(), v1::OUTCOME_CONVERGED) << registration.evidence().remark();
      std::printf("%s, %s: worst corner %.2f um, %lld points of others left out\n", station.c_str(),
                  v1::Method_Name(method).c_str(), WorstUm(registration, k),
                  static_cast<long long>(registration.evidence().left_out_count()));
      EXPECT_LT(WorstUm(registration, k), method == v1::METHOD_SIX_POINT ? 3 : 1);
      EXPECT_EQ(registration.station(), station);
      // Two of three blades' points, give or take.
      EXPECT_NEAR(static_cast<double>(registration.evidence().left_out_count()), 160'000, 8'000);
      EXPECT_NEAR(static_cast<double>(registration.evidence().point_count()), 80'000, 8'000);
    }
  }
  EXPECT_EQ(Count("registrations WHERE station = 's2'"), 3);
}

TEST_F(StationsTest, WithoutItsBladeThereIsNoPose) {
  ScanAll({0, 2});
  for (const bool coarse_start : {false, true}) {
    v1::RegisterRequest request = At("s2");
    request.mutable_options()->set_coarse_start(coarse_start);
    const auto registration = TryRegister(request);
    if (!registration.ok()) {
      EXPECT_THAT(std::string(registration.status().message()), HasSubstr("station s2"));
      continue;
    }
    EXPECT_NE(registration->evidence().outcome(), v1::OUTCOME_CONVERGED);
    EXPECT_FALSE(registration->has_zero_from_part());
  }
}

TEST_F(StationsTest, ABladeFartherOffThanItMayBeHasNoPose) {
  truth_[0].translation() += truth_[0].linear() * Vector3d(0, -1, 3);  // away from its neighbour
  ScanAll({0});
  const v1::Registration registration = WithoutPose(At("s1"));
  std::printf("off by 3.3 mm: %s\n", registration.evidence().remark().c_str());
  EXPECT_EQ(registration.station(), "s1");
}

TEST_F(StationsTest, AScansStationIsOneOfThePartsAndAllAreOfOne) {
  EXPECT_THAT(RefusalOf(At("")), HasSubstr("scans[0].station: empty, want a station of parts/p1 (s1, s2, s3)"));
  EXPECT_THAT(RefusalOf(At("s9")), HasSubstr("scans[0].station: s9, want a station of parts/p1 (s1, s2, s3)"));
  const v1::RegisterRequest request = At("s1");
  plant_.ingest.scans.at(plant_.scans[2]).mutable_header()->set_station("s2");
  EXPECT_THAT(RefusalOf(request), HasSubstr("'s2', want 's1', as the first scan: another blade stands there"));
  const v1::RegisterRequest snapshots = At("s1");
  for (auto& [name, scan] : plant_.ingest.scans) scan.mutable_header()->set_cloud(ingest::v1::CLOUD_KIND_SNAPSHOT);
  EXPECT_THAT(RefusalOf(snapshots), HasSubstr("a snapshot, want profiles of a line scanner"));
  for (auto& [name, scan] : plant_.ingest.scans) scan.mutable_header()->clear_cloud();
  plant_.plant.part.clear_stations();
  EXPECT_THAT(RefusalOf(At("s1")), HasSubstr("scans[0].station: s1, want none: parts/p1 has no stations"));
}

}  // namespace
}  // namespace sixpoint::registration
