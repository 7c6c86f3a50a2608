// The handlers on a fake store: no PostgreSQL.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <utility>

#include "services/correction/correction_service.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "tests/services/correction/stand_ins.h"
#include "tests/support/fake_results.h"
#include "tests/support/some_uuid.h"

namespace sixpoint::correction {
namespace {

using sixpoint::testing::kSomeUuid;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using Store = testing::FakeResults<storage::CorrectionRow, storage::CorrectionFilter>;

// Of corrections to which nothing happens.
class NoEvents final : public storage::CorrectionEventStore {
 public:
  absl::StatusOr<storage::CorrectionRow> Decide(const storage::RecordedRequest&, const storage::CorrectionDecision&,
                                                storage::Deadline) override {
    return absl::UnimplementedError("not here");
  }
  absl::StatusOr<storage::CorrectionRow> ReportCut(const storage::RecordedRequest&, const storage::CutReport&,
                                                   storage::Deadline) override {
    return absl::UnimplementedError("not here");
  }
  absl::StatusOr<std::optional<storage::ProgramFetchRow>> FindFetch(const storage::RecordedRequest&,
                                                                    storage::Deadline) const override {
    return std::nullopt;
  }
  absl::StatusOr<storage::ProgramFetchRow> RecordFetch(const storage::RecordedRequest&, const storage::ProgramFetchRow&,
                                                       const storage::CorrectionCheck&, storage::Deadline) override {
    return absl::UnimplementedError("not here");
  }
  absl::StatusOr<std::vector<storage::CutHoleRow>> CutHoles(const std::string&, storage::Deadline) const override {
    return cut;
  }
  absl::StatusOr<std::optional<std::string>> ScrappedBy(const std::string&, storage::Deadline) const override {
    return scrapped_by;
  }
  absl::StatusOr<std::string> TemplateOf(const storage::CorrectionRow& row, storage::Deadline) const override {
    return row.nc_template;
  }
  absl::StatusOr<std::optional<std::string>> ScrappedAgainst(const std::string&, storage::Deadline) const override {
    return scrapped_against;
  }
  std::vector<storage::CutHoleRow> cut;
  std::optional<std::string> scrapped_by, scrapped_against;
};

class CorrectionHandlersTest : public ::testing::Test {
 protected:
  absl::StatusOr<v1::Correction> Correct(const v1::CorrectRequest& request) {
    v1::Correction correction;
    const grpc::Status status = stub_->Correct(runtime::ContextFor(30).get(), request, &correction);
    if (!status.ok()) return runtime::FromGrpc(status);
    return correction;
  }
  static v1::CorrectRequest Request(const std::string& request_id = "") {
    v1::CorrectRequest request;
    request.set_registration(testing::kRegistration);
    request.set_request_id(request_id);
    return request;
  }

  static calibration::v1::Study Checked(const std::string& clamping, double limit_um) {
    calibration::v1::Study study;
    study.set_verdict(calibration::v1::STUDY_VERDICT_ACCEPTED);
    study.mutable_interim_check()->set_sensor_calibration(testing::kSensorCalibration);
    study.mutable_interim_check()->set_clamping(clamping);
    study.mutable_interim_check()->set_limit_um(limit_um);
    return study;
  }

  testing::StandIns plant_;
  std::shared_ptr<Store> store_ =
      std::make_shared<Store>(&storage::CorrectionRow::correction_id,
                              [](const storage::CorrectionRow& row, const storage::CorrectionFilter& filter) {
                                return filter.blade_serial.empty() || row.blade_serial == filter.blade_serial;
                              });
  std::shared_ptr<NoEvents> events_ = std::make_shared<NoEvents>();
  CorrectionService service_{
      store_,
      events_,
      {},  // no test names a shape
      std::make_unique<clients::BladePeers>(plant_.Connect(), plant_.Connect(), plant_.Connect(), plant_.Connect()),
      {4, 0},
      1};
  testing::InProcessServer server_{{&service_}};
  std::unique_ptr<v1::CorrectionService::Stub> stub_ = v1::CorrectionService::NewStub(server_.Connect());
};

TEST_F(CorrectionHandlersTest, RecordsWhatItRestsOnWithTheAnswer) {
  v1::CorrectRequest request = Request();
  request.set_nc_template("G90\nG0 X1 Y2 Z3 A4 B5 (SIXPOINT G1/H1)\nX1 Y2 Z3 (SIXPOINT G1/H2)\n");
  const auto correction = Correct(request);
  ASSERT_TRUE(correction.ok()) << correction.status();
  ASSERT_EQ(store_->rows().size(), 1u);
  const storage::CorrectionRow row = store_->rows().front();
  EXPECT_EQ(correction->name(), "corrections/" + row.correction_id);
  EXPECT_EQ(row.nc_template, request.nc_template());
  EXPECT_EQ(row.nc_program, correction->nc_program());
  EXPECT_NE(row.nc_program, "");
  EXPECT_THAT(row.requested_by, ::testing::StartsWith("ipv4:127.0.0.1:"));  // no certificate
  const storage::RecordEntry entry = store_->entries().front();
  EXPECT_EQ(entry.name, correction->name());
  EXPECT_THAT(entry.inputs, ElementsAre(testing::kRegistration, "machines/m1@1", "parts/p1@1",
                                        testing::kSensorCalibration, testing::kRotationCalibration));
}

TEST_F(CorrectionHandlersTest, ARetryGetsTheKeptAnswerEvenWhereTheWorldHasChanged) {
  const auto first = Correct(Request(kSomeUuid));
  ASSERT_TRUE(first.ok()) << first.status();
  plant_.calibration.expired = true;
  const auto again = Correct(Request(kSomeUuid));
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->SerializeAsString(), first->SerializeAsString());
  EXPECT_EQ(store_->rows().size(), 1u);
  v1::CorrectRequest other = Request(kSomeUuid);
  other.add_groups("G1");
  EXPECT_EQ(Correct(other).status().code(), absl::StatusCode::kAlreadyExists);
}

TEST_F(CorrectionHandlersTest, ADryRunSaysAllAndRecordsNothing) {
  v1::CorrectRequest request = Request(kSomeUuid);
  request.set_nc_template("G90\nG0 X1 Y2 Z3 A4 B5 (SIXPOINT G1/H1)\nX1 Y2 Z3 (SIXPOINT G1/H2)\n");
  request.set_dry_run(true);
  const auto dry = Correct(request);
  ASSERT_TRUE(dry.ok()) << dry.status();
  EXPECT_EQ(dry->name(), "");
  EXPECT_EQ(dry->nc_program(), "");
  EXPECT_EQ(dry->state(), v1::CORRECTION_STATE_UNSPECIFIED);
  EXPECT_EQ(dry->release(), v1::RELEASE_AUTOMATIC);
  EXPECT_EQ(dry->proof().pose_count(), 2);
  EXPECT_TRUE(store_->rows().empty());
  request.set_dry_run(false);
  const auto real = Correct(request);
  ASSERT_TRUE(real.ok()) << real.status();
  EXPECT_EQ(real->groups(0).SerializeAsString(), dry->groups(0).SerializeAsString());
}

// For a machine that waits: one call, one registration however often it asks.
TEST_F(CorrectionHandlersTest, ScansAreRegisteredAndCorrectedInOneCall) {
  v1::CorrectScansRequest request;
  request.set_request_id(kSomeUuid);
  request.mutable_registration()->set_blade("blades/SN-1");
  request.mutable_registration()->add_scans("scans/a");
  request.mutable_registration()->set_method(registration::v1::METHOD_LOCAL);
  request.mutable_correction()->set_nc_template("G90\nG0 X1 Y2 Z3 A4 B5 (SIXPOINT G1/H1)\nX1 Y2 Z3 (SIXPOINT G1/H2)\n");
  v1::Correction first, again;
  ASSERT_TRUE(stub_->CorrectScans(runtime::ContextFor(30).get(), request, &first).ok());
  ASSERT_EQ(plant_.registration.asked.size(), 1u);
  const registration::v1::RegisterRequest& asked = plant_.registration.asked.front();
  EXPECT_EQ(asked.request_id(), kSomeUuid);
  EXPECT_EQ(asked.scans(0), "scans/a");
  EXPECT_EQ(asked.method(), registration::v1::METHOD_LOCAL);
  EXPECT_EQ(first.registration(), testing::kRegistration);
  EXPECT_NE(first.nc_program(), "");
  ASSERT_TRUE(stub_->CorrectScans(runtime::ContextFor(30).get(), request, &again).ok());
  EXPECT_EQ(again.name(), first.name());
  EXPECT_EQ(again.nc_program(), "");  // which leaves a second time by FetchProgram
  EXPECT_EQ(store_->rows().size(), 1u);
}

TEST_F(CorrectionHandlersTest, WhatRegistrationRefusesIsRefusedByItsField) {
  v1::CorrectScansRequest request;
  request.set_request_id(kSomeUuid);
  plant_.registration.refusal = Refuse("scans", "none", "1 to 64");
  v1::Correction correction;
  const absl::Status refused =
      runtime::FromGrpc(stub_->CorrectScans(runtime::ContextFor(30).get(), request, &correction));
  EXPECT_THAT(ViolationsOf(refused), ElementsAre(Violation{"registration.scans", "none", "1 to 64"}));
  EXPECT_TRUE(store_->rows().empty());
}

TEST_F(CorrectionHandlersTest, WhatFollowsFromTheCallIsNotSaidInIt) {
  v1::CorrectScansRequest request;
  request.set_request_id(kSomeUuid);
  request.mutable_registration()->set_request_id(kSomeUuid);
  request.mutable_registration()->set_for_inspection(true);
  request.mutable_correction()->set_registration(testing::kRegistration);
  request.mutable_correction()->set_request_id(kSomeUuid);
  request.mutable_correction()->set_dry_run(true);
  request.mutable_correction()->add_groups("");
  v1::Correction correction;
  const absl::Status refused =
      runtime::FromGrpc(stub_->CorrectScans(runtime::ContextFor(30).get(), request, &correction));
  std::vector<std::string> fields;
  for (const Violation& violation : ViolationsOf(refused)) fields.push_back(violation.field);
  EXPECT_THAT(fields, ElementsAre("registration.request_id", "registration.for_inspection", "correction.registration",
                                  "correction.request_id", "correction.dry_run", "correction.groups[0]"));
  EXPECT_TRUE(plant_.registration.asked.empty());
}

// One thing wrong at a time: the gate names it, with its numbers, and no program leaves.
TEST_F(CorrectionHandlersTest, WhatSpeaksAgainstAReleaseIsNamedAndWaits) {
  v1::CorrectRequest request = Request();
  request.set_nc_template("G90\nG0 X1 Y2 Z3 A4 B5 (SIXPOINT G1/H1)\nX1 Y2 Z3 (SIXPOINT G1/H2)\n");
  const auto clean = Correct(request);
  ASSERT_TRUE(clean.ok()) << clean.status();
  EXPECT_EQ(clean->state(), v1::CORRECTION_STATE_RELEASED);
  EXPECT_NE(clean->nc_program(), "");
  EXPECT_EQ(clean->program_sha256().size(), 64u);
  EXPECT_EQ(clean->checks_size(), 13);  // no linear axes, no keep-out
  const registration::v1::Registration sound = plant_.registration.registration;
  const plant::v1::Machine machine = plant_.plant.machine;
  const plant::v1::Part part = plant_.plant.part;
  registration::v1::Registration& now = plant_.registration.registration;
  registration::v1::Registration later = sound;
  later.set_record_sequence(2);
  const auto envelope = [this] { return plant_.plant.machine.mutable_safety_envelope(); };
  const auto evidence = [&now] { return now.mutable_evidence(); };
  const auto says = [this](registration::v1::Registration one) { plant_.registration.later = {std::move(one)}; };
  const std::vector<std::pair<std::string, std::function<void()>>> wrong = {
      {"START_SHIFT of G1/H", [&] { envelope()->set_translation_mm(0); }},
      {"AXIS_CHANGE of ", [&] { envelope()->set_rotation_deg(0); }},
      {"START_UNCERTAINTY of G1/H", [&] { plant_.plant.part.mutable_hole_groups(0)->set_position_tolerance_mm(1e-5); }},
      {"DISAGREEMENT: 4.2, want at most 4.1", [&] { evidence()->mutable_disagreement()->set_ratio(4.2); }},
      {"DISAGREEMENT: not known", [&] { evidence()->clear_disagreement(); }},
      {"MERGE: 20, want at most 16.3", [&] { evidence()->mutable_merge()->set_chi_squared(20); }},
      {"MERGE: not known", [&] { evidence()->mutable_merge()->set_freedom(0); }},
      {"MERGE: not known", [&] { evidence()->clear_merge(); }},
      {"CONDITION: 150, want at most 100", [&] { evidence()->set_condition_number(150); }},
      {"CONDITION: not known", [&] { evidence()->clear_condition_number(); }},
      {"INFORMATION: 0.4, want at least 0.5", [&] { evidence()->set_information_kept(0.4); }},
      {"INFORMATION: not known", [&] { evidence()->clear_information_kept(); }},
      {"HELD_DIRECTIONS: 5, want at most 0",
       [&] { now.mutable_options()->add_degrees_of_freedom(registration::v1::FREEDOM_SHIFT_X); }},
      {"HELD_DIRECTIONS: 2, want at most 0",  // the turns; of shifts somebody said how far off they may be
       [&] {
         for (const auto free : {registration::v1::FREEDOM_TURN_X, registration::v1::FREEDOM_SHIFT_X})
           now.mutable_options()->add_degrees_of_freedom(free);
         now.mutable_options()->set_held_shift_standard_uncertainty_um(5);
       }},
      {"REGISTRATION_AGE: ", [&] { now.mutable_recorded_at()->set_seconds(now.recorded_at().seconds() - 9 * 3600); }},
      {"REGISTRATION_AGE: ", [&] { envelope()->set_registration_age_h(0); }},
      {"CLAMPING of registrations/other: 1, want at most 0",
       [&] {
         later.set_name("registrations/other");
         later.set_blade("blades/sn2");
         says(later);
       }},
      {"SENSOR_CALIBRATION of " + std::string(testing::kSensorCalibration) + ": 1, want at most 0",
       [&] { plant_.registration.registration.set_sensor_calibration_asked(true); }},
      {"INTERIM_CHECK of a clamping that is not stated: 1, want at most 0",
       [&] { envelope()->set_interim_check_limit_um(20); }},
      {"INTERIM_CHECK of clamping c1: 1, want at most 0",
       [&] {
         envelope()->set_interim_check_limit_um(20);
         now.set_clamping("c1");
       }},
      {"INTERIM_CHECK of clamping c1: 1, want at most 0",  // there was one, by a limit of its own
       [&] {
         envelope()->set_interim_check_limit_um(20);
         now.set_clamping("c1");
         plant_.studies.interim_check = Checked("c1", 30);
       }},
      {"CUT_BEFORE of G1/H2: 1, want at most 0",
       [&] {
         events_->cut = {{"another", {"G1", "H2"}}};
       }},
      {"SCRAPPED of dispositions/d1: 1, want at most 0", [&] { events_->scrapped_by = "dispositions/d1"; }},
  };
  for (const auto& [reason, spoil] : wrong) {
    SCOPED_TRACE(reason);
    spoil();
    const auto waiting = Correct(request);
    ASSERT_TRUE(waiting.ok()) << waiting.status();
    EXPECT_EQ(waiting->release(), v1::RELEASE_AWAITING_PERSON);
    EXPECT_EQ(waiting->state(), v1::CORRECTION_STATE_DRAFT);
    EXPECT_EQ(waiting->nc_program(), "");
    EXPECT_EQ(store_->rows().back().nc_program, "");
    EXPECT_EQ(store_->rows().back().nc_held, store_->rows().front().nc_program);  // proven, and held
    ASSERT_EQ(waiting->release_reasons_size(), 1) << waiting->ShortDebugString();
    EXPECT_THAT(waiting->release_reasons(0), ::testing::StartsWith(reason));
    now = sound;
    plant_.plant.machine = machine;
    plant_.plant.part = part;
    plant_.registration.later.clear();
    plant_.studies.interim_check.reset();
    events_->cut.clear();
    events_->scrapped_by.reset();
  }
}

TEST_F(CorrectionHandlersTest, AMachiningModelSaysWhatIsMachinedAndIsRecorded) {
  plant_.plant.AddModel();
  plant_.plant.machine.mutable_safety_envelope()->set_keep_out_mm(0.05);
  v1::CorrectRequest request = Request();
  request.set_machining_model("machining_models/edm");
  const auto correction = Correct(request);
  ASSERT_TRUE(correction.ok()) << correction.status();
  EXPECT_EQ(correction->machining_model(), "machining_models/edm@1");
  EXPECT_EQ(correction->work_offsets(0).x_mm(), 1.5);
  EXPECT_EQ(correction->proof().pose_count(), 2);
  const storage::CorrectionRow row = store_->rows().front();
  EXPECT_EQ(row.machining_model_id, "edm");
  EXPECT_EQ(row.machining_model_revision, 1);
  EXPECT_EQ(row.nc_template, plant_.plant.models["machining_models/edm@1"].nc_template());
  EXPECT_THAT(store_->entries().front().inputs, ::testing::Contains("machining_models/edm@1"));
  // Beside a plane, inclined or not: where the electrode leaves its mouth (metrology/correction/tool_cylinder.h).
  const v1::ReleaseCheck& check = correction->checks(correction->checks_size() - 1);
  EXPECT_EQ(check.kind(), v1::RELEASE_CHECK_KIND_TOOL_CYLINDER);
  const double radius_mm = plant_.plant.part.hole_groups(0).diameter_mm() / 2;
  EXPECT_NEAR(check.value(), 1.25 * (radius_mm + 0.05) - radius_mm, 1e-6);
  EXPECT_EQ(check.limit(), 0.05);
  EXPECT_TRUE(check.passed());
  // The same template without its model: nobody looked at the electrodes, and a person decides.
  v1::CorrectRequest plain = Request();
  plain.set_nc_template("G90\nG0 X1 Y2 Z3 A4 B5 (SIXPOINT G1/H1)\nX1 Y2 Z3 (SIXPOINT G1/H2)\n");
  const auto without = Correct(plain);
  ASSERT_TRUE(without.ok()) << without.status();
  EXPECT_EQ(without->machining_model(), "");
  ASSERT_EQ(without->checks_size(), correction->checks_size());
  const v1::ReleaseCheck& not_named = without->checks(without->checks_size() - 1);
  EXPECT_EQ(not_named.kind(), v1::RELEASE_CHECK_KIND_MODEL_NOT_NAMED);
  EXPECT_EQ(not_named.subject(), "machining_models/edm");
  EXPECT_FALSE(not_named.passed());
  EXPECT_EQ(without->release(), v1::RELEASE_AWAITING_PERSON);
  EXPECT_EQ(without->nc_program(), "");
  // Nor is it asked of a part without one.
  plant_.plant.models.clear();
  plain.set_request_id(storage::NewUuid());
  EXPECT_EQ(Correct(plain)->checks_size(), correction->checks_size() - 1);
}

TEST_F(CorrectionHandlersTest, AModelIsRefusedThatIsNotForThisBladeOrMachine) {
  plant_.plant.AddModel();
  plant::v1::MachiningModel& model = plant_.plant.models["machining_models/edm"];
  const plant::v1::MachiningModel sound = model;
  v1::CorrectRequest request = Request();
  request.set_machining_model("machining_models/edm");
  const auto refusal = [&] { return std::string(Correct(request).status().message()); };
  model.set_part("parts/p2");
  EXPECT_THAT(refusal(),
              HasSubstr("machining_model: machining_models/edm@1 of parts/p2, want a machining model of parts/p1"));
  model = sound;
  model.set_w_mm(10);
  EXPECT_THAT(refusal(), HasSubstr("machining_model.w_mm: 10, want a model that states none"));
  plant::v1::Joint& w = *plant_.plant.machine.mutable_kinematics()->add_tool_side();
  w.set_axis("W");
  w.set_kind(plant::v1::JOINT_KIND_LINEAR);
  w.mutable_direction()->set_z(1);
  w.set_sign(1);
  w.set_minimum(-5);
  w.set_maximum(5);
  EXPECT_THAT(refusal(), HasSubstr("machining_model.w_mm: 10, want -5 to 5"));
  plant_.plant.machine.mutable_kinematics()->clear_tool_side();
  model = sound;
  model.mutable_operations(0)->mutable_electrode()->set_diameter_mm(99);
  EXPECT_THAT(refusal(), HasSubstr("machining_model.operations[0].electrode.diameter_mm: 99, want at most"));
  model = sound;
  model.mutable_operations(0)->mutable_electrode()->set_wear_mm(39.9);
  EXPECT_THAT(refusal(), HasSubstr("machining_model.operations[0].electrode.length_mm: 40, want at least"));
  model = sound;
  plant::v1::MachiningOperation& second = *model.add_operations();
  second = model.operations(0);
  second.set_hole_group("G2");
  request.add_groups("G1");
  EXPECT_THAT(refusal(), HasSubstr("groups: 1 of them, want none, or all of machining_models/edm@1 (G1, G2)"));
  request.clear_groups();
  model = sound;
  request.add_groups("G7");
  EXPECT_THAT(refusal(), HasSubstr("groups[0]: G7, want a hole group or path of machining_models/edm@1 (G1)"));
  request.clear_groups();
  request.set_machining_model("machining_models/edm@9");
  EXPECT_EQ(Correct(request).status().code(), absl::StatusCode::kNotFound);
  EXPECT_TRUE(store_->rows().empty());
}

TEST_F(CorrectionHandlersTest, AProgramDoesNotLeaveWhoseBladeWasScrappedMeanwhile) {
  v1::CorrectRequest request = Request();
  request.set_nc_template("G90\nG0 X1 Y2 Z3 A4 B5 (SIXPOINT G1/H1)\nX1 Y2 Z3 (SIXPOINT G1/H2)\n");
  EXPECT_NE(Correct(request)->nc_program(), "");
  events_->scrapped_against = "dispositions/d1";  // while it was computed: the gate was not told
  const auto correction = Correct(request);
  ASSERT_TRUE(correction.ok()) << correction.status();
  EXPECT_EQ(correction->release(), v1::RELEASE_AUTOMATIC);
  EXPECT_EQ(correction->nc_program(), "");
}

TEST_F(CorrectionHandlersTest, AnAcceptedCheckInTheClampingIsWhatTheMachinesRecordAsksFor) {
  plant_.plant.machine.mutable_safety_envelope()->set_interim_check_limit_um(20);
  plant_.registration.registration.set_clamping("c1");
  plant_.studies.interim_check = Checked("c1", 20);
  const auto correction = Correct(Request());
  ASSERT_TRUE(correction.ok()) << correction.status();
  EXPECT_EQ(correction->release(), v1::RELEASE_AUTOMATIC);
  EXPECT_EQ(correction->checks_size(), 14);
  EXPECT_EQ(correction->checks(13).kind(), v1::RELEASE_CHECK_KIND_INTERIM_CHECK);
}

TEST_F(CorrectionHandlersTest, WhatIsHeldWithAnUncertaintyIsReleased) {
  registration::v1::FitOptions& options = *plant_.registration.registration.mutable_options();
  options.add_degrees_of_freedom(registration::v1::FREEDOM_SHIFT_X);
  options.set_held_shift_standard_uncertainty_um(5);
  options.set_held_turn_standard_uncertainty_deg(0.01);
  EXPECT_EQ(Correct(Request())->release(), v1::RELEASE_AUTOMATIC);
}

// A knock stays: only what an accepted check came after is known to be right.
TEST_F(CorrectionHandlersTest, AScannerThatAnInterimCheckFoundElsewhereCorrectsNothing) {
  calibration::v1::InterimState& interim = *plant_.calibration.sensor.mutable_interim_check();
  interim.set_study("studies/knock");
  registration::v1::Registration& registration = plant_.registration.registration;
  registration.mutable_scans_received_at()->set_seconds(1'700'000'000);
  interim.set_verdict(calibration::v1::STUDY_VERDICT_ACCEPTED);
  EXPECT_TRUE(Correct(Request()).ok());
  for (const auto verdict : {calibration::v1::STUDY_VERDICT_REJECTED, calibration::v1::STUDY_VERDICT_UNDECIDABLE}) {
    interim.clear_stood_until();
    interim.set_verdict(verdict);
    const absl::Status moved = Correct(Request()).status();
    EXPECT_EQ(runtime::ReasonOf(moved), "SENSOR_MOVED");
    EXPECT_THAT(std::string(moved.message()),
                HasSubstr("registration.sensor_calibration: " + std::string(testing::kSensorCalibration) +
                          ", whose newest interim check (studies/knock) did not find the scanner where it was"));
    interim.mutable_stood_until()->set_seconds(1'699'999'999);  // before the scans
    EXPECT_EQ(runtime::ReasonOf(Correct(Request()).status()), "SENSOR_MOVED");
    interim.mutable_stood_until()->set_seconds(1'700'000'000);
    EXPECT_TRUE(Correct(Request()).ok());
  }
  registration.clear_scans_received_at();  // made before it was kept
  EXPECT_EQ(runtime::ReasonOf(Correct(Request()).status()), "SENSOR_MOVED");
}

TEST_F(CorrectionHandlersTest, HalfOfAZonesDiameterIsWhatAStartMayBeOff) {
  plant::v1::HoleGroup& group = *plant_.plant.part.mutable_hole_groups(0);
  group.set_position_tolerance_mm(0.08);
  const auto limit_um = [&](plant::v1::PositionZone zone) {
    group.set_position_zone(zone);
    const auto correction = Correct(Request());
    EXPECT_TRUE(correction.ok()) << correction.status();
    for (const v1::ReleaseCheck& check : correction->checks())
      if (check.kind() == v1::RELEASE_CHECK_KIND_START_UNCERTAINTY) return check.limit();
    return 0.0;
  };
  EXPECT_EQ(limit_um(plant::v1::POSITION_ZONE_RADIUS), 80);
  EXPECT_EQ(limit_um(plant::v1::POSITION_ZONE_DIAMETER), 40);
  EXPECT_EQ(limit_um(plant::v1::POSITION_ZONE_UNSPECIFIED), 40);  // of a plant of the release before
}

TEST_F(CorrectionHandlersTest, AnotherClampingSpeaksAgainstThisOne) {
  registration::v1::Registration& now = plant_.registration.registration;
  registration::v1::Registration later = now;
  later.set_record_sequence(2);
  const auto waits = [&](const std::string& clamping, const std::string& blade, const std::string& machine,
                         const std::string& later_clamping) {
    now.set_clamping(clamping);
    later.set_blade(blade);
    later.set_machine(machine);
    later.set_clamping(later_clamping);
    plant_.registration.later = {later};
    const auto correction = Correct(Request());
    EXPECT_TRUE(correction.ok()) << correction.status();
    return correction.ok() && correction->state() == v1::CORRECTION_STATE_DRAFT;
  };
  const std::string blade = now.blade(), machine = now.machine();
  EXPECT_FALSE(waits("", blade, machine, ""));  // measured again
  EXPECT_FALSE(waits("7", blade, machine, "7"));
  EXPECT_FALSE(waits("7", blade, machine, ""));
  EXPECT_TRUE(waits("7", blade, machine, "8"));
  EXPECT_TRUE(waits("7", "blades/sn2", machine, "8"));
  EXPECT_TRUE(waits("", "blades/sn2", machine, ""));
  EXPECT_TRUE(waits("7", "blades/sn2", machine, "7"));  // another blade in the same clamping: swapped
  EXPECT_TRUE(waits("7", "blades/sn2", machine, ""));
  EXPECT_TRUE(waits("7", blade, "machines/m2", "9"));
}

TEST_F(CorrectionHandlersTest, NothingIsRecordedOfWhatIsRefusedOrFails) {
  v1::CorrectRequest request = Request();
  request.add_groups("G9");
  EXPECT_THAT(std::string(Correct(request).status().message()),
              HasSubstr("groups[0]: G9, want a hole group of parts/p1"));
  plant_.calibration.expired = true;
  EXPECT_EQ(Correct(Request()).status().code(), absl::StatusCode::kFailedPrecondition);
  plant_.calibration.expired = false;
  store_->Fail(absl::UnavailableError("database: away"));
  EXPECT_EQ(Correct(Request(kSomeUuid)).status().code(), absl::StatusCode::kUnavailable);
  EXPECT_TRUE(store_->rows().empty());
}

TEST_F(CorrectionHandlersTest, ListsByPagesNewestFirst) {
  std::vector<std::string> names;
  for (int i = 0; i < 3; ++i) names.push_back(Correct(Request())->name());
  v1::ListCorrectionsRequest request;
  request.set_page_size(2);
  v1::ListCorrectionsResponse page;
  ASSERT_TRUE(stub_->ListCorrections(runtime::ContextFor(5).get(), request, &page).ok());
  ASSERT_EQ(page.corrections_size(), 2);
  EXPECT_EQ(page.corrections(0).name(), names[2]);
  request.set_page_token(page.next_page_token());
  v1::ListCorrectionsResponse last;
  ASSERT_TRUE(stub_->ListCorrections(runtime::ContextFor(5).get(), request, &last).ok());
  ASSERT_EQ(last.corrections_size(), 1);
  EXPECT_EQ(last.corrections(0).name(), names[0]);
  EXPECT_EQ(last.next_page_token(), "");
  request.set_blade("blades/other");
  EXPECT_EQ(stub_->ListCorrections(runtime::ContextFor(5).get(), request, &page).error_code(),
            grpc::StatusCode::INVALID_ARGUMENT);  // a token of other filters
}

TEST_F(CorrectionHandlersTest, NamesWhatItDoesNotKnow) {
  v1::GetCorrectionRequest get;
  get.set_name(std::string("corrections/") + kSomeUuid);
  v1::Correction correction;
  const grpc::Status status = stub_->GetCorrection(runtime::ContextFor(5).get(), get, &correction);
  EXPECT_EQ(runtime::ReasonOf(runtime::FromGrpc(status)), "CORRECTION_NOT_FOUND");
}

}  // namespace
}  // namespace sixpoint::correction
