// What becomes of a correction: released or refused by a person, fetched, cut, superseded, withdrawn, expired.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "services/correction/correction_service.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "storage/blobs.h"
#include "storage/record.h"
#include "tests/services/correction/judged_plant.h"

namespace sixpoint::correction {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;
using ::testing::Not;

constexpr char kTemplate[] =
    "G90 G21\nG0 Z50\nA4 B5 X1 Y2 (SIXPOINT G1/H1)\nG1 Z3 F200 (SIXPOINT G1/H1)\nM62 P1\nG4 P0.2\nM63 P1\n"
    "G0 Z50\nA4 B5 X1 Y2 (SIXPOINT G1/H2)\nG1 Z3 F200 (SIXPOINT G1/H2)\nM62 P1\nG4 P0.2\nM63 P1\nG0 Z50\nM30\n";

class ReleaseTest : public ::testing::Test {
 protected:
  // What the record says of a correction, sooner, is what the view of states says: after every test, of all that it made.
  void TearDown() override {
    auto transaction = plant_.database.database()->Begin(testing::Soon());
    ASSERT_TRUE(transaction.ok()) << transaction.status();
    const auto differing = transaction->Execute(
        "SELECT correction_id::text, state, correction_state(correction_id) FROM correction_states "
        "WHERE state IS DISTINCT FROM correction_state(correction_id)",
        {});
    ASSERT_TRUE(differing.ok()) << differing.status();
    for (int row = 0; row < differing->count(); ++row)
      ADD_FAILURE() << differing->Text(row, 0) << ": " << differing->Text(row, 1) << ", told "
                    << differing->Text(row, 2);
  }
  ReleaseTest() { plant_.plant.machine.mutable_safety_envelope()->set_keep_out_mm(0.5); }

  template <typename Request, typename Response>
  absl::StatusOr<Response> Call(grpc::Status (v1::CorrectionService::Stub::*method)(grpc::ClientContext*,
                                                                                    const Request&, Response*),
                                const Request& request) {
    Response response;
    const grpc::Status status = (stub_.get()->*method)(runtime::ContextFor(30).get(), request, &response);
    if (!status.ok()) return runtime::FromGrpc(status);
    return response;
  }
  using Stub = v1::CorrectionService::Stub;

  v1::Correction Correct(bool waits, bool with_program = true) {
    plant_.plant.machine.mutable_safety_envelope()->set_translation_mm(waits ? 0.1 : 2);
    v1::CorrectRequest request;
    request.set_registration(testing::kRegistration);
    if (with_program) request.set_nc_template(kTemplate);
    request.set_request_id(storage::NewUuid());
    const auto correction = Call(&Stub::Correct, request);
    EXPECT_TRUE(correction.ok()) << correction.status();
    return correction.ok() ? *correction : v1::Correction();
  }
  absl::StatusOr<v1::Correction> Release(const std::string& name, const std::string& reason = "looked at it") {
    v1::ReleaseCorrectionRequest request;
    request.set_name(name);
    request.set_reason(reason);
    request.set_request_id(storage::NewUuid());
    return Call(&Stub::ReleaseCorrection, request);
  }
  absl::StatusOr<v1::Correction> RefuseIt(const std::string& name) {
    v1::RefuseCorrectionRequest request;
    request.set_name(name);
    request.set_reason("foil under the clamp");
    request.set_request_id(storage::NewUuid());
    return Call(&Stub::RefuseCorrection, request);
  }
  static v1::FetchProgramRequest FetchRequest(const std::string& name) {
    v1::FetchProgramRequest request;
    request.set_name(name);
    request.set_machine("machines/m1");
    request.set_blade("blades/sn1");
    request.set_request_id(storage::NewUuid());
    return request;
  }
  absl::StatusOr<v1::FetchProgramResponse> Fetch(const std::string& name) {
    return Call(&Stub::FetchProgram, FetchRequest(name));
  }
  absl::StatusOr<v1::Correction> Cut(const std::string& name, const std::vector<std::string>& holes) {
    v1::ReportCutRequest request;
    request.set_name(name);
    for (const std::string& hole : holes) {
      request.add_holes()->set_group("G1");
      request.mutable_holes(request.holes_size() - 1)->set_hole(hole);
    }
    request.set_request_id(storage::NewUuid());
    return Call(&Stub::ReportCut, request);
  }
  v1::Correction Get(const std::string& name) {
    v1::GetCorrectionRequest request;
    request.set_name(name);
    const auto correction = Call(&Stub::GetCorrection, request);
    EXPECT_TRUE(correction.ok()) << correction.status();
    return correction.ok() ? *correction : v1::Correction();
  }
  std::string StateOf(const std::string& name) {
    return v1::CorrectionState_Name(Get(name).state()).substr(std::string("CORRECTION_STATE_").size());
  }
  // Why no program left.
  std::string Refused(const absl::Status& status) {
    return runtime::ReasonOf(status) + " " + std::string(status.message());
  }
  std::vector<std::string> Kinds() {
    auto transaction = plant_.database.database()->Begin(testing::Soon());
    std::vector<std::string> kinds;
    const auto record = storage::RecordOfBlade(*transaction, "sn1");
    for (const storage::JournalEntry& entry : *record) kinds.push_back(entry.entry.kind);
    return kinds;
  }

  testing::JudgedPlant plant_;
  // With the rights that the service has, and no more.
  std::unique_ptr<storage::Database> database_ =
      storage::Database::Open(testing::AsRole(plant_.database.conninfo(), "correction"), 4);
  CorrectionService service_{
      storage::CorrectionsIn(database_.get()),
      storage::CorrectionEventsIn(database_.get()),
      {storage::ReconstructionsIn(database_.get()), storage::MachiningPassesIn(database_.get()),
       storage::RepairsIn(database_.get())},
      std::make_unique<clients::BladePeers>(plant_.Connect(), plant_.Connect(), plant_.Connect(), plant_.Connect()),
      {4, 0},
      1};
  testing::InProcessServer server_{{&service_}};
  std::unique_ptr<Stub> stub_ = v1::CorrectionService::NewStub(server_.Connect());
};

TEST_F(ReleaseTest, WhatTheGateLetsPassIsReleasedAndFetched) {
  const v1::Correction correction = Correct(false);
  EXPECT_EQ(correction.state(), v1::CORRECTION_STATE_RELEASED) << correction.ShortDebugString();
  EXPECT_EQ(correction.program_sha256(), storage::Sha256Hex(correction.nc_program()));
  // Eight hours from the registration on, which is before the calibrations' end.
  const auto fetched = Fetch(correction.name());
  ASSERT_TRUE(fetched.ok()) << fetched.status();
  EXPECT_EQ(fetched->nc_program(), correction.nc_program());
  EXPECT_EQ(fetched->program_sha256(), correction.program_sha256());
  EXPECT_EQ(fetched->proof().SerializeAsString(), correction.proof().SerializeAsString());
  EXPECT_EQ(fetched->hole_count(), 2);
  EXPECT_EQ(fetched->correction(), correction.name());
  EXPECT_EQ(Get(correction.name()).nc_program(), "");
  EXPECT_THAT(Kinds(), IsSupersetOf({"correction", "fetch"}));
}

TEST_F(ReleaseTest, ADraftLeavesOnlyOnceAPersonReleasesIt) {
  const v1::Correction draft = Correct(true);
  EXPECT_EQ(draft.state(), v1::CORRECTION_STATE_DRAFT);
  EXPECT_EQ(draft.nc_program(), "");
  EXPECT_EQ(draft.program_sha256().size(), 64u);
  EXPECT_THAT(Refused(Fetch(draft.name()).status()),
              HasSubstr("PROGRAM_NOT_RELEASED name: " + draft.name() + ", DRAFT, want RELEASED"));
  EXPECT_THAT(Refused(Cut(draft.name(), {"H1"}).status()), HasSubstr("PROGRAM_NOT_RELEASED"));
  const auto released = Release(draft.name());
  ASSERT_TRUE(released.ok()) << released.status();
  EXPECT_EQ(released->state(), v1::CORRECTION_STATE_RELEASED);
  EXPECT_THAT(released->released().requested_by(),
              ::testing::StartsWith("ipv4:127.0.0.1:"));  // no door, no certificate
  EXPECT_EQ(released->released().reason(), "looked at it");
  EXPECT_EQ(released->release(), v1::RELEASE_AWAITING_PERSON);  // what the gate said stays
  const auto fetched = Fetch(draft.name());
  ASSERT_TRUE(fetched.ok()) << fetched.status();
  EXPECT_EQ(fetched->program_sha256(), draft.program_sha256());  // what was proven, to the byte
  EXPECT_THAT(Refused(Release(draft.name()).status()), HasSubstr("CORRECTION_DECIDED"));
  EXPECT_THAT(Kinds(), IsSupersetOf({"correction", "release", "fetch"}));
}

TEST_F(ReleaseTest, WhyIsWanted) {
  const std::string name = Correct(true).name();
  EXPECT_THAT(std::string(Release(name, " \n").status().message()), HasSubstr("reason: "));
  EXPECT_EQ(runtime::ReasonOf(Release("corrections/018f6f3e-7c1a-7e5b-9d5a-2f1c3b4a5d6e").status()),
            "CORRECTION_NOT_FOUND");
  EXPECT_EQ(StateOf(name), "DRAFT");
}

TEST_F(ReleaseTest, WhatAPersonRefusesStaysRefused) {
  const std::string draft = Correct(true).name();
  ASSERT_TRUE(RefuseIt(draft).ok());
  EXPECT_EQ(StateOf(draft), "REFUSED");
  EXPECT_THAT(Refused(Release(draft).status()),
              AllOf(HasSubstr("REFUSED by ipv4:127.0.0.1:"), HasSubstr(" (foil under the clamp), want a draft")));
  const std::string released = Correct(false).name();
  ASSERT_TRUE(RefuseIt(released).ok());
  EXPECT_THAT(Refused(Fetch(released).status()), HasSubstr("PROGRAM_NOT_RELEASED"));
  EXPECT_THAT(Refused(RefuseIt(released).status()), HasSubstr("CORRECTION_DECIDED"));
  // What was cut by then is a fact.
  EXPECT_TRUE(Cut(released, {"H1"}).ok());
  EXPECT_EQ(StateOf(released), "REFUSED");
}

TEST_F(ReleaseTest, ItIsForOneBladeOnOneMachineInOneClamping) {
  plant_.registration.registration.set_clamping("clamping 7");
  const v1::Correction correction = Correct(false);
  EXPECT_EQ(correction.clamping(), "clamping 7");
  v1::FetchProgramRequest request = FetchRequest(correction.name());
  EXPECT_THAT(Refused(Call(&Stub::FetchProgram, request).status()),
              HasSubstr("CLAMPING_DIFFERS clamping: , want clamping 7"));
  request.set_clamping("clamping 8");
  EXPECT_THAT(Refused(Call(&Stub::FetchProgram, request).status()), HasSubstr("clamping: clamping 8, want clamping 7"));
  request.set_clamping("clamping 7");
  request.set_blade("blades/sn2");
  EXPECT_THAT(Refused(Call(&Stub::FetchProgram, request).status()), HasSubstr("blade: blades/sn2, want blades/sn1"));
  request.set_blade("blades/sn1");
  request.set_machine("machines/m2");
  EXPECT_THAT(Refused(Call(&Stub::FetchProgram, request).status()),
              HasSubstr("machine: machines/m2, want machines/m1"));
  request.set_machine("machines/m1");
  // Another blade was registered there since.
  registration::v1::Registration later = plant_.registration.registration;
  later.set_name("registrations/later");
  later.set_blade("blades/sn2");
  later.set_record_sequence(9);
  plant_.registration.later = {later};
  EXPECT_THAT(Refused(Call(&Stub::FetchProgram, request).status()),
              HasSubstr("CLAMPING_DIFFERS " + correction.name() + ": registrations/later was made since"));
  // One of another part counts as much; who fetches may not know of it.
  plant_.registration.later[0].set_part("parts/anothers");
  const std::string refused = Refused(Call(&Stub::FetchProgram, request).status());
  EXPECT_THAT(refused, HasSubstr(": a registration of another part was made since"));
  EXPECT_THAT(refused, Not(HasSubstr("later")));
  plant_.registration.later.clear();
  EXPECT_TRUE(Call(&Stub::FetchProgram, request).ok());
}

TEST_F(ReleaseTest, AProgramGoesOnWithTheHolesThatAreLeft) {
  const v1::Correction correction = Correct(false);
  const auto cut = Cut(correction.name(), {"H1"});
  ASSERT_TRUE(cut.ok()) << cut.status();
  EXPECT_EQ(cut->state(), v1::CORRECTION_STATE_RELEASED);
  EXPECT_TRUE(cut->groups(0).holes(0).has_reported_cut_at());
  EXPECT_FALSE(cut->groups(0).holes(1).has_reported_cut_at());
  const auto rest = Fetch(correction.name());
  ASSERT_TRUE(rest.ok()) << rest.status();
  EXPECT_EQ(rest->hole_count(), 1);
  EXPECT_EQ(rest->cut_count(), 1);
  EXPECT_THAT(rest->nc_program(), HasSubstr("(SIXPOINT G1/H2)"));
  EXPECT_THAT(rest->nc_program(), Not(HasSubstr("G1/H1")));
  EXPECT_EQ(rest->program_sha256(), storage::Sha256Hex(rest->nc_program()));
  EXPECT_EQ(rest->proof().pose_count(), 2);
  EXPECT_THAT(Refused(Cut(correction.name(), {"H2", "H1"}).status()), HasSubstr("HOLE_CUT_BEFORE holes[1]: G1/H1"));
  EXPECT_FALSE(Get(correction.name()).groups(0).holes(1).has_reported_cut_at());  // all or none
  EXPECT_THAT(std::string(Cut(correction.name(), {"H9"}).status().message()),
              HasSubstr("holes[0]: G1/H9, want a hole of"));
  ASSERT_TRUE(Cut(correction.name(), {"H2"}).ok());
  EXPECT_EQ(StateOf(correction.name()), "CUT");
  EXPECT_THAT(Refused(Fetch(correction.name()).status()), HasSubstr("CUT, want RELEASED"));
  // The next correction of this blade would cut them again.
  const v1::Correction again = Correct(false);
  EXPECT_EQ(again.state(), v1::CORRECTION_STATE_DRAFT);
  EXPECT_THAT(again.release_reasons(0), HasSubstr("CUT_BEFORE of G1/H1: 2"));
}

TEST_F(ReleaseTest, ARetryGetsTheSameWhileItMayBeUsed) {
  const v1::Correction correction = Correct(false);
  const v1::FetchProgramRequest request = FetchRequest(correction.name());
  const auto first = Call(&Stub::FetchProgram, request), again = Call(&Stub::FetchProgram, request);
  ASSERT_TRUE(first.ok() && again.ok()) << first.status() << again.status();
  EXPECT_EQ(first->SerializeAsString(), again->SerializeAsString());
  // What it gave then would cut H1 again.
  ASSERT_TRUE(Cut(correction.name(), {"H1"}).ok());
  EXPECT_EQ(runtime::ReasonOf(Call(&Stub::FetchProgram, request).status()), "CORRECTION_DECIDED_MEANWHILE");
  EXPECT_TRUE(Fetch(correction.name()).ok());
  ASSERT_TRUE(RefuseIt(correction.name()).ok());
  EXPECT_EQ(runtime::ReasonOf(Call(&Stub::FetchProgram, request).status()), "PROGRAM_NOT_RELEASED");
}

TEST_F(ReleaseTest, WithoutATemplateThereIsNothingToFetch) {
  const v1::Correction correction = Correct(false, false);
  EXPECT_EQ(correction.state(), v1::CORRECTION_STATE_RELEASED);
  EXPECT_EQ(runtime::ReasonOf(Fetch(correction.name()).status()), "PROGRAM_MISSING");
}

TEST_F(ReleaseTest, TheOneReleasedLastIsTheOneToUse) {
  const std::string draft = Correct(true).name(), first = Correct(false).name();
  EXPECT_EQ(StateOf(first), "RELEASED");
  EXPECT_EQ(Correct(false, false).state(), v1::CORRECTION_STATE_RELEASED);
  EXPECT_EQ(StateOf(first), "RELEASED");  // one without a program replaces none
  ASSERT_TRUE(Release(draft).ok());       // made before, released after
  EXPECT_EQ(StateOf(first), "SUPERSEDED");
  EXPECT_EQ(Get(first).superseded_by(), draft);
  EXPECT_EQ(StateOf(draft), "RELEASED");
  EXPECT_THAT(Refused(Fetch(first).status()), HasSubstr("SUPERSEDED by " + draft));
  ASSERT_TRUE(RefuseIt(draft).ok());
  EXPECT_EQ(StateOf(first), "RELEASED");  // as a calibration comes back
  v1::ListCorrectionsRequest list;
  list.set_state(v1::CORRECTION_STATE_REFUSED);
  const auto refused = Call(&Stub::ListCorrections, list);
  ASSERT_TRUE(refused.ok());
  ASSERT_EQ(refused->corrections_size(), 1);
  EXPECT_EQ(refused->corrections(0).name(), draft);
}

// Each was sound when it was made; the other has cut the hole since.
TEST_F(ReleaseTest, AHoleThatAnotherProgramCutIsNotCutAgain) {
  const std::string draft = Correct(true).name(), first = Correct(false).name(), second = Correct(false).name();
  ASSERT_TRUE(Cut(first, {"H1"}).ok());
  EXPECT_EQ(StateOf(second), "SUPERSEDED");
  EXPECT_EQ(Get(second).superseded_by(), first);
  EXPECT_THAT(Refused(Fetch(second).status()), HasSubstr("PROGRAM_NOT_RELEASED"));
  EXPECT_THAT(Refused(Release(draft).status()), HasSubstr("SUPERSEDED by " + first + ", want a draft"));
  // The first goes on once what superseded it is out of the way.
  ASSERT_TRUE(RefuseIt(second).ok());
  const auto rest = Fetch(first);
  ASSERT_TRUE(rest.ok()) << rest.status();
  EXPECT_EQ(rest->hole_count(), 1);
  // One that is made now knows of it, and a person may have it cut again.
  const v1::Correction again = Correct(false);
  EXPECT_EQ(again.state(), v1::CORRECTION_STATE_DRAFT);
  ASSERT_TRUE(Release(again.name()).ok());
  EXPECT_EQ(StateOf(again.name()), "RELEASED");
}

TEST_F(ReleaseTest, OnlyTheCallThatMadeItGivesTheProgram) {
  v1::CorrectRequest request;
  request.set_registration(testing::kRegistration);
  request.set_nc_template(kTemplate);
  request.set_request_id(storage::NewUuid());
  const auto made = Call(&Stub::Correct, request), again = Call(&Stub::Correct, request);
  ASSERT_TRUE(made.ok() && again.ok()) << made.status() << again.status();
  EXPECT_NE(made->nc_program(), "");
  EXPECT_EQ(again->name(), made->name());
  EXPECT_EQ(again->nc_program(), "");  // a blade later
}

TEST_F(ReleaseTest, IsFetchedWithTheCalibrationsInForce) {
  const std::string name = Correct(false).name();
  plant_.calibration.rotation.set_name("calibrations/00000000-0000-7000-8000-000000000098");
  EXPECT_EQ(runtime::ReasonOf(Fetch(name).status()), "CALIBRATION_EXPIRED");
  plant_.calibration.rotation.set_name(testing::kRotationCalibration);
  EXPECT_TRUE(Fetch(name).ok());
}

// As the release before wrote it: by its envelope alone.
TEST_F(ReleaseTest, WhatNoGateHasJudgedIsADraft) {
  const auto store = storage::CorrectionsIn(database_.get());
  const std::string id = Correct(false).name().substr(std::string("corrections/").size());
  auto row = **store->Find(id, testing::Soon());
  row.correction_id = storage::NewUuid();
  row.nc_template = kTemplate;
  row.registration_age_h.reset();
  storage::RecordEntry entry;
  entry.kind = "correction";
  entry.name = "corrections/" + row.correction_id;
  entry.blade = "sn1";
  entry.software_version = "0.1.0";
  ASSERT_TRUE(store->Record({"correction.Correct", storage::NewUuid(), "x"}, row, entry, testing::Soon()).ok());
  EXPECT_EQ(StateOf(entry.name), "DRAFT");
  EXPECT_THAT(Refused(Fetch(entry.name).status()), HasSubstr("DRAFT, want RELEASED"));
  EXPECT_TRUE(RefuseIt(entry.name).ok());
}

TEST_F(ReleaseTest, GoesWithACalibrationThatIsWithdrawn) {
  const std::string released = Correct(false).name(), draft = Correct(true).name();
  plant_.Withdraw(testing::kRotationCalibration);
  EXPECT_EQ(StateOf(released), "WITHDRAWN");
  EXPECT_THAT(Refused(Fetch(released).status()), HasSubstr("WITHDRAWN, want RELEASED"));
  EXPECT_THAT(Refused(Release(draft).status()), HasSubstr("WITHDRAWN, want a draft"));
}

TEST_F(ReleaseTest, EndsWithItsTime) {
  plant_.registration.registration.mutable_recorded_at()->set_seconds(time(nullptr));
  plant_.plant.machine.mutable_safety_envelope()->set_registration_age_h(1e-5);  // 36 ms
  const v1::Correction draft = Correct(true);
  EXPECT_EQ(draft.usable_until().seconds(), draft.valid_until().seconds());  // a draft's time does not run
  const auto released = Release(draft.name());
  ASSERT_TRUE(released.ok()) << released.status();
  std::this_thread::sleep_for(std::chrono::milliseconds(60));
  EXPECT_EQ(StateOf(draft.name()), "EXPIRED");
  EXPECT_THAT(Refused(Fetch(draft.name()).status()), HasSubstr("EXPIRED, want RELEASED"));
}

// Whoever asks, and however: the database itself lets nothing leave that is not released.
TEST_F(ReleaseTest, TheDatabaseLetsNoDraftLeave) {
  const v1::Correction draft = Correct(true);
  const auto events = storage::CorrectionEventsIn(database_.get());
  storage::ProgramFetchRow fetch;
  fetch.fetch_id = storage::NewUuid();
  fetch.correction_id = draft.name().substr(std::string("corrections/").size());
  fetch.nc_program = "M30\n";
  fetch.hole_count = 1;
  fetch.proof = {"2", 1, 0, 0};
  fetch.software_version = "test";
  const auto stored = events->RecordFetch(
      {"correction.FetchProgram", storage::NewUuid(), "x"}, fetch, [](const auto&) { return absl::OkStatus(); },
      testing::Soon());
  EXPECT_EQ(runtime::ReasonOf(stored.status()), "PROGRAM_NOT_RELEASED") << stored.status();
}

// Two that fetch, refuse and report at once: each sees the other, or comes before it.
TEST_F(ReleaseTest, OfManyAtOnceNoneLeavesAfterTheRefusal) {
  const v1::Correction correction = Correct(false);
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) threads.emplace_back([&] { Fetch(correction.name()).status().IgnoreError(); });
  threads.emplace_back([&] { RefuseIt(correction.name()).status().IgnoreError(); });
  for (std::thread& thread : threads) thread.join();
  auto transaction = plant_.database.database()->Begin(testing::Soon());
  const auto record = storage::RecordOfBlade(*transaction, "sn1");
  ASSERT_TRUE(record.ok());
  bool refused = false;
  for (const storage::JournalEntry& entry : *record) {
    refused = refused || entry.entry.kind == "refusal";
    EXPECT_FALSE(refused && entry.entry.kind == "fetch");
  }
  EXPECT_TRUE(refused);
}

}  // namespace
}  // namespace sixpoint::correction
