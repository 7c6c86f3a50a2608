// Snapshots through registration's service, in a world that is harsher than its model: the pose, whether what is stated covers it, and what is
// refused by name.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <random>

#include "metrology/cloud/draco_codec.h"
#include "metrology/frames/angles.h"
#include "services/clients/scan_blocks.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "services/runtime/stored_geometry.h"
#include "tests/metrology/mesh/shapes.h"
#include "tests/metrology/registration/snapshot_world.h"
#include "tests/services/registration/fake_plant.h"

namespace sixpoint::registration {
namespace {

using Eigen::Vector3d;
using metrology::kRadPerDeg;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr double kTurnRad = 2e-3 * kRadPerDeg, kShiftMm = 5e-3;

class SnapshotRegistrationTest : public FakePlantTest {
 protected:
  SnapshotRegistrationTest() {
    Design(TrueBlade());
    plant::v1::Sensor& sensor = *plant_.plant.machine.mutable_sensor();
    sensor.set_kind(plant::v1::SENSOR_KIND_SNAPSHOT);
    sensor.set_column_count(0);
    plant_.plant.machine.mutable_error_sources()->set_scanner_field_um(1e3 * world_.distortion_mm);
    calibration::v1::SensorCalibration& stated = *plant_.calibration.sensor.mutable_sensor();
    stated.set_certificate("K-17, Metrolab");
    stated.clear_field_response();
    metrology::Matrix6d covariance = metrology::Matrix6d::Zero();
    covariance.diagonal() << Vector3d::Constant(kTurnRad * kTurnRad), Vector3d::Constant(kShiftMm * kShiftMm);
    runtime::SetMatrix(runtime::RowMajor(covariance), 6, 6, stated.mutable_covariance());
    for (const std::string& scan : plant_.scans) SetSnapshot(plant_.ingest.scans.at(scan).mutable_header());
  }
  static void SetSnapshot(ingest::v1::ScanHeader* header) {
    header->set_cloud(ingest::v1::CLOUD_KIND_SNAPSHOT);
    header->set_length_unit(ingest::v1::LENGTH_UNIT_MILLIMETRE);
    header->clear_profile_pitch_mm();
    header->clear_columns_per_profile();
    header->clear_travel();
  }

  // The first scan shows the blade so, by a sensor that stands a little beside where it is stated to; times `factor`.
  void Show(std::uint64_t seed, double factor = 1) {
    const auto surface = metrology::Surface::Prepare(TrueBlade());
    const metrology::TriangleMesh body = metrology::shapes::Blade(24, 12, Vector3d::Zero());
    std::mt19937_64 random(seed);
    std::normal_distribution<double> gauss(0, 1);
    metrology::SensorPose sensor = plant_.block.sensor;
    for (int k = 0; k < 3; ++k) {
      sensor.rotation = metrology::RotationFromVector(kTurnRad * gauss(random) * Vector3d::Unit(k)) * sensor.rotation;
      sensor.t_sm_mm[k] += kShiftMm * gauss(random);
    }
    ingest::v1::Scan& record = plant_.ingest.scans.at(plant_.scans[0]);
    const Eigen::Isometry3d machine_from_part =
        plant_.block.axes.MachineFromZero(record.header().a_deg() * kRadPerDeg, record.header().b_deg() * kRadPerDeg) *
        plant_.block.pose.zero_from_part;
    const Vector3d v0_mm(-60, -87, 264);
    metrology::Points points_mm;
    for (const Vector3d& p : metrology::SnapshotOf(**surface, body, world_, seed))
      points_mm.push_back(factor * (sensor.rotation.transpose() * (machine_from_part * p + v0_mm - sensor.t_sm_mm)));
    const auto encoded = metrology::EncodeBlock(points_mm, 1e-3);
    ASSERT_TRUE(encoded.ok()) << encoded.status();
    runtime::ToProto(v0_mm, record.mutable_header()->mutable_v0_mm());
    record.mutable_header()->set_point_count(static_cast<std::int64_t>(points_mm.size()));
    record.clear_profile_count();
    clients::PayloadsDigest digest;
    digest.Add(encoded->bytes);
    record.set_sha256(digest.ToHex());
    plant_.ingest.blocks.at(plant_.scans[0]) = encoded->bytes;
  }
  v1::RegisterRequest OfOne(v1::Method method) const {
    v1::RegisterRequest request = Request(method);
    request.mutable_scans()->DeleteSubrange(1, request.scans_size() - 1);
    return request;
  }

  metrology::SnapshotWorld world_;
};

TEST_F(SnapshotRegistrationTest, FindsTheBladeAndCoversIt) {
  struct Found {
    int covered = 0, of = 0;
    double worst_um = 0;
  };
  std::map<v1::Method, Found> by_method;
  world_.points_per_view = 15'000;  // a datum wants 30 points within a millimetre
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    Show(seed);
    for (const v1::Method method : {v1::METHOD_BEST_FIT, v1::METHOD_SIX_POINT}) {
      const v1::Registration registration = Register(OfOne(method));
      ASSERT_EQ(registration.evidence().outcome(), v1::OUTCOME_CONVERGED) << registration.evidence().remark();
      const Eigen::Isometry3d pose = PoseOf(registration), &truth = plant_.block.pose.zero_from_part;
      const auto covariance = runtime::FromProto("covariance", registration.covariance());
      ASSERT_TRUE(covariance.ok()) << covariance.status();
      Found& found = by_method[method];
      for (const Vector3d& p :
           {Vector3d(12, 0, 20), Vector3d(-12, 2, 20), Vector3d(12, 0, -20), Vector3d(-12, 2, -20)}) {
        const Eigen::Matrix<double, 3, 6> jacobian = metrology::PointJacobian(truth * p, covariance->reference_mm);
        const Eigen::Matrix3d of_point = jacobian * covariance->values * jacobian.transpose();
        const Vector3d off = pose * p - truth * p;
        found.worst_um = std::max(found.worst_um, 1e3 * off.norm());
        for (int k = 0; k < 3; ++k, ++found.of)
          found.covered += std::abs(off[k]) <= 1.96 * std::sqrt(of_point(k, k)) ? 1 : 0;
      }
    }
  }
  for (const auto& [method, found] : by_method) {
    std::printf("%s: corners off %.2f um at most, covered %.1f %%\n", v1::Method_Name(method).c_str(), found.worst_um,
                100.0 * found.covered / found.of);
    EXPECT_LT(found.worst_um, 40);  // the stated pose alone has 5 um an axis and 0.002 degrees
    EXPECT_GE(found.covered, 0.85 * found.of);
  }
}

// What the sensor's pose leaves uncertain goes with the pose by name, as a calibration's does; an arm's study is of another sensor.
TEST_F(SnapshotRegistrationTest, NamesWhatItsPoseRestsOn) {
  Show(7);
  const v1::Registration registration = Register(OfOne(v1::METHOD_BEST_FIT));
  std::vector<std::string> names;
  for (const auto& source : registration.error_sources())
    names.push_back(source.name().substr(0, source.name().find(',')));
  EXPECT_THAT(names, ElementsAre("sensor calibration", "rotation calibration", "scanner's field", "form"));
  // The sensor's shift is the pose's shift: 5 um an axis.
  double shift_um = 0;
  const auto& of_sensor = registration.error_sources(0).pose_per_sigma();
  for (int row = 3; row < 6; ++row)
    for (int draw = 0; draw < of_sensor.column_count(); ++draw)
      shift_um += std::pow(1e3 * of_sensor.values(row * of_sensor.column_count() + draw), 2);
  EXPECT_GT(std::sqrt(shift_um), 5 * std::sqrt(3.0) * 0.99);
}

TEST_F(SnapshotRegistrationTest, AnotherUnitIsNoPose) {
  for (const double factor : {1e-3, 1 / 25.4}) {
    Show(8, factor);
    WithoutPose(OfOne(v1::METHOD_BEST_FIT));
  }
}

// The part's record has it 60 mm beside where it is, and turned by 130 degrees.
TEST_F(SnapshotRegistrationTest, FindsTheBladeFromACoarseStart) {
  Show(10);
  const Eigen::Isometry3d& truth = plant_.block.pose.zero_from_part;
  const Eigen::Isometry3d nominal =
      Eigen::Translation3d(30, -40, 33) * truth * Eigen::AngleAxisd(130 * kRadPerDeg, Vector3d(1, 2, -1).normalized());
  runtime::ToProto(nominal, plant_.plant.part.mutable_zero_from_part_nominal());
  WithoutPose(OfOne(v1::METHOD_BEST_FIT));
  v1::RegisterRequest coarse = OfOne(v1::METHOD_BEST_FIT);
  coarse.mutable_options()->set_coarse_start(true);
  const Eigen::Isometry3d pose = PoseOf(Register(coarse));
  for (const Vector3d& p : {Vector3d(12, 0, 20), Vector3d(-12, 2, -20)})
    EXPECT_LT(1e3 * (pose * p - truth * p).norm(), 40);  // as from nearby
}

TEST_F(SnapshotRegistrationTest, IsRefusedWhereItIsTakenForSomethingElse) {
  Show(9);
  // Scans of the two kinds are not one.
  ingest::v1::ScanHeader& second = *plant_.ingest.scans.at(plant_.scans[1]).mutable_header();
  second.clear_cloud();
  v1::RegisterRequest both = Request(v1::METHOD_BEST_FIT);
  both.mutable_scans()->DeleteSubrange(2, both.scans_size() - 2);
  EXPECT_THAT(RefusalOf(both), HasSubstr(".cloud: PROFILES, want SNAPSHOT, as the first scan"));
  // A line scanner's calibration maps no snapshot, and a stated pose no profiles.
  v1::RegisterRequest profiles = OfOne(v1::METHOD_BEST_FIT);
  profiles.set_scans(0, plant_.scans[1]);
  absl::Status refused = TryRegister(profiles).status();
  EXPECT_EQ(runtime::ReasonOf(refused), "SENSOR_UNSUITABLE");
  EXPECT_THAT(std::string(refused.message()), HasSubstr("sensor.kind: SNAPSHOT, want a line scanner"));
  plant_.plant.machine.mutable_sensor()->set_kind(plant::v1::SENSOR_KIND_LINE);
  refused = TryRegister(profiles).status();
  EXPECT_EQ(runtime::ReasonOf(refused), "SENSOR_UNSUITABLE");
  EXPECT_THAT(std::string(refused.message()), HasSubstr(".cloud: PROFILES, want SNAPSHOT, which calibrations/"));
  EXPECT_EQ(runtime::ReasonOf(TryRegister(OfOne(v1::METHOD_BEST_FIT)).status()), "SENSOR_UNSUITABLE");
  plant_.plant.machine.mutable_sensor()->set_kind(plant::v1::SENSOR_KIND_SNAPSHOT);
  plant_.calibration.sensor.mutable_sensor()->clear_certificate();
  refused = TryRegister(OfOne(v1::METHOD_BEST_FIT)).status();
  EXPECT_EQ(runtime::ReasonOf(refused), "SENSOR_UNSUITABLE");
  EXPECT_THAT(std::string(refused.message()), HasSubstr(".cloud: SNAPSHOT, want PROFILES, which calibrations/"));
}

// Its own lengths do not follow the scales, of which a record may say how they expand.
TEST_F(SnapshotRegistrationTest, IsNotAsLongAsTheScalesHaveIt) {
  Show(10);
  plant_.ingest.scans.at(plant_.scans[0]).mutable_header()->set_subject_temperature_c(24);
  plant_.plant.part.mutable_thermal_expansion()->set_um_per_m_k(12.5);
  plant_.plant.part.mutable_thermal_expansion()->set_standard_uncertainty_um_per_m_k(0.5);
  plant_.plant.machine.mutable_error_sources()->set_temperature_k(0.2);
  EXPECT_TRUE(TryRegister(OfOne(v1::METHOD_BEST_FIT)).ok());
  plant_.plant.machine.mutable_error_sources()->mutable_scale_expansion()->set_um_per_m_k(8);
  plant_.plant.machine.mutable_error_sources()->mutable_scale_expansion()->set_standard_uncertainty_um_per_m_k(0.5);
  EXPECT_THAT(RefusalOf(OfOne(v1::METHOD_BEST_FIT)), HasSubstr(".subject_temperature_c: 24, want none: a snapshot"));
}

}  // namespace
}  // namespace sixpoint::registration
