#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "metrology/frames/angles.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "services/runtime/geometry_proto.h"
#include "storage/record.h"
#include "tests/services/registration/fake_plant.h"
#include "tests/support/exposed.h"

namespace sixpoint::registration {
namespace {

using metrology::kRadPerDeg;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class RegistrationServiceTest : public FakePlantTest {
 protected:
  // A blade in place of the block, scanned from every side.
  void MountBlade() {
    Design(TrueBlade());
    Scan(TrueBlade());
  }
  double ErrorUm(const v1::Registration& registration) const {
    return FakePlantTest::ErrorUm(registration, {{12, 0, 20}, {-12, 2, 20}, {12, 0, -20}, {-12, 2, -20}});
  }
};

TEST_F(RegistrationServiceTest, FindsTheBladeAndReadsBackTheSame) {
  MountBlade();
  for (const v1::Method method : {v1::METHOD_BEST_FIT, v1::METHOD_LOCAL, v1::METHOD_SIX_POINT}) {
    const auto registration = TryRegister(Request(method));
    ASSERT_TRUE(registration.ok()) << registration.status();
    ASSERT_EQ(registration->evidence().outcome(), v1::OUTCOME_CONVERGED) << registration->evidence().remark();
    // 80000 points with 2 um along the ray: a tenth of a micrometre; local fits of six points: a few times that.
    EXPECT_LT(ErrorUm(*registration), method == v1::METHOD_SIX_POINT ? 2 : 0.5);
    EXPECT_EQ(registration->method(), method);
    EXPECT_EQ(registration->scans_size(), 4);
    EXPECT_EQ(registration->evidence().datums_size(), method == v1::METHOD_SIX_POINT ? 6 : 0);
    EXPECT_EQ(registration->sensor_calibration(), testing::kSensorCalibration);
    EXPECT_EQ(registration->calibration_sensitivity().values_size(), 84);

    EXPECT_EQ(Get(registration->name()).SerializeAsString(), registration->SerializeAsString());
    auto transaction = plant_.database.database()->Begin(std::chrono::steady_clock::now() + std::chrono::seconds(10));
    const auto derived = storage::DerivedFrom(*transaction, testing::kRotationCalibration);
    ASSERT_TRUE(derived.ok());
    std::vector<std::string> names;
    for (const storage::JournalEntry& journal : *derived) names.push_back(journal.entry.name);
    EXPECT_THAT(names, Contains(registration->name()));
  }
}

// What makes a pose uncertain is named and kept: what the machine's record states, and an arm that was swung as far as its study says. An arm
// that stands where the sensor was calibrated has not moved; scans of two series are not one.
TEST_F(RegistrationServiceTest, NamesWhatMakesThePoseUncertain) {
  MountBlade();
  const auto names_of = [](const v1::Registration& registration) {
    std::vector<std::string> names;
    for (const auto& source : registration.error_sources())
      names.push_back(source.name().substr(0, source.name().find(',')));
    return names;
  };
  const auto variance_mm2 = [](const v1::Registration& registration) {
    double sum = 0;
    for (const int k : {21, 28, 35}) sum += registration.covariance().values(k);
    return sum;
  };
  const v1::Registration bare = Register(Request(v1::METHOD_BEST_FIT));
  EXPECT_THAT(names_of(bare), ElementsAre("sensor calibration", "rotation calibration", "form"));

  plant::v1::ErrorSources& stated = *plant_.plant.machine.mutable_error_sources();
  stated.set_touch_offset_um(3);
  stated.set_scanner_field_um(2);
  calibration::v1::Study study;
  for (int i = 0; i < 6; ++i) {
    calibration::v1::ArmDisplacement& one = *study.mutable_arm()->add_displacements();
    one.set_dx_mm(1e-3 * (i % 3));
    one.set_dz_mm(1e-3 * (i % 2));
    one.set_dgamma_deg(0.001 * i);
  }
  for (const char* axis : {"dx", "dy", "dz"}) {
    calibration::v1::Spread& spread = *study.mutable_arm()->add_spreads();
    spread.set_quantity(axis);
    spread.set_unit("mm");
    spread.set_stated_standard_uncertainty(1e-5);
  }
  plant_.StudyArm(study);
  for (const std::string& scan : plant_.scans) plant_.ingest.scans.at(scan).mutable_header()->set_arm_series("s2");
  plant_.calibration.sensor.mutable_sensor()->set_arm_series("s1");
  const v1::Registration swung = Register(Request(v1::METHOD_BEST_FIT));
  EXPECT_THAT(names_of(swung), ElementsAre("sensor calibration", "rotation calibration", "touch probe's offset",
                                           "scanner's field", "arm when calibrated", "arm when scanned", "form"));
  EXPECT_EQ(swung.error_sources(4).degrees_of_freedom(), 2.5);  // of five that both share
  EXPECT_FALSE(swung.error_sources(2).has_degrees_of_freedom());
  EXPECT_EQ(swung.error_sources(2).parameters_per_sigma().row_count(), metrology::kCalibrationParameterCount);
  // An offset of 3 um a coordinate moves the pose as far.
  for (int k = 0; k < 3; ++k)
    EXPECT_NEAR(swung.error_sources(2).pose_per_sigma().values(3 * (3 + k) + k), 3e-3, 1e-5) << k;
  EXPECT_GT(variance_mm2(swung), variance_mm2(bare) + 3 * 9e-6);
  auto transaction = plant_.database.database()->Begin(std::chrono::steady_clock::now() + std::chrono::seconds(10));
  const auto derived = storage::DerivedFrom(*transaction, testing::kArmStudy);
  ASSERT_TRUE(derived.ok()) << derived.status();
  EXPECT_EQ(derived->size(), 1u);

  plant_.calibration.sensor.mutable_sensor()->set_arm_series("s2");
  EXPECT_EQ(Register(Request(v1::METHOD_BEST_FIT)).error_sources_size(), 5);
  plant_.ingest.scans.at(plant_.scans[2]).mutable_header()->set_arm_series("s3");
  EXPECT_THAT(RefusalOf(Request(v1::METHOD_BEST_FIT)),
              HasSubstr(".arm_series: 's3', want 's2', as the first scan: the arm was swung between them"));
}

// B reaches 0.05 deg beyond its commands, or 0.04 or 0.06 by its way; the scans were taken where they say plus that.
TEST_F(RegistrationServiceTest, TakesScansAtTheAnglesThatAxesReached) {
  MountBlade();
  const double mean_deg = 0.05, half_reversal_deg = 0.01;
  for (const std::string& scan : plant_.scans) {
    ingest::v1::ScanHeader& header = *plant_.ingest.scans.at(scan).mutable_header();
    header.set_b_deg(header.b_deg() - mean_deg);
  }
  v1::RegisterRequest request = Request(v1::METHOD_SIX_POINT);
  const auto without = TryRegister(request);
  ASSERT_TRUE(without.ok()) << without.status();
  ASSERT_EQ(without->angles_size(), 5);  // one of A, four of B: as uncertain as the machine's record states
  for (const v1::ScanAngle& angle : without->angles()) {
    EXPECT_EQ(angle.characterisation(), "");
    EXPECT_NEAR(angle.reached_deg(), angle.commanded_deg(), 1e-9);
    EXPECT_NEAR(angle.standard_uncertainty_deg(), 1e-5, 1e-12);
  }
  EXPECT_GT(ErrorUm(*without), 20);  // 0.05 deg at 30 mm: 26 um

  request.set_apply_axis_tables(true);
  const absl::Status none = TryRegister(request).status();
  EXPECT_EQ(runtime::ReasonOf(none), "AXIS_NOT_CHARACTERISED");
  EXPECT_THAT(std::string(none.message()), HasSubstr("machines/m1, whose axes A and B have no characterisation"));
  plant_.Characterise(true, std::vector<double>(8, mean_deg + half_reversal_deg),
                      std::vector<double>(8, mean_deg - half_reversal_deg), 0.002);
  const auto registration = TryRegister(request);
  ASSERT_TRUE(registration.ok()) << registration.status();
  ASSERT_EQ(registration->evidence().outcome(), v1::OUTCOME_CONVERGED) << registration->evidence().remark();
  EXPECT_LT(ErrorUm(*registration), 2);  // as with axes that reach their commands
  EXPECT_THAT(registration->evidence().remark(), HasSubstr("calibrated without the table of B"));
  ASSERT_EQ(registration->angles_size(), 5);
  EXPECT_EQ(registration->angles(0).axis(), "A");
  for (const v1::ScanAngle& angle : registration->angles()) {
    if (angle.axis() == "A") continue;
    EXPECT_EQ(angle.characterisation(), testing::kBCharacterisation);
    EXPECT_NEAR(angle.reached_deg() - angle.commanded_deg(), mean_deg, 1e-9);
    EXPECT_NEAR(angle.half_reversal_deg(), half_reversal_deg, 1e-9);
    EXPECT_EQ(angle.pose_per_rad_size(), 6);
  }
  // The reversal turns all scans alike about B, which lies along X: 0.01 deg, and the scatter's half of 0.002 deg.
  const auto plain = runtime::FromProto("covariance", without->covariance());
  const auto covariance = runtime::FromProto("covariance", registration->covariance());
  ASSERT_TRUE(plain.ok() && covariance.ok());
  EXPECT_NEAR(std::sqrt(covariance->values(0, 0)) / kRadPerDeg, std::hypot(0.01, 0.001), 0.002);
  EXPECT_LT(std::sqrt(plain->values(0, 0)) / kRadPerDeg, 0.002);

  EXPECT_EQ(Get(registration->name()).SerializeAsString(), registration->SerializeAsString());
  auto transaction = plant_.database.database()->Begin(testing::Soon());
  const auto derived = storage::DerivedFrom(*transaction, testing::kBCharacterisation);
  ASSERT_TRUE(derived.ok());
  ASSERT_EQ(derived->size(), 1u);
  EXPECT_EQ(derived->front().entry.name, registration->name());

  plant_.calibration.rotation.add_inputs(testing::kBCharacterisation);
  const auto same = TryRegister(request);
  ASSERT_TRUE(same.ok());
  EXPECT_EQ(same->evidence().remark(), "");
  EXPECT_EQ(same->zero_from_part().SerializeAsString(), registration->zero_from_part().SerializeAsString());
}

// What an angle's error does to the region's pose and to the best fit alike is no disagreement; what it does to one of them is.
TEST_F(RegistrationServiceTest, ComparesALocalPoseByWhatItsAnglesDoNotDoToBoth) {
  MountBlade();
  v1::RegisterRequest request = Request(v1::METHOD_LOCAL);
  v1::HoleGroupNeighbourhood& near = *request.mutable_options()->add_regions_in()->mutable_hole_group();
  near.set_group("G2");
  near.set_margin_mm(7);
  double turn_deg = 0;  // standard uncertainty of the pose's turn about B
  const auto uncertainty_um = [&] {
    const v1::Registration registration = Register(request);
    EXPECT_EQ(registration.evidence().outcome(), v1::OUTCOME_CONVERGED) << registration.evidence().remark();
    EXPECT_TRUE(registration.evidence().has_disagreement());
    EXPECT_FALSE(registration.evidence().disagreement().beyond()) << registration.evidence().ShortDebugString();
    EXPECT_EQ(registration.angles_size(), 5);
    turn_deg = std::sqrt(runtime::FromProto("covariance", registration.covariance())->values(0, 0)) / kRadPerDeg;
    return registration.evidence().disagreement().standard_uncertainty_um();
  };
  const double plain_um = uncertainty_um();
  request.set_apply_axis_tables(true);
  // The reversal turns all scans alike as one body: either pose is uncertain by all of 0.05 deg, 17 um at the tip, and their
  // difference by none of it. A five-hundredth of 17 um would add a tenth to the noise's 0.07 um.
  plant_.Characterise(true, std::vector<double>(8, 0.05), std::vector<double>(8, -0.05), 1e-5);
  EXPECT_NEAR(uncertainty_um(), plain_um, 0.1 * plain_um);
  EXPECT_NEAR(turn_deg, 0.05, 0.001);  // and the noise's 0.0006 deg
  EXPECT_GT(plain_um, 0);

  // The first scan does not show the region: its angle's own error moves the best fit only, by a quarter of 0.02 deg.
  const std::map<std::string, ingest::v1::Scan> scans = plant_.ingest.scans;
  const std::map<std::string, std::string> blocks = plant_.ingest.blocks;
  Scan(TrueBlade(), [](const metrology::SurfacePoint& on) { return on.point_mm.z() < 0; });
  for (std::size_t i = 1; i < plant_.scans.size(); ++i) {
    plant_.ingest.scans.at(plant_.scans[i]) = scans.at(plant_.scans[i]);
    plant_.ingest.blocks.at(plant_.scans[i]) = blocks.at(plant_.scans[i]);
  }
  plant_.Characterise(true, std::vector<double>(8, 0), std::vector<double>(8, 0), 1e-5);
  const double without_um = uncertainty_um();
  plant_.Characterise(true, std::vector<double>(8, 0), std::vector<double>(8, 0), 0.02);
  const double with_um = uncertainty_um();
  EXPECT_GT(with_um, 2 * without_um);
  EXPECT_LT(with_um, 8);  // 0.02 deg at the tip: 7 um, all of it
}

// The same machine whose record calls its axes B and C.
TEST_F(RegistrationServiceTest, TakesAnyTwoRotaryAxes) {
  MountBlade();
  plant_.plant.machine.mutable_kinematics()->mutable_part_side(0)->set_axis("B");
  plant_.plant.machine.mutable_kinematics()->mutable_part_side(1)->set_axis("C");
  plant_.calibration.rotation.mutable_rotation()->add_axes("B");
  plant_.calibration.rotation.mutable_rotation()->add_axes("C");
  plant_.Characterise(true, std::vector<double>(8, 0), std::vector<double>(8, 0), 0.001);
  v1::RegisterRequest request = Request(v1::METHOD_BEST_FIT);
  request.set_apply_axis_tables(true);
  const auto registration = TryRegister(request);
  ASSERT_TRUE(registration.ok()) << registration.status();
  EXPECT_LT(ErrorUm(*registration), 0.5);
  ASSERT_EQ(registration->angles_size(), 5);
  EXPECT_EQ(registration->angles(0).axis(), "B");
  EXPECT_EQ(registration->angles(1).axis(), "C");
}

// An axis that nobody characterised and nobody states is not taken to be perfect; one that is characterised is, without its table, as
// uncertain as all that it is off.
TEST_F(RegistrationServiceTest, AnAxisHasATableOrAFigure) {
  MountBlade();
  plant::v1::Joint& b = *plant_.plant.machine.mutable_kinematics()->mutable_part_side(1);
  b.set_positioning_standard_uncertainty_deg(0.01);
  const v1::Registration stated = Register(Request(v1::METHOD_BEST_FIT));
  EXPECT_NEAR(stated.angles(1).standard_uncertainty_deg(), 0.01, 1e-12);
  b.clear_positioning_standard_uncertainty_deg();
  const absl::Status refused = TryRegister(Request(v1::METHOD_BEST_FIT)).status();
  EXPECT_EQ(runtime::ReasonOf(refused), "AXIS_UNCERTAINTY_MISSING");
  EXPECT_THAT(std::string(refused.message()), HasSubstr("machines/m1, axis B: neither a characterisation in force nor "
                                                        "positioning_standard_uncertainty_deg, want one of both"));
  plant_.Characterise(true, std::vector<double>(8, 0), std::vector<double>(8, 0), 0.001);
  plant_.calibration.axes.at("B").mutable_axis()->mutable_standard_uncertainty()->set_value_deg(0.004);
  const v1::Registration characterised = Register(Request(v1::METHOD_BEST_FIT));
  EXPECT_NEAR(characterised.angles(1).standard_uncertainty_deg(), 0.004, 1e-12);
  EXPECT_EQ(characterised.angles(1).characterisation(), "");  // its table was not applied
  auto transaction = plant_.database.database()->Begin(testing::Soon());
  const auto derived = storage::DerivedFrom(*transaction, testing::kBCharacterisation);
  ASSERT_TRUE(derived.ok()) << derived.status();
  EXPECT_EQ(derived->size(), 1u);  // it rests on it all the same
  // Its time is over: the record's figure holds again, where there is one.
  plant_.calibration.axes_over = true;
  EXPECT_EQ(runtime::ReasonOf(TryRegister(Request(v1::METHOD_BEST_FIT)).status()), "CALIBRATION_EXPIRED");
  b.set_positioning_standard_uncertainty_deg(0.01);
  EXPECT_NEAR(Register(Request(v1::METHOD_BEST_FIT)).angles(1).standard_uncertainty_deg(), 0.01, 1e-12);
}

TEST_F(RegistrationServiceTest, AScannerThatAnInterimCheckFoundElsewhereMapsNothingSince) {
  MountBlade();
  for (const std::string& scan : plant_.scans)
    plant_.ingest.scans.at(scan).mutable_received_at()->set_seconds(1'700'000'000);
  calibration::v1::InterimState& interim = *plant_.calibration.sensor.mutable_interim_check();
  interim.set_study("studies/knock");
  interim.set_verdict(calibration::v1::STUDY_VERDICT_REJECTED);
  interim.mutable_stood_until()->set_seconds(1'700'000'000);
  const v1::Registration before = Register(Request(v1::METHOD_BEST_FIT));
  EXPECT_EQ(before.scans_received_at().seconds(), 1'700'000'000);
  EXPECT_EQ(Get(before.name()).scans_received_at().seconds(), 1'700'000'000);
  plant_.ingest.scans.at(plant_.scans[1]).mutable_received_at()->set_seconds(1'700'000'001);
  const absl::Status moved = TryRegister(Request(v1::METHOD_BEST_FIT)).status();
  EXPECT_EQ(runtime::ReasonOf(moved), "SENSOR_MOVED");
  EXPECT_THAT(std::string(moved.message()), HasSubstr("scans[1]: " + std::string(testing::kSensorCalibration)));
  interim.set_verdict(calibration::v1::STUDY_VERDICT_ACCEPTED);
  EXPECT_EQ(Register(Request(v1::METHOD_BEST_FIT)).scans_received_at().seconds(), 1'700'000'001);
}

// A scanner that was mounted anew since maps nothing that came before, unless it is asked to.
TEST_F(RegistrationServiceTest, MapsAScanByTheCalibrationOfThen) {
  MountBlade();
  for (const std::string& scan : plant_.scans)
    plant_.ingest.scans.at(scan).mutable_received_at()->set_seconds(1'700'000'000);
  calibration::v1::Calibration anew = plant_.calibration.sensor;
  anew.set_name("calibrations/00000000-0000-7000-8000-000000000097");
  anew.mutable_sensor()->mutable_t_sm_mm()->set_z_mm(anew.sensor().t_sm_mm().z_mm() + 0.05);
  plant_.Remount(anew, 1'700'000'100);
  const v1::Registration then = Register(Request(v1::METHOD_BEST_FIT));
  EXPECT_EQ(then.sensor_calibration(), testing::kSensorCalibration);
  EXPECT_FALSE(then.sensor_calibration_asked());
  EXPECT_LT(ErrorUm(then), 0.5);

  v1::RegisterRequest request = Request(v1::METHOD_BEST_FIT);
  request.set_sensor_calibration(anew.name());
  const absl::StatusOr<v1::Registration> asked = TryRegister(request);
  ASSERT_TRUE(asked.ok()) << asked.status();
  EXPECT_EQ(asked->sensor_calibration(), anew.name());
  EXPECT_TRUE(asked->sensor_calibration_asked());
  EXPECT_GT(ErrorUm(*asked), 20);  // as mapped by a later mounting
  EXPECT_EQ(Get(asked->name()).SerializeAsString(), asked->SerializeAsString());

  // One scan came after it was mounted anew.
  plant_.ingest.scans.at(plant_.scans[2]).mutable_received_at()->set_seconds(1'700'000'200);
  const std::string mixed = RefusalOf(Request(v1::METHOD_BEST_FIT));
  EXPECT_THAT(mixed, HasSubstr("received when " + anew.name() + " was in force, want scans of one sensor calibration"));
  request.set_sensor_calibration(testing::kSensorCalibration);  // as the first scan's, and not that one's
  const absl::StatusOr<v1::Registration> some = TryRegister(request);
  ASSERT_TRUE(some.ok()) << some.status();
  EXPECT_TRUE(some->sensor_calibration_asked());
  // All came before the machine had any.
  plant_.calibration.in_force_from_s = 1'800'000'000;
  plant_.calibration.remounted.reset();
  request.clear_sensor_calibration();
  const absl::Status none = TryRegister(request).status();
  EXPECT_EQ(runtime::ReasonOf(none), "CALIBRATION_MISSING");
  EXPECT_THAT(std::string(none.message()), HasSubstr("say by which sensor_calibration it is to be mapped"));
  request.set_sensor_calibration(testing::kSensorCalibration);
  const absl::StatusOr<v1::Registration> named = TryRegister(request);
  ASSERT_TRUE(named.ok()) << named.status();
  EXPECT_TRUE(named->sensor_calibration_asked());
  plant_.calibration.sensor.set_state(calibration::v1::CALIBRATION_STATE_DRAFT);
  EXPECT_THAT(RefusalOf(request), HasSubstr(", a draft, want one that was released"));
  plant_.calibration.sensor.set_state(calibration::v1::CALIBRATION_STATE_WITHDRAWN);
  request = Request(v1::METHOD_BEST_FIT);
  request.set_sensor_calibration(testing::kSensorCalibration);
  EXPECT_EQ(runtime::ReasonOf(TryRegister(request).status()), "CALIBRATION_WITHDRAWN");
}

TEST_F(RegistrationServiceTest, ScansThatWereNotTakenAlikeAreNotMerged) {
  MountBlade();
  const auto header = [&](int i) {
    return plant_.ingest.scans.at(plant_.scans[static_cast<std::size_t>(i)]).mutable_header();
  };
  const auto refused = [&] { return RefusalOf(Request(v1::METHOD_BEST_FIT)); };
  for (int i = 0; i < 4; ++i) header(i)->set_clamping("c1");
  const v1::Registration clamped = Register(Request(v1::METHOD_BEST_FIT));
  EXPECT_EQ(clamped.clamping(), "c1");
  v1::RegisterRequest other = Request(v1::METHOD_BEST_FIT);
  other.set_clamping("c2");
  EXPECT_THAT(RefusalOf(other), HasSubstr(".clamping: 'c1', want 'c2', the clamping that was asked for"));
  header(3)->set_clamping("c2");
  EXPECT_THAT(refused(), HasSubstr(".clamping: 'c2', want 'c1', as the first scan"));
  header(3)->set_clamping("c1");

  header(2)->set_travel(ingest::v1::SCAN_TRAVEL_BACKWARD);
  EXPECT_THAT(refused(), HasSubstr(".travel: SCAN_TRAVEL_BACKWARD, want SCAN_TRAVEL_UNSPECIFIED, as the first scan"));
  for (int i = 0; i < 4; ++i) header(i)->set_travel(ingest::v1::SCAN_TRAVEL_BACKWARD);
  plant_.calibration.sensor.mutable_sensor()->set_travel(ingest::v1::SCAN_TRAVEL_FORWARD);
  EXPECT_THAT(refused(), HasSubstr("or encoder_latency_um in the error_sources of machines/m1"));
  plant_.plant.machine.mutable_error_sources()->set_encoder_latency_um(4);
  const v1::Registration backward = Register(Request(v1::METHOD_BEST_FIT));
  EXPECT_EQ(backward.error_sources(2).name(), "encoder's latency, machines/m1");
  EXPECT_NEAR(backward.error_sources(2).parameters_per_sigma().values(3), 4e-3, 1e-12);

  for (int i = 0; i < 4; ++i) header(i)->set_sensor_serial_number("S2");
  plant_.calibration.sensor.mutable_sensor()->set_sensor_serial_number("S1");
  EXPECT_THAT(refused(), HasSubstr(".sensor_serial_number: S2, want S1, the sensor of " +
                                   std::string(testing::kSensorCalibration)));
  plant_.plant.machine.mutable_sensor()->set_kind(plant::v1::SENSOR_KIND_SNAPSHOT);
  EXPECT_EQ(runtime::ReasonOf(TryRegister(Request(v1::METHOD_BEST_FIT)).status()), "SENSOR_UNSUITABLE");
}

// A blade that was scanned warm, and registered at 20 C.
TEST_F(RegistrationServiceTest, TakesAWarmBladeToTwentyDegrees) {
  const double per_k = 12.5e-6, warmer_k = 40;  // half a thousandth: 12 um at the tip
  Design(TrueBlade());
  Scan(TrueBlade(), nullptr,
       [&](const metrology::SurfacePoint& on) -> Eigen::Vector3d { return (1 + per_k * warmer_k) * on.point_mm; });
  const v1::Registration cold = Register(Request(v1::METHOD_BEST_FIT));
  EXPECT_FALSE(cold.has_thermal_stretch());
  const auto refused = [&] { return RefusalOf(Request(v1::METHOD_BEST_FIT)); };
  plant_.ingest.scans.at(plant_.scans[0]).mutable_header()->set_subject_temperature_c(20 + warmer_k);
  EXPECT_THAT(refused(), HasSubstr("parts/p1.thermal_expansion: not given, want the material's"));
  plant_.plant.part.mutable_thermal_expansion()->set_um_per_m_k(12.5);
  plant_.plant.part.mutable_thermal_expansion()->set_standard_uncertainty_um_per_m_k(0.5);
  EXPECT_THAT(refused(), HasSubstr("machines/m1.error_sources.temperature_k: not given"));
  plant::v1::ErrorSources& stated = *plant_.plant.machine.mutable_error_sources();
  stated.set_temperature_k(0.2);
  EXPECT_THAT(refused(), HasSubstr(".subject_temperature_c: not given, want a temperature of all scans, or of none"));
  for (const std::string& scan : plant_.scans)
    plant_.ingest.scans.at(scan).mutable_header()->set_subject_temperature_c(20 + warmer_k);
  const v1::Registration at_20 = Register(Request(v1::METHOD_BEST_FIT));
  EXPECT_NEAR(at_20.thermal_stretch(), 1 + per_k * warmer_k, 1e-12);
  MountBlade();
  for (const std::string& scan : plant_.scans)
    plant_.ingest.scans.at(scan).mutable_header()->clear_subject_temperature_c();
  const v1::Registration true_at_20 = Register(Request(v1::METHOD_BEST_FIT));
  EXPECT_GT(cold.evidence().residual_sigma_um(), 1.1 * true_at_20.evidence().residual_sigma_um());
  EXPECT_NEAR(at_20.evidence().residual_sigma_um(), true_at_20.evidence().residual_sigma_um(), 0.02);
  // The part grew about its own frame, and is taken to have grown about its axis: between both lie 50 mm, 25 um. Its shape is what counts.
  const double across_um =
      1e3 * per_k * warmer_k * (plant_.block.pose.zero_from_part.translation() - plant_.block.axes.b.point_mm).norm();
  EXPECT_NEAR(ErrorUm(at_20), across_um, 0.5);
  std::vector<std::string> names;
  for (const auto& source : at_20.error_sources()) names.push_back(source.name());
  EXPECT_THAT(names, Contains("temperature, machines/m1"));
  EXPECT_THAT(names, Contains("expansion, parts/p1 on machines/m1"));

  stated.mutable_scale_expansion()->set_um_per_m_k(12.5);
  stated.mutable_scale_expansion()->set_standard_uncertainty_um_per_m_k(0.5);
  plant_.ingest.scans.at(plant_.scans[0]).mutable_header()->set_subject_temperature_c(25);
  EXPECT_THAT(refused(), HasSubstr(".scales_temperature_c: not given, want one beside subject_temperature_c"));
  plant_.ingest.scans.at(plant_.scans[0]).mutable_header()->clear_subject_temperature_c();
  // Nobody measured it, and somebody says how far it may be: nothing is taken out, and U says so.
  stated.set_temperature_half_range_k(5);
  const v1::Registration bounded = Register(Request(v1::METHOD_BEST_FIT));
  EXPECT_FALSE(bounded.has_thermal_stretch());
  EXPECT_EQ(bounded.zero_from_part().SerializeAsString(), true_at_20.zero_from_part().SerializeAsString());
  EXPECT_GT(bounded.covariance().values(21), true_at_20.covariance().values(21));
}

// The block's scans show its flat top only.
TEST_F(RegistrationServiceTest, AnUndeterminedPoseIsKeptWithItsEvidenceAndHasNoPose) {
  const auto registration = TryRegister(Request(v1::METHOD_LOCAL));
  ASSERT_TRUE(registration.ok()) << registration.status();
  EXPECT_EQ(registration->evidence().outcome(), v1::OUTCOME_NOT_DETERMINED) << registration->evidence().remark();
  EXPECT_FALSE(registration->has_zero_from_part());
  EXPECT_FALSE(registration->has_covariance());
  EXPECT_THAT(registration->evidence().remark(), HasSubstr("directions free"));
  EXPECT_EQ(Count("registrations WHERE cardinality(zero_from_part) = 0"),
            Count("registrations WHERE outcome <> 'CONVERGED'"));
}

double CountedConverged() { return testing::Exposed("sixpoint_registrations_total{outcome=\"CONVERGED\"}"); }

TEST_F(RegistrationServiceTest, AnswersARetryOnceAndPages) {
  MountBlade();
  const double counted = CountedConverged();
  const std::int64_t before = Count("registrations");
  v1::RegisterRequest request = Request(v1::METHOD_BEST_FIT);
  request.set_request_id("00000000-0000-7000-8000-0000000000aa");
  const auto first = TryRegister(request), second = TryRegister(request);
  ASSERT_TRUE(first.ok() && second.ok()) << first.status() << second.status();
  EXPECT_EQ(first->SerializeAsString(), second->SerializeAsString());
  EXPECT_EQ(Count("registrations"), before + 1);
  EXPECT_EQ(CountedConverged(), counted + 1);
  request.set_method(v1::METHOD_LOCAL);
  EXPECT_EQ(TryRegister(request).status().code(), absl::StatusCode::kAlreadyExists);

  // The same inputs again: another registration, the same bits.
  request.clear_request_id();
  request.set_method(v1::METHOD_BEST_FIT);
  const auto again = TryRegister(request);
  ASSERT_TRUE(again.ok());
  EXPECT_NE(again->name(), first->name());
  EXPECT_EQ(again->zero_from_part().SerializeAsString(), first->zero_from_part().SerializeAsString());
  const auto stub = v1::RegistrationService::NewStub(channel_);
  v1::ListRegistrationsRequest list;
  list.set_blade("blades/sn1");
  list.set_page_size(1);
  v1::ListRegistrationsResponse page, next;
  ASSERT_TRUE(stub->ListRegistrations(runtime::ContextFor(10).get(), list, &page).ok());
  ASSERT_EQ(page.registrations_size(), 1);
  EXPECT_EQ(page.registrations(0).name(), again->name());
  list.set_page_token(page.next_page_token());
  ASSERT_TRUE(stub->ListRegistrations(runtime::ContextFor(10).get(), list, &next).ok());
  EXPECT_EQ(next.registrations(0).name(), first->name());
  EXPECT_TRUE(next.registrations(0).has_zero_from_part());
  EXPECT_FALSE(next.registrations(0).has_covariance());
  EXPECT_EQ(next.registrations(0).evidence().scans_size(), 0);
  list.Clear();
  list.set_view(list::v1::VIEW_FULL);
  list.set_outcome(v1::OUTCOME_CONVERGED);
  list.set_calibration(first->rotation_calibration());
  ASSERT_TRUE(stub->ListRegistrations(runtime::ContextFor(10).get(), list, &page).ok());
  ASSERT_EQ(page.registrations_size(), 2);
  EXPECT_EQ(page.registrations(1).SerializeAsString(), first->SerializeAsString());
  list.set_outcome(v1::OUTCOME_NOT_CONVERGED);
  ASSERT_TRUE(stub->ListRegistrations(runtime::ContextFor(10).get(), list, &page).ok());
  ASSERT_EQ(page.registrations_size(), 1);  // the row that the judged plant begins with
  EXPECT_EQ(page.registrations(0).name(), testing::kRegistration);
}

// Those of inspections are listed, and left out where a blade's own are asked for.
TEST_F(RegistrationServiceTest, TellsWhatInspectionsMadeForThemselves) {
  MountBlade();
  const v1::Registration own = Register(Request(v1::METHOD_BEST_FIT));
  v1::RegisterRequest request = Request(v1::METHOD_BEST_FIT);
  request.set_for_inspection(true);
  const v1::Registration inspections = Register(request);
  EXPECT_FALSE(own.for_inspection());
  EXPECT_TRUE(inspections.for_inspection());
  const auto stub = v1::RegistrationService::NewStub(channel_);
  v1::ListRegistrationsRequest list;
  list.set_blade("blades/sn1");
  list.set_page_size(1);
  v1::ListRegistrationsResponse page;
  ASSERT_TRUE(stub->ListRegistrations(runtime::ContextFor(10).get(), list, &page).ok());
  EXPECT_EQ(page.registrations(0).name(), inspections.name());
  list.set_without_for_inspection(true);
  v1::ListRegistrationsResponse owns;
  ASSERT_TRUE(stub->ListRegistrations(runtime::ContextFor(10).get(), list, &owns).ok());
  ASSERT_EQ(owns.registrations_size(), 1);
  EXPECT_EQ(owns.registrations(0).name(), own.name());
  list.set_page_token(page.next_page_token());  // of the list with them
  EXPECT_EQ(stub->ListRegistrations(runtime::ContextFor(10).get(), list, &owns).error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);
}

TEST_F(RegistrationServiceTest, RefusesWhatItCannotRestOnAndStoresNothing) {
  const std::int64_t before = Count("registrations");
  EXPECT_EQ(runtime::ReasonOf(TryRegister(Request(v1::METHOD_SIX_POINT)).status()), "SIX_POINTS_MISSING");
  v1::RegisterRequest unknown = Request(v1::METHOD_BEST_FIT);
  unknown.set_blade("blades/sn9");
  EXPECT_THAT(std::string(TryRegister(unknown).status().message()), HasSubstr("blade: blades/sn9"));
  unknown = Request(v1::METHOD_BEST_FIT);
  unknown.add_scans("scans/none");
  EXPECT_THAT(std::string(TryRegister(unknown).status().message()), HasSubstr("scans[4]: scans/none"));
  plant_.ingest.scans.at(plant_.scans[1]).mutable_header()->set_subject("blades/sn2");
  EXPECT_THAT(std::string(TryRegister(Request(v1::METHOD_BEST_FIT)).status().message()),
              HasSubstr("subject: blades/sn2, want blades/sn1"));
  plant_.ingest.scans.at(plant_.scans[1]).mutable_header()->set_subject("blades/sn1");
  plant_.calibration.expired = true;
  EXPECT_EQ(TryRegister(Request(v1::METHOD_BEST_FIT)).status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(Count("registrations"), before);
  v1::GetRegistrationRequest get;
  get.set_name("registrations/00000000-0000-7000-8000-000000000077");
  v1::Registration none;
  const auto stub = v1::RegistrationService::NewStub(channel_);
  EXPECT_EQ(stub->GetRegistration(runtime::ContextFor(10).get(), get, &none).error_code(), grpc::StatusCode::NOT_FOUND);
}

}  // namespace
}  // namespace sixpoint::registration
