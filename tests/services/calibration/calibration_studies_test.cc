// Studies that look at calibrations, on calibrations that the service itself made.
#include <gmock/gmock.h>

#include "metrology/statistics/spread.h"
#include "services/calibration/study_service.h"
#include "tests/services/calibration/calibration_bench.h"
#include "tests/support/sanitizer.h"

namespace sixpoint::calibration {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class CalibrationStudiesTest : public CalibrationBench {
 protected:
  CalibrationStudiesTest()
      : studies_(storage::StudiesIn(database_.database()), storage::CalibrationsIn(database_.database()),
                 plant_server_.Connect(), ingest_server_.Connect()),
        studies_server_({&studies_}),
        studies_stub_(v1::StudyService::NewStub(studies_server_.Connect())) {}

  template <typename Request>
  absl::StatusOr<v1::Study> Run(grpc::Status (v1::StudyService::Stub::*method)(grpc::ClientContext*, const Request&,
                                                                               v1::Study*),
                                const Request& request) {
    v1::Study study;
    const grpc::Status status =
        (studies_stub_.get()->*method)(runtime::ContextFor(sixpoint::testing::kPatience * 60).get(), request, &study);
    if (!status.ok()) return runtime::FromGrpc(status);
    return study;
  }

  v1::Calibration Calibrate(bool draft) {
    v1::CalibrateSensorRequest request = SensorRequest();
    request.set_draft(draft);
    v1::Calibration made;
    const grpc::Status status = Call(&v1::CalibrationService::Stub::CalibrateSensor, request, &made);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return made;
  }

  // The artefact as seen after the arm has swung away and back: t_sm off by 4 um in each axis, one sigma.
  v1::RunArmStudyRequest ArmScans(int count, std::vector<Eigen::Vector3d>* displacements_mm) {
    std::mt19937_64 random(8);
    std::normal_distribution<double> normal(0, 4e-3);
    v1::RunArmStudyRequest request;
    ArtefactBench displaced = bench_;
    for (int i = 0; i < count; ++i) {
      Eigen::Vector3d d(normal(random), normal(random), normal(random));
      if (i == 0) d.setZero();
      displaced.sensor.t_sm_mm = bench_.sensor.t_sm_mm + d;
      displacements_mm->push_back(d);
      const std::string id = "arm" + std::to_string(i);
      AddScan(displaced.Scan(id, 0, 2e-3, &random));
      request.add_scans("scans/" + id);
    }
    return request;
  }

  std::int64_t CountOfStudies() { return Execute("SELECT count(*) FROM studies").Int(0, 0); }

  StudyService studies_;
  testing::InProcessServer studies_server_;
  std::unique_ptr<v1::StudyService::Stub> studies_stub_;
};

// Where the arm stands on the mean of its swings, and how the calibration follows each of them.
TEST_F(CalibrationStudiesTest, ACalibrationOverSeveralSwingsStatesTheirMean) {
  std::vector<Eigen::Vector3d> truth_mm;
  v1::RunArmStudyRequest study = ArmScans(7, &truth_mm);
  study.set_request_id(storage::NewUuid());
  Calibrate(false);
  ingest_.kind = ingest::v1::SCAN_KIND_ARM;
  ASSERT_TRUE(Run(&v1::StudyService::Stub::RunArmStudy, study).ok());

  v1::CalibrateSensorRequest request = SensorRequest();
  Eigen::Vector3d mean_mm = Eigen::Vector3d::Zero();
  ingest_.arm_series = {{"scans/high", "c"}, {"scans/low", "c"}};
  for (std::size_t i = 0; i < truth_mm.size(); ++i) {
    const std::string id = "arm" + std::to_string(i);
    request.add_scans("scans/" + id);
    ingest_.arm_series["scans/" + id] = id;
    mean_mm += truth_mm[i] / 8;  // of seven, and of the calibration's own, which stood at zero
  }
  v1::Calibration made;
  const grpc::Status status = Call(&v1::CalibrationService::Stub::CalibrateSensor, request, &made);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(made.sensor().arm_series(), "");
  ASSERT_EQ(made.sensor().arm_shares_size(), 8);
  EXPECT_EQ(made.sensor().arm_shares(0).arm_series(), "c");
  for (int k = 0; k < 6; ++k) {
    double sum = 0;
    for (const v1::ArmShare& share : made.sensor().arm_shares()) sum += share.response().values(7 * k);
    EXPECT_NEAR(sum, 1, 1e-9) << k;
  }
  for (const v1::ArmShare& share : made.sensor().arm_shares())
    EXPECT_NEAR(share.response().values(35), 0.125, 0.02) << share.arm_series();
  v1::Calibration alone = Calibrate(true);
  EXPECT_EQ(alone.sensor().arm_series(), "c");
  EXPECT_TRUE(alone.sensor().arm_shares().empty());
  // Against the same artefact, touched once: what the seven scans add is the mean's place.
  const auto& with = made.sensor().t_sm_mm();
  const auto& of_one = alone.sensor().t_sm_mm();
  EXPECT_NEAR(with.x_mm() - of_one.x_mm(), mean_mm.x(), 5e-4);
  EXPECT_NEAR(with.y_mm() - of_one.y_mm(), mean_mm.y(), 5e-4);
  EXPECT_NEAR(with.z_mm() - of_one.z_mm(), mean_mm.z(), 5e-4);
  EXPECT_EQ(StateOf(made.name()).sensor().SerializeAsString(), made.sensor().SerializeAsString());  // as it was kept
  // A scan that does not say its series: all count as of one swing, as before.
  ingest_.arm_series.erase("scans/arm3");
  request.set_request_id(storage::NewUuid());
  v1::Calibration together;
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CalibrateSensor, request, &together).ok());
  EXPECT_TRUE(together.sensor().arm_shares().empty());
}

// What the machine's record states of its scanner's field is looked for, taken off, and kept.
TEST_F(CalibrationStudiesTest, AStatedFieldIsMeasuredAndKept) {
  EXPECT_TRUE(Calibrate(true).sensor().field_terms_um().empty());
  plant_.scanner_field_um = 3;
  for (auto& [name, scan] : ingest_.scans)
    for (Eigen::Vector3d& p : scan.points_mm) p.z() += 4e-3 * std::cos(p.y() / 5);
  const v1::Calibration made = Calibrate(true);
  ASSERT_EQ(made.sensor().field_terms_um_size(), 9);
  EXPECT_GT(std::abs(made.sensor().field_terms_um(2)), 0.5);  // yy
  EXPECT_EQ(made.sensor().field_stated_um(), 3);
  EXPECT_LT(made.sensor().field_left_um(), 3);
  EXPECT_EQ(made.sensor().field_covariance_um2().row_count(), 9);
  EXPECT_EQ(StateOf(made.name()).sensor().SerializeAsString(), made.sensor().SerializeAsString());
}

TEST_F(CalibrationStudiesTest, AnArmStudyFindsTheDisplacementsAndRestsOnTheCalibration) {
  std::vector<Eigen::Vector3d> truth_mm;
  v1::RunArmStudyRequest request = ArmScans(7, &truth_mm);
  request.set_request_id(storage::NewUuid());
  ingest_.kind = ingest::v1::SCAN_KIND_ARM;
  const absl::Status without = Run(&v1::StudyService::Stub::RunArmStudy, request).status();
  EXPECT_EQ(runtime::ReasonOf(without), "CALIBRATION_MISSING");
  EXPECT_THAT(std::string(without.message()), HasSubstr("no sensor calibration in force, want one"));

  const v1::Calibration calibration = Calibrate(false);
  const auto made = Run(&v1::StudyService::Stub::RunArmStudy, request);
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(made->kind(), v1::STUDY_KIND_ARM);
  EXPECT_EQ(made->machine(), "machines/m1");
  EXPECT_EQ(made->verdict(), v1::STUDY_VERDICT_REPORTED);
  EXPECT_THAT(made->requested_by(), ::testing::StartsWith("ipv4:127.0.0.1:"));  // no door, no certificate
  EXPECT_THAT(made->inputs(), ElementsAre("machines/m1@3", "artefacts/a1@2", "scans/arm0", "scans/arm1", "scans/arm2",
                                          "scans/arm3", "scans/arm4", "scans/arm5", "scans/arm6", calibration.name()));
  const v1::ArmStudy& arm = made->arm();
  EXPECT_EQ(arm.sensor_calibration(), calibration.name());
  ASSERT_EQ(arm.displacements_size(), 7);
  for (int i = 0; i < 7; ++i) {
    // 100 000 points of 2 um and Draco's 0.25 um: a translation to well below 1 um.
    EXPECT_NEAR(arm.displacements(i).dx_mm(), truth_mm[static_cast<std::size_t>(i)].x(), 1e-3) << i;
    EXPECT_NEAR(arm.displacements(i).dy_mm(), truth_mm[static_cast<std::size_t>(i)].y(), 1e-3) << i;
    EXPECT_NEAR(arm.displacements(i).dz_mm(), truth_mm[static_cast<std::size_t>(i)].z(), 1e-3) << i;
  }
  // The spread is of the six displacements; the first scan's, against itself, is none.
  ASSERT_EQ(arm.spreads_size(), 6);
  EXPECT_EQ(arm.spreads(2).quantity(), "dz");
  EXPECT_EQ(arm.spreads(2).count(), 6);
  std::vector<double> dz_mm;
  for (int i = 1; i < 7; ++i) dz_mm.push_back(arm.displacements(i).dz_mm());
  EXPECT_EQ(arm.spreads(2).standard_deviation(), metrology::SpreadOf(dz_mm).standard_deviation);
  EXPECT_GT(arm.spreads(2).stated_standard_uncertainty(), 0);
  EXPECT_LT(arm.spreads(2).stated_standard_uncertainty(), 1e-3);

  const auto again = Run(&v1::StudyService::Stub::RunArmStudy, request);  // a retry
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->SerializeAsString(), made->SerializeAsString());
  v1::GetStudyRequest get;
  get.set_name(made->name());
  EXPECT_EQ(Run(&v1::StudyService::Stub::GetStudy, get)->SerializeAsString(), made->SerializeAsString());
  EXPECT_EQ(CountOfStudies(), 1);

  // Against a limit, with 4 um there: 100 um hold it, 0.1 um do not.
  request.clear_request_id();
  request.set_limit_um(100);
  EXPECT_EQ(Run(&v1::StudyService::Stub::RunArmStudy, request)->verdict(), v1::STUDY_VERDICT_ACCEPTED);
  request.set_limit_um(0.1);
  EXPECT_EQ(Run(&v1::StudyService::Stub::RunArmStudy, request)->verdict(), v1::STUDY_VERDICT_REJECTED);

  // Whoever withdraws the calibration is told.
  v1::WithdrawCalibrationRequest withdraw;
  withdraw.set_name(calibration.name());
  withdraw.set_reason("sensor was knocked");
  const auto withdrawn = Withdraw(withdraw);
  ASSERT_TRUE(withdrawn.ok()) << withdrawn.status();
  ASSERT_EQ(withdrawn->resting_size(), 3);
  EXPECT_EQ(withdrawn->resting(0).name(), made->name());
  EXPECT_EQ(withdrawn->resting(0).kind(), "study");
}

// The artefact as seen by a sensor that stands so much off, at both heights of the calibration.
class InterimCheckTest : public CalibrationStudiesTest {
 protected:
  v1::RunInterimCheckRequest Scans(const std::string& id, const Eigen::Vector3d& knock_mm) {
    std::mt19937_64 random(17);
    ArtefactBench knocked = bench_;
    knocked.sensor.t_sm_mm += knock_mm;
    v1::RunInterimCheckRequest request;
    request.set_machine("machines/m1");
    for (const double height : {10.0, -10.0}) {
      const std::string scan = id + (height > 0 ? "_high" : "_low");
      AddScan(knocked.Scan(scan, height, 2e-3, &random));
      request.add_scans("scans/" + scan);
    }
    return request;
  }
  absl::StatusOr<v1::Study> Check(const v1::RunInterimCheckRequest& request) {
    return Run(&v1::StudyService::Stub::RunInterimCheck, request);
  }
  static std::string MessageOf(const absl::StatusOr<v1::Study>& study) { return std::string(study.status().message()); }
};

TEST_F(InterimCheckTest, AKnockIsFoundKeptAndSaidWithTheCalibration) {
  const Eigen::Vector3d knock_mm(0.01, -0.02, 0.02);  // 30 um
  v1::RunInterimCheckRequest good = Scans("good", Eigen::Vector3d::Zero()), bad = Scans("bad", knock_mm);
  EXPECT_EQ(runtime::ReasonOf(Check(good).status()), "CALIBRATION_MISSING");
  const v1::Calibration calibration = Calibrate(false);
  EXPECT_FALSE(StateOf(calibration.name()).has_interim_check());

  ingest_.clamping = "clamp-7";
  const auto reported = Check(good);
  ASSERT_TRUE(reported.ok()) << reported.status();
  EXPECT_EQ(reported->verdict(), v1::STUDY_VERDICT_REPORTED);
  EXPECT_FALSE(StateOf(calibration.name()).has_interim_check());  // it judged nothing

  good.set_limit_um(20);
  good.set_request_id(storage::NewUuid());
  const auto accepted = Check(good);
  ASSERT_TRUE(accepted.ok()) << accepted.status();
  EXPECT_EQ(accepted->verdict(), v1::STUDY_VERDICT_ACCEPTED);
  EXPECT_EQ(accepted->kind(), v1::STUDY_KIND_INTERIM_CHECK);
  EXPECT_EQ(Check(good)->SerializeAsString(), accepted->SerializeAsString());  // a retry
  const v1::InterimCheck& check = accepted->interim_check();
  EXPECT_EQ(check.sensor_calibration(), calibration.name());
  EXPECT_EQ(check.clamping(), "clamp-7");
  EXPECT_EQ(check.scanned_at().seconds(), ingest_.received_s);
  EXPECT_EQ(check.limit_um(), 20);
  EXPECT_EQ(check.places_size(), 5);
  EXPECT_EQ(check.swing_count(), 1);  // nobody says that it was not
  EXPECT_EQ(check.arm_study(), "");   // nor how far it goes
  EXPECT_THAT(accepted->inputs(), ElementsAre("machines/m1@3", "artefacts/a1@2", "scans/good_high", "scans/good_low",
                                              calibration.name(), "scans/high", "scans/low"));
  EXPECT_EQ(StateOf(calibration.name()).interim_check().study(), accepted->name());
  EXPECT_EQ(StateOf(calibration.name()).interim_check().stood_until().seconds(), ingest_.received_s);

  bad.set_limit_um(20);
  const std::int64_t before_s = ingest_.received_s;
  ingest_.received_s += 300;
  ingest_.clamping = "clamp-8";
  const auto rejected = Check(bad);
  ASSERT_TRUE(rejected.ok()) << rejected.status();
  EXPECT_EQ(rejected->verdict(), v1::STUDY_VERDICT_REJECTED);
  EXPECT_NEAR(rejected->interim_check().dx_mm(), knock_mm.x(), 1e-3);
  EXPECT_NEAR(rejected->interim_check().dy_mm(), knock_mm.y(), 1e-3);
  EXPECT_NEAR(rejected->interim_check().dz_mm(), knock_mm.z(), 1e-3);
  EXPECT_NEAR(rejected->interim_check().places(0).distance_um(), 30, 1);
  const v1::InterimState state = StateOf(calibration.name()).interim_check();
  EXPECT_EQ(state.study(), rejected->name());
  EXPECT_EQ(state.verdict(), v1::STUDY_VERDICT_REJECTED);
  EXPECT_EQ(state.stood_until().seconds(), before_s);
  const auto fetched = client_.Sensor(calibration.name(), runtime::ContextFor(20));
  google::protobuf::Timestamp when;
  when.set_seconds(before_s);
  EXPECT_TRUE(clients::CalibrationClient::CheckNotMoved("x", *fetched, when).ok());
  when.set_seconds(before_s + 1);
  EXPECT_EQ(runtime::ReasonOf(clients::CalibrationClient::CheckNotMoved("x", *fetched, when)), "SENSOR_MOVED");

  // Neither a looser limit nor older scans make it good.
  bad.set_limit_um(1000);
  EXPECT_EQ(Check(bad)->verdict(), v1::STUDY_VERDICT_ACCEPTED);
  EXPECT_EQ(StateOf(calibration.name()).interim_check().study(), rejected->name());
  EXPECT_EQ(StateOf(calibration.name()).interim_check().stood_until().seconds(), before_s);
  ingest_.received_s = before_s;
  good.clear_request_id();
  EXPECT_EQ(Check(good)->verdict(), v1::STUDY_VERDICT_ACCEPTED);
  EXPECT_EQ(StateOf(calibration.name()).interim_check().study(), rejected->name());
  // Later ones do: it was a soiled artefact.
  ingest_.received_s = before_s + 400;
  ingest_.clamping = "clamp-9";
  const auto cleared = Check(good);
  EXPECT_EQ(StateOf(calibration.name()).interim_check().study(), cleared->name());
  EXPECT_EQ(StateOf(calibration.name()).interim_check().verdict(), v1::STUDY_VERDICT_ACCEPTED);
  EXPECT_EQ(StateOf(calibration.name()).interim_check().stood_until().seconds(), before_s + 400);

  const auto count = [&](const std::string& of, const std::string& clamping) {
    v1::ListStudiesRequest list;
    list.set_sensor_calibration(of);
    list.set_clamping(clamping);
    v1::ListStudiesResponse found;
    EXPECT_TRUE(studies_stub_->ListStudies(runtime::ContextFor(20).get(), list, &found).ok());
    return found.studies_size();
  };
  EXPECT_EQ(count("", ""), 6);
  EXPECT_EQ(count(calibration.name(), ""), 6);
  EXPECT_EQ(count(calibration.name(), "clamp-8"), 3);
  EXPECT_EQ(count("", "clamp-7"), 2);
  EXPECT_EQ(count("calibrations/00000000-0000-7000-8000-000000000001", ""), 0);
}

TEST_F(InterimCheckTest, WhatDoesNotGoTogetherIsRefused) {
  v1::RunInterimCheckRequest request = Scans("good", Eigen::Vector3d::Zero());
  const v1::Calibration calibration = Calibrate(false);
  const auto changed = [&](auto change) {
    v1::RunInterimCheckRequest other = request;
    change(&other);
    return MessageOf(Check(other));
  };
  EXPECT_EQ(changed([](auto* r) { r->set_limit_um(-1); }),
            "limit_um: -1, want > 0 and at most 1000, or 0 for the machine's");
  EXPECT_THAT(changed([](auto* r) { r->set_limit_um(NAN); }), HasSubstr("limit_um: NaN, want > 0"));
  EXPECT_THAT(changed([](auto* r) { r->clear_scans(); }), HasSubstr("scans: 0 scans, want at least 1"));
  EXPECT_THAT(changed([](auto* r) { r->set_machine("machines/m2"); }), HasSubstr("want scans of machines/m2"));
  EXPECT_THAT(changed([](auto* r) { r->set_sensor_calibration("calibrations/x"); }), HasSubstr("sensor_calibration"));
  EXPECT_THAT(changed([](auto* r) { r->add_scans("scans/low"); }), HasSubstr("was made from, want scans made since"));
  plant_.interim_check_limit_um = 15;
  EXPECT_EQ(changed([](auto* r) { r->set_limit_um(20); }), "limit_um: 20, want at most 15, as machines/m1 has it");
  EXPECT_EQ(Check(request)->interim_check().limit_um(), 15);
  ingest_.subject = "artefacts/a2";
  EXPECT_FALSE(Check(request).ok());
  ingest_.subject = "artefacts/a1";
  // Scans of which one says that it was made in another series of the arm: two swings, and nothing of how far they go.
  ingest_.arm_series = {{"scans/good_high", "s1"}, {"scans/good_low", "s2"}};
  EXPECT_EQ(Check(request)->interim_check().swing_count(), 2);
  v1::WithdrawCalibrationRequest withdraw;
  withdraw.set_name(calibration.name());
  withdraw.set_reason("knocked");
  ASSERT_TRUE(Withdraw(withdraw).ok());
  request.set_sensor_calibration(calibration.name());
  EXPECT_EQ(runtime::ReasonOf(Check(request).status()), "CALIBRATION_WITHDRAWN");
}

TEST_F(CalibrationStudiesTest, ADraftNamedByHandWillDoForAnArmStudy) {
  std::vector<Eigen::Vector3d> truth_mm;
  v1::RunArmStudyRequest request = ArmScans(5, &truth_mm);
  const v1::Calibration draft = Calibrate(true);
  ingest_.kind = ingest::v1::SCAN_KIND_ARM;
  request.set_sensor_calibration(draft.name());
  const auto made = Run(&v1::StudyService::Stub::RunArmStudy, request);
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(made->arm().sensor_calibration(), draft.name());
  v1::Calibration rotation;
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CalibrateRotation, RotationRequest(), &rotation).ok());
  request.set_sensor_calibration(rotation.name());
  EXPECT_THAT(std::string(Run(&v1::StudyService::Stub::RunArmStudy, request).status().message()),
              HasSubstr("want a sensor calibration of machines/m1"));
}

TEST_F(CalibrationStudiesTest, ARepeatStudyHasTheSpreadOfEveryParameter) {
  v1::RunRepeatStudyRequest request;
  std::vector<v1::Calibration> calibrations;
  std::vector<double> t_sm_z_mm, stated_mm;
  for (unsigned seed = 0; seed < 4; ++seed) {
    std::mt19937_64 random(20 + seed);
    ingest_.scans["scans/high"] = bench_.Scan("high", 10, 2e-3, &random);
    ingest_.scans["scans/low"] = bench_.Scan("low", -10, 2e-3, &random);
    touch_ = bench_.Touch(bench_.touch_noise_mm, &random);
    calibrations.push_back(Calibrate(true));
    request.add_calibrations(calibrations.back().name());
    t_sm_z_mm.push_back(calibrations.back().sensor().t_sm_mm().z_mm());
    stated_mm.push_back(calibrations.back().sensor().t_sm_standard_uncertainty_mm().z_mm());
  }
  request.set_request_id(storage::NewUuid());
  const auto made = Run(&v1::StudyService::Stub::RunRepeatStudy, request);
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(made->kind(), v1::STUDY_KIND_REPEAT);
  EXPECT_EQ(made->verdict(), v1::STUDY_VERDICT_REPORTED);
  EXPECT_EQ(made->machine(), "machines/m1");
  EXPECT_THAT(made->inputs(), ElementsAre(calibrations[0].name(), calibrations[1].name(), calibrations[2].name(),
                                          calibrations[3].name()));
  ASSERT_EQ(made->repeat().parameters_size(), 6);
  const v1::Spread& z = made->repeat().parameters(5);
  const metrology::Spread wanted = metrology::SpreadOf(t_sm_z_mm);
  EXPECT_EQ(z.quantity(), "T_sm z");
  EXPECT_EQ(z.unit(), "mm");
  EXPECT_EQ(z.count(), 4);
  EXPECT_EQ(z.mean(), wanted.mean);
  EXPECT_EQ(z.standard_deviation(), wanted.standard_deviation);
  double squares = 0;  // where residuals show more than was stated, a repeat says more than the others
  for (const double stated : stated_mm) squares += stated * stated;
  EXPECT_NEAR(z.stated_standard_uncertainty(), std::sqrt(squares / 4), 1e-12);
  // Four independent repeats scatter as their own uncertainty says: chi squared of 3 within 0.1 % to 99.9 %.
  const double ratio = z.standard_deviation() / z.stated_standard_uncertainty();
  EXPECT_GT(3 * ratio * ratio, 0.024);
  EXPECT_LT(3 * ratio * ratio, 16.3);
  // Three cones and three slots.
  EXPECT_EQ(made->repeat().centre_errors_size(), 6);
  EXPECT_EQ(made->repeat().centre_errors(0).unit(), "um");
  EXPECT_EQ(Run(&v1::StudyService::Stub::RunRepeatStudy, request)->SerializeAsString(), made->SerializeAsString());
  EXPECT_EQ(CountOfStudies(), 1);

  request.clear_request_id();
  request.mutable_calibrations()->RemoveLast();
  v1::Calibration rotation;
  ASSERT_TRUE(Call(&v1::CalibrationService::Stub::CalibrateRotation, RotationRequest(), &rotation).ok());
  request.add_calibrations(rotation.name());
  EXPECT_THAT(std::string(Run(&v1::StudyService::Stub::RunRepeatStudy, request).status().message()),
              HasSubstr("calibrations[3]: " + rotation.name() + " of kind rotation, want sensor calibrations"));
  EXPECT_EQ(CountOfStudies(), 1);
}

}  // namespace
}  // namespace sixpoint::calibration
