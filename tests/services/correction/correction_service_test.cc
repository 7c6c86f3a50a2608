#include "services/correction/correction_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "storage/record.h"
#include "tests/services/correction/judged_plant.h"

namespace sixpoint::correction {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class CorrectionServiceTest : public ::testing::Test {
 protected:
  CorrectionServiceTest() { Start(4); }

  void Start(int greatest_count) {
    server_.reset();
    service_ = std::make_unique<CorrectionService>(
        storage::CorrectionsIn(plant_.database.database()), storage::CorrectionEventsIn(plant_.database.database()),
        ShapeStores{storage::ReconstructionsIn(plant_.database.database()),
                    storage::MachiningPassesIn(plant_.database.database()),
                    storage::RepairsIn(plant_.database.database())},
        std::make_unique<clients::BladePeers>(plant_.Connect(), plant_.Connect(), plant_.Connect(), plant_.Connect()),
        runtime::PoolLimits{greatest_count, 0}, 1);
    server_ = std::make_unique<testing::InProcessServer>(std::vector<grpc::Service*>{service_.get()});
    stub_ = v1::CorrectionService::NewStub(server_->Connect());
  }

  absl::StatusOr<v1::Correction> Correct(const v1::CorrectRequest& request) {
    v1::Correction correction;
    const grpc::Status status = stub_->Correct(runtime::ContextFor(30).get(), request, &correction);
    if (!status.ok()) return runtime::FromGrpc(status);
    return correction;
  }
  static v1::CorrectRequest Request() {
    v1::CorrectRequest request;
    request.set_registration(testing::kRegistration);
    return request;
  }
  // A program leaves by Correct and FetchProgram alone.
  static v1::Correction WithoutProgram(v1::Correction correction) {
    correction.clear_nc_program();
    return correction;
  }
  std::int64_t Count(const std::string& table) {
    auto transaction = plant_.database.database()->Begin(testing::Soon());
    return transaction->Execute("SELECT count(*) FROM " + table)->Int(0, 0);
  }

  testing::JudgedPlant plant_;
  std::unique_ptr<CorrectionService> service_;
  std::unique_ptr<testing::InProcessServer> server_;
  std::unique_ptr<v1::CorrectionService::Stub> stub_;
};

TEST_F(CorrectionServiceTest, CorrectsEveryHoleAndReadsBackTheSame) {
  v1::CorrectRequest request = Request();
  request.set_nc_template("G90\nG0 X1 Y2 Z3 A4 B5 (SIXPOINT G1/H1)\nX1 Y2 Z3 (SIXPOINT G1/H2)\n");
  const auto correction = Correct(request);
  ASSERT_TRUE(correction.ok()) << correction.status();
  ASSERT_EQ(correction->groups_size(), 1);
  const v1::CorrectedGroup& group = correction->groups(0);
  ASSERT_EQ(group.holes_size(), 2);
  EXPECT_EQ(group.a_nominal_deg(), plant_.plant.part.hole_groups(0).a_nominal_deg());
  // The axis after the corrected turn points along Z, and the start is where the turned part has it.
  const double deg = 3.14159265358979323846 / 180;
  const Eigen::Isometry3d machine_from_part =
      plant_.block.axes.MachineFromZero(group.a_deg() * deg, group.b_deg() * deg) * plant_.block.pose.zero_from_part;
  EXPECT_LT((machine_from_part.linear() * plant_.block.holes[0].pin.axis - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
  const geometry::v1::Point& start = group.holes(1).start_mm();
  const Eigen::Vector3d want = machine_from_part * plant_.block.holes[1].pin.start_mm;
  EXPECT_LT((Eigen::Vector3d(start.x_mm(), start.y_mm(), start.z_mm()) - want).norm(), 1e-9);
  EXPECT_GT(group.holes(1).expanded_uncertainty_um(), 0.1);
  EXPECT_LT(group.holes(1).expanded_uncertainty_um(), 10);
  EXPECT_EQ(correction->release(), v1::RELEASE_AUTOMATIC);
  char x[32];
  std::snprintf(x, sizeof x, "X%.4f ", start.x_mm());
  EXPECT_THAT(correction->nc_program(), HasSubstr("\n" + std::string(x)));
  EXPECT_EQ(correction->proof().reader_version(), metrology::kNcReaderVersion);
  EXPECT_EQ(correction->proof().pose_count(), 2);
  EXPECT_LT(correction->proof().greatest_difference_um(), 0.2);  // four decimals
  EXPECT_LT(correction->proof().greatest_tilt_deg(), 1e-4);
  // The earlier of the two calibrations' ends.
  EXPECT_EQ(correction->valid_until().seconds(), plant_.calibration.rotation.valid_until().seconds());

  v1::GetCorrectionRequest get;
  get.set_name(correction->name());
  v1::Correction back;
  ASSERT_TRUE(stub_->GetCorrection(runtime::ContextFor(10).get(), get, &back).ok());
  EXPECT_EQ(back.SerializeAsString(), WithoutProgram(*correction).SerializeAsString());

  auto transaction = plant_.database.database()->Begin(testing::Soon());
  const auto derived = storage::DerivedFrom(*transaction, testing::kRotationCalibration);
  ASSERT_TRUE(derived.ok());
  std::vector<std::string> names;
  for (const storage::JournalEntry& journal : *derived) names.push_back(journal.entry.name);
  EXPECT_THAT(names, Contains(correction->name()));
}

TEST_F(CorrectionServiceTest, KeepsWhichMachiningModelItUsed) {
  plant_.plant.AddModel();
  v1::CorrectRequest request = Request();
  request.set_machining_model("machining_models/edm");
  EXPECT_FALSE(Correct(request).ok()) << "a model that the record does not have";
  EXPECT_EQ(Count("corrections"), 0);
  plant_.StoreModel({{"OP10", "G1", 0.4, 40, 1}});
  const auto correction = Correct(request);
  ASSERT_TRUE(correction.ok()) << correction.status();
  EXPECT_EQ(correction->machining_model(), "machining_models/edm@1");
  EXPECT_EQ(correction->state(), v1::CORRECTION_STATE_RELEASED);
  EXPECT_THAT(correction->nc_program(), HasSubstr("G55"));
  v1::GetCorrectionRequest get;
  get.set_name(correction->name());
  v1::Correction back;
  ASSERT_TRUE(stub_->GetCorrection(runtime::ContextFor(10).get(), get, &back).ok());
  EXPECT_EQ(back.SerializeAsString(), WithoutProgram(*correction).SerializeAsString());
  auto transaction = plant_.database.database()->Begin(testing::Soon());
  for (const char* name : {"machining_models/edm", "machining_models/edm@1"}) {
    const auto derived = storage::DerivedFrom(*transaction, name);
    ASSERT_TRUE(derived.ok());
    ASSERT_EQ(derived->size(), 1u);
    EXPECT_EQ(derived->front().entry.name, correction->name());
  }
}

// The control adds what it holds for the code, so it is taken off; what is not stated is not guessed.
TEST_F(CorrectionServiceTest, WritesForTheOffsetsThatAreStated) {
  v1::CorrectRequest request = Request();
  request.set_nc_template("G90 G55\nG0 X1 Y2 Z3 A4 B5 (SIXPOINT G1/H1)\nX1 Y2 Z3 (SIXPOINT G1/H2)\n");
  EXPECT_THAT(std::string(Correct(request).status().message()), HasSubstr("want G55 stated with its offset"));
  v1::WorkOffset& offset = *request.add_work_offsets();
  offset.set_code("G55");
  offset.set_x_mm(100);
  offset.set_b_deg(-1);
  const auto correction = Correct(request);
  ASSERT_TRUE(correction.ok()) << correction.status();
  char words[64];
  std::snprintf(words, sizeof words, "\nX%.4f Y%.4f ", correction->groups(0).holes(1).start_mm().x_mm() - 100,
                correction->groups(0).holes(1).start_mm().y_mm());
  EXPECT_THAT(correction->nc_program(), HasSubstr(words));
  EXPECT_EQ(correction->work_offsets(0).SerializeAsString(), offset.SerializeAsString());
  request.add_work_offsets()->set_code("G55");
  EXPECT_THAT(std::string(Correct(request).status().message()), HasSubstr("work_offsets[1].code: G55, want each once"));
}

// What the registration's angles were taken by commands the angles of the holes.
TEST_F(CorrectionServiceTest, CommandsWhatReachesTheAnglesByTheRegistrationsTables) {
  const auto plain = Correct(Request());
  ASSERT_TRUE(plain.ok()) << plain.status();
  EXPECT_FALSE(plain->groups(0).has_a_reached_deg());
  EXPECT_THAT(plain->axes(), ElementsAre("A", "B"));
  const double mean_deg = 0.05, half_reversal_deg = 0.01;
  plant_.Characterise(true, std::vector<double>(8, mean_deg + half_reversal_deg),
                      std::vector<double>(8, mean_deg - half_reversal_deg), 0.002);
  registration::v1::ScanAngle& angle = *plant_.registration.registration.add_angles();
  angle.set_axis("B");
  angle.set_characterisation(testing::kBCharacterisation);
  angle.set_commanded_deg(20);
  angle.set_reached_deg(20 + mean_deg);
  angle.set_standard_uncertainty_deg(0.002);
  angle.set_half_reversal_deg(half_reversal_deg);
  for (int i = 0; i < 6; ++i) angle.add_pose_per_rad(0);
  {
    auto transaction = plant_.database.database()->Begin(testing::Soon());
    const auto stored = transaction->Execute(
        "INSERT INTO registration_angles (registration_id, position_index, axis, characterisation_id, commanded_deg, "
        "reached_deg, standard_uncertainty_deg, half_reversal_deg, pose_per_rad) "
        "VALUES ($1, 0, 'B', $2, 20, 20.05, 0.002, 0.01, '{0,0,0,0,0,0}')",
        storage::Params()
            .Uuid(std::string(testing::kRegistration).substr(14))
            .Uuid(std::string(testing::kBCharacterisation).substr(13)));
    ASSERT_TRUE(stored.ok()) << stored.status();
    ASSERT_TRUE(transaction->Commit().ok());
  }
  v1::CorrectRequest request = Request();
  request.set_nc_template("G0 A4.000000 B5.000000 X1 Y2 Z3 (SIXPOINT G1/H1)\nX1 Y2 Z3 (SIXPOINT G1/H2)\n");
  const auto correction = Correct(request);
  ASSERT_TRUE(correction.ok()) << correction.status();
  const v1::CorrectedGroup &group = correction->groups(0), &before = plain->groups(0);
  EXPECT_NEAR(group.a_deg(), before.a_deg(), 1e-9);
  EXPECT_NEAR(group.b_deg(), before.b_deg() - mean_deg, 1e-9);
  EXPECT_NEAR(group.b_reached_deg(), before.b_deg(), 1e-9);
  // The part stands where it would, but not as surely.
  EXPECT_NEAR(group.holes(1).start_mm().y_mm(), before.holes(1).start_mm().y_mm(), 1e-9);
  EXPECT_NEAR(group.b_standard_uncertainty_deg(), std::hypot(before.b_standard_uncertainty_deg(), 0.01, 0.002), 1e-9);
  EXPECT_NEAR(group.a_standard_uncertainty_deg(), before.a_standard_uncertainty_deg(), 1e-12);
  // 10 mm off B's axis and 0.01 deg: 1.8 um, and 95 % within twice that.
  EXPECT_GT(group.holes(1).expanded_uncertainty_um(), before.holes(1).expanded_uncertainty_um() + 3);
  EXPECT_THAT(correction->axis_characterisations(), ElementsAre(testing::kBCharacterisation));
  char b[32];
  std::snprintf(b, sizeof b, "B%.6f ", group.b_deg());
  EXPECT_THAT(correction->nc_program(), HasSubstr(b));

  v1::GetCorrectionRequest get;
  get.set_name(correction->name());
  v1::Correction back;
  ASSERT_TRUE(stub_->GetCorrection(runtime::ContextFor(10).get(), get, &back).ok());
  EXPECT_EQ(back.SerializeAsString(), WithoutProgram(*correction).SerializeAsString());
  auto transaction = plant_.database.database()->Begin(testing::Soon());
  const auto derived = storage::DerivedFrom(*transaction, testing::kBCharacterisation);
  ASSERT_TRUE(derived.ok());
  ASSERT_EQ(derived->size(), 1u);
  EXPECT_EQ(derived->front().entry.name, correction->name());
  v1::ListCorrectionsRequest list;
  list.set_calibration(testing::kBCharacterisation);
  v1::ListCorrectionsResponse resting;
  ASSERT_TRUE(stub_->ListCorrections(runtime::ContextFor(10).get(), list, &resting).ok());
  EXPECT_EQ(resting.corrections_size(), 2);  // both of the registration

  // Another table is in force by now, and then none.
  calibration::v1::Calibration used = plant_.calibration.axes.at("B");
  plant_.calibration.axes.at("B").set_name(testing::kACharacterisation);
  plant_.calibration.axes["A"] = used;  // still there by its name
  const absl::Status superseded = Correct(Request()).status();
  EXPECT_EQ(runtime::ReasonOf(superseded), "CALIBRATION_EXPIRED");
  EXPECT_THAT(std::string(superseded.message()),
              HasSubstr("registration.angles.B: " + std::string(testing::kBCharacterisation) + ", superseded by " +
                        testing::kACharacterisation));
  plant_.calibration.axes.erase("B");
  EXPECT_THAT(std::string(Correct(Request()).status().message()), HasSubstr("none in force"));
}

// The same machine whose record calls its axes B and C.
TEST_F(CorrectionServiceTest, WritesTheMachinesOwnLetters) {
  const auto plain = Correct(Request());
  ASSERT_TRUE(plain.ok()) << plain.status();
  plant_.plant.machine.mutable_kinematics()->mutable_part_side(0)->set_axis("B");
  plant_.plant.machine.mutable_kinematics()->mutable_part_side(1)->set_axis("C");
  const absl::Status other = Correct(Request()).status();
  EXPECT_EQ(runtime::ReasonOf(other), "KINEMATICS_UNSUPPORTED");
  EXPECT_THAT(std::string(other.message()), HasSubstr(".axes: A, B, want B, C as machines/m1 has them now"));
  plant_.calibration.rotation.mutable_rotation()->add_axes("B");
  plant_.calibration.rotation.mutable_rotation()->add_axes("C");
  v1::CorrectRequest request = Request();
  request.set_nc_template("G0 B1.0000 C2.0000 X1 Y2 Z3 (SIXPOINT G1/H1)\nX1 Y2 Z3 (SIXPOINT G1/H2)\n");
  const auto correction = Correct(request);
  ASSERT_TRUE(correction.ok()) << correction.status();
  EXPECT_THAT(correction->axes(), ElementsAre("B", "C"));
  EXPECT_EQ(correction->groups(0).a_deg(), plain->groups(0).a_deg());
  char want[64];
  std::snprintf(want, sizeof want, "G0 B%.4f C%.4f X", correction->groups(0).a_deg(), correction->groups(0).b_deg());
  EXPECT_THAT(correction->nc_program(), StartsWith(want));
  plant_.plant.machine.mutable_safety_envelope()->set_rotation_deg(1e-6);
  const auto waiting = Correct(request);
  ASSERT_TRUE(waiting.ok()) << waiting.status();
  EXPECT_THAT(waiting->release_reasons(0), StartsWith("AXIS_CHANGE of "));
  v1::GetCorrectionRequest get;
  get.set_name(correction->name());
  v1::Correction back;
  ASSERT_TRUE(stub_->GetCorrection(runtime::ContextFor(10).get(), get, &back).ok());
  EXPECT_EQ(back.SerializeAsString(), WithoutProgram(*correction).SerializeAsString());

  plant_.plant.machine.mutable_kinematics()->mutable_part_side()->RemoveLast();
  const absl::Status one = Correct(request).status();
  EXPECT_EQ(runtime::ReasonOf(one), "KINEMATICS_UNSUPPORTED");
  EXPECT_THAT(std::string(one.message()), HasSubstr("1 rotary joints on the part's side"));
}

TEST_F(CorrectionServiceTest, AnswersARetryOnce) {
  v1::CorrectRequest request = Request();
  request.set_request_id("00000000-0000-7000-8000-0000000000aa");
  const auto first = Correct(request), second = Correct(request);
  ASSERT_TRUE(first.ok() && second.ok()) << first.status() << second.status();
  EXPECT_EQ(first->name(), second->name());
  EXPECT_EQ(Count("corrections"), 1);
  request.add_groups("another");
  EXPECT_EQ(Correct(request).status().code(), absl::StatusCode::kAlreadyExists);
}

TEST_F(CorrectionServiceTest, RefusesWhatItCannotRestOnAndStoresNothing) {
  plant_.registration.registration.mutable_evidence()->set_outcome(registration::v1::OUTCOME_NOT_CONVERGED);
  EXPECT_EQ(runtime::ReasonOf(Correct(Request()).status()), "REGISTRATION_NOT_CONVERGED");
  plant_.registration.registration.mutable_evidence()->set_outcome(registration::v1::OUTCOME_CONVERGED);

  // The axes drill now: those that the pose was found with have to be in force still.
  plant_.calibration.rotation.set_name("calibrations/00000000-0000-7000-8000-000000000099");
  const absl::Status superseded = Correct(Request()).status();
  EXPECT_EQ(superseded.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(runtime::ReasonOf(superseded), "CALIBRATION_EXPIRED");
  EXPECT_THAT(std::string(superseded.message()), HasSubstr("superseded by"));
  plant_.calibration.rotation.set_name(testing::kRotationCalibration);

  // The scan was mapped then: a scanner that was mounted anew since has moved no blade. One whose time is over is refused.
  plant_.calibration.replacement = "calibrations/00000000-0000-7000-8000-000000000098";
  EXPECT_TRUE(Correct(Request()).ok());
  const auto valid_until = plant_.calibration.sensor.valid_until();
  plant_.calibration.sensor.mutable_valid_until()->set_seconds(1'000'000'000);
  EXPECT_EQ(runtime::ReasonOf(Correct(Request()).status()), "CALIBRATION_EXPIRED");
  *plant_.calibration.sensor.mutable_valid_until() = valid_until;
  plant_.calibration.replacement.clear();

  // The older one is in force again; the registration rests on the one that was withdrawn.
  plant_.calibration.replacement = "calibrations/00000000-0000-7000-8000-000000000098";
  plant_.calibration.sensor.set_state(calibration::v1::CALIBRATION_STATE_WITHDRAWN);
  plant_.calibration.sensor.mutable_withdrawal()->set_reason("sensor was knocked");
  const absl::Status withdrawn = Correct(Request()).status();
  EXPECT_EQ(withdrawn.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(runtime::ReasonOf(withdrawn), "CALIBRATION_WITHDRAWN");
  EXPECT_THAT(std::string(withdrawn.message()), HasSubstr("(sensor was knocked), want a registration that rests on"));
  plant_.calibration.replacement.clear();
  plant_.calibration.sensor.clear_state();
  plant_.calibration.sensor.clear_withdrawal();

  plant_.calibration.expired = true;
  EXPECT_EQ(Correct(Request()).status().code(), absl::StatusCode::kFailedPrecondition);
  plant_.calibration.expired = false;

  v1::CorrectRequest unknown = Request();
  unknown.add_groups("G9");
  EXPECT_THAT(std::string(Correct(unknown).status().message()),
              HasSubstr("groups[0]: G9, want a hole group of parts/p1 (G1)"));
  v1::CorrectRequest bad_template = Request();
  bad_template.set_nc_template("G90\nX#1 (SIXPOINT G1/H1)\n");
  const absl::Status refused = Correct(bad_template).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(refused.message()), HasSubstr("nc_template: line 2"));
  // The angles stand in a block that nothing marks: the holes would be drilled where they are and not as they point.
  v1::CorrectRequest half = Request();
  half.set_nc_template("G90\nG0 A4 B5\nX1 Y2 Z3 (SIXPOINT G1/H1)\nX1 Y2 Z3 (SIXPOINT G1/H2)\n");
  EXPECT_THAT(std::string(Correct(half).status().message()),
              HasSubstr("nc_template: G1/H1 is left before all axes were at it"));
  v1::CorrectRequest missing = Request();
  missing.set_registration("registrations/00000000-0000-7000-8000-000000000077");
  EXPECT_EQ(Correct(missing).status().code(), absl::StatusCode::kNotFound);

  for (plant::v1::Joint& joint : *plant_.plant.machine.mutable_kinematics()->mutable_part_side()) {
    joint.set_minimum(-1);
    joint.set_maximum(1);
  }
  EXPECT_EQ(runtime::ReasonOf(Correct(Request()).status()), "POSE_OUT_OF_LIMITS");
  EXPECT_EQ(Count("corrections"), 1);  // that by a sensor calibration of then
  EXPECT_EQ(Count("record_entries WHERE kind = 'correction'"), 1);
}

TEST_F(CorrectionServiceTest, WaitsForAPersonBeyondTheEnvelope) {
  plant_.plant.machine.mutable_safety_envelope()->set_translation_mm(0.1);
  v1::CorrectRequest request = Request();
  request.set_nc_template("G0 A4 B5 X1 Y2 Z3 (SIXPOINT G1/H1)\nX1 Y2 Z3 (SIXPOINT G1/H2)\n");
  const auto correction = Correct(request);
  ASSERT_TRUE(correction.ok()) << correction.status();
  EXPECT_EQ(correction->release(), v1::RELEASE_AWAITING_PERSON);
  EXPECT_EQ(correction->nc_program(), "");
  ASSERT_GE(correction->release_reasons_size(), 1);
  EXPECT_THAT(correction->release_reasons(0),
              ::testing::MatchesRegex("START_SHIFT of G1/H[12]: 0\\.[0-9]+ mm, want at most 0\\.1 mm; 2 do not pass"));
}

TEST_F(CorrectionServiceTest, ListsByBladeNewestFirstPageByPage) {
  std::vector<std::string> made;
  for (int i = 0; i < 3; ++i) made.insert(made.begin(), Correct(Request())->name());
  v1::ListCorrectionsRequest request;
  request.set_blade("blades/sn1");
  request.set_page_size(2);
  std::vector<std::string> listed;
  do {
    v1::ListCorrectionsResponse response;
    ASSERT_TRUE(stub_->ListCorrections(runtime::ContextFor(10).get(), request, &response).ok());
    for (const v1::Correction& correction : response.corrections()) {
      EXPECT_EQ(correction.groups_size(), 0);
      listed.push_back(correction.name());
    }
    request.set_page_token(response.next_page_token());
  } while (!request.page_token().empty());
  EXPECT_EQ(listed, made);
  const auto count = [&](const v1::ListCorrectionsRequest& of) {
    v1::ListCorrectionsResponse response;
    EXPECT_TRUE(stub_->ListCorrections(runtime::ContextFor(10).get(), of, &response).ok());
    return response.corrections_size();
  };
  request.set_blade("blades/other");
  EXPECT_EQ(count(request), 0);
  request.Clear();
  request.set_view(list::v1::VIEW_FULL);
  v1::ListCorrectionsResponse full;
  ASSERT_TRUE(stub_->ListCorrections(runtime::ContextFor(10).get(), request, &full).ok());
  ASSERT_EQ(full.corrections_size(), 3);
  EXPECT_EQ(full.corrections(0).groups(0).holes_size(), 2);
  for (const bool other : {false, true}) {
    request.Clear();
    request.set_machine(other ? "machines/m9" : full.corrections(0).machine());
    EXPECT_EQ(count(request), other ? 0 : 3);
    request.Clear();
    request.set_calibration(other ? "calibrations/c9" : full.corrections(0).rotation_calibration());
    EXPECT_EQ(count(request), other ? 0 : 3);
    request.Clear();
    request.set_release(other ? v1::RELEASE_AWAITING_PERSON : v1::RELEASE_AUTOMATIC);
    EXPECT_EQ(count(request), other ? 0 : 3);
  }
  request.Clear();
  *request.mutable_recorded()->mutable_until() = full.corrections(0).recorded_at();
  EXPECT_EQ(count(request), 2);
}

TEST_F(CorrectionServiceTest, RefusesMoreThanItsSlots) {
  Start(0);
  const absl::Status status = Correct(Request()).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(runtime::ReasonOf(status), "CORRECTIONS_FULL");
}

}  // namespace
}  // namespace sixpoint::correction
