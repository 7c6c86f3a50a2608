// The service over real gRPC on a real PostgreSQL.
#include "services/inspection/disposition_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "storage/correction_events.h"
#include "tests/support/customers_parts.h"
#include "tests/support/in_process_server.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::inspection {
namespace {

using ::testing::ElementsAre;
using testing::Soon;

class Dispositions : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto calibrations = testing::PutCalibratedMachine(database_.database());
    part_ = testing::PutCustomersPart(database_.database(), "open", false, calibrations);
  }
  v1::DisposeRequest Request(v1::DispositionKind kind) {
    v1::DisposeRequest request;
    request.set_inspection(part_.inspection);
    request.set_kind(kind);
    request.set_reason("because");
    request.set_request_id(storage::NewUuid());
    return request;
  }
  absl::StatusOr<v1::Disposition> Dispose(const v1::DisposeRequest& request) {
    v1::Disposition disposition;
    const auto context = runtime::ContextFor(20.0);
    const absl::Status status = runtime::FromGrpc(stub_->Dispose(context.get(), request, &disposition));
    if (!status.ok()) return status;
    return disposition;
  }
  storage::InspectionRow Inspection() {
    const auto found = inspections_->Find(part_.inspection.substr(12), Soon());
    EXPECT_TRUE(found.ok() && found->has_value()) << found.status();
    return **found;
  }
  std::optional<std::string> ScrappedBy() {
    const auto found = storage::CorrectionEventsIn(database_.database())->ScrappedBy(part_.blade.substr(7), Soon());
    EXPECT_TRUE(found.ok()) << found.status();
    return *found;
  }
  testing::ThrowawayDatabase database_;
  std::shared_ptr<storage::InspectionStore> inspections_ = storage::InspectionsIn(database_.database());
  DispositionService service_{storage::DispositionsIn(database_.database()), inspections_};
  testing::InProcessServer server_{{&service_}};
  std::unique_ptr<v1::DispositionService::Stub> stub_ = v1::DispositionService::NewStub(server_.Connect());
  testing::CustomersPart part_;
};

TEST_F(Dispositions, ALaterOneTakesThePlaceOfTheEarlierAndTheVerdictStays) {
  const std::string verdict = Inspection().verdict;
  const auto scrap = Dispose(Request(v1::DISPOSITION_KIND_SCRAP));
  ASSERT_TRUE(scrap.ok()) << scrap.status();
  EXPECT_EQ(scrap->blade(), part_.blade);
  EXPECT_EQ(ScrappedBy(), scrap->name());
  v1::DisposeRequest concession = Request(v1::DISPOSITION_KIND_CONCESSION);
  concession.set_reference("C-118");
  ASSERT_TRUE(Dispose(concession).ok());
  EXPECT_FALSE(ScrappedBy().has_value()) << "the newest of the blade is another";
  const storage::InspectionRow inspection = Inspection();
  EXPECT_EQ(inspection.verdict, verdict);
  ASSERT_EQ(inspection.dispositions.size(), 2u);
  EXPECT_EQ(inspection.dispositions[0].disposition, "CONCESSION");
  EXPECT_EQ(inspection.dispositions[0].reference, "C-118");
  EXPECT_EQ(inspection.dispositions[1].disposition, "SCRAP");
}

TEST_F(Dispositions, TheSameRequestIsRecordedOnce) {
  const v1::DisposeRequest request = Request(v1::DISPOSITION_KIND_REWORK);
  const auto first = Dispose(request);
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_EQ(Dispose(request)->name(), first->name());
  EXPECT_EQ(Inspection().dispositions.size(), 1u);
  v1::DisposeRequest another = request;
  another.set_reason("another");
  EXPECT_EQ(Dispose(another).status().code(), absl::StatusCode::kAlreadyExists);
}

TEST_F(Dispositions, StandInTheJournalWithTheirInspection) {
  const auto made = Dispose(Request(v1::DISPOSITION_KIND_SCRAP));
  ASSERT_TRUE(made.ok()) << made.status();
  absl::StatusOr<storage::Transaction> transaction = database_.database()->Begin(Soon());
  const auto entry = storage::FindEntry(*transaction, made->name());
  ASSERT_TRUE(entry.ok() && entry->has_value()) << entry.status();
  EXPECT_EQ((*entry)->entry.kind, "disposition");
  EXPECT_THAT((*entry)->entry.inputs, ElementsAre(part_.inspection));
  EXPECT_EQ((*entry)->entry.method, "SCRAP");
  EXPECT_EQ("blades/" + *(*entry)->entry.blade, part_.blade);
}

// A person releases the part's correction; whether its program then leaves.
class ScrappedBlades : public Dispositions {
 protected:
  void SetUp() override {
    Dispositions::SetUp();
    // A hole, or else all of them would be cut.
    absl::StatusOr<storage::Transaction> transaction = database_.database()->Begin(Soon());
    const storage::Params id = storage::Params().Uuid(part_.correction.substr(12));
    for (const char* insert :
         {"INSERT INTO correction_groups (correction_id, position_index, group_name, a_deg, b_deg, a_nominal_deg, "
          "b_nominal_deg, a_ideal_deg, b_ideal_deg, a_standard_uncertainty_deg, b_standard_uncertainty_deg) "
          "VALUES ($1, 0, 'G', 0, 0, 0, 0, 0, 0, 0, 0)",
          "INSERT INTO correction_holes (correction_id, group_name, position_index, hole_name, start_x_mm, start_y_mm, "
          "start_z_mm, nominal_start_x_mm, nominal_start_y_mm, nominal_start_z_mm, expanded_uncertainty_um) "
          "VALUES ($1, 'G', 0, 'H', 0, 0, 0, 0, 0, 0, 10)"}) {
      const auto inserted = transaction->Execute(insert, id);
      ASSERT_TRUE(inserted.ok()) << inserted.status();
    }
    ASSERT_TRUE(transaction->Commit().ok());
  }
  void Release() {
    const std::string id = part_.correction.substr(12);
    const auto released = events_->Decide(
        {"correction.Release", "", ""},
        {id, "RELEASED", "seen", "users/jane", "test", [](const auto&) { return absl::OkStatus(); }}, Soon());
    ASSERT_TRUE(released.ok()) << released.status();
    ASSERT_EQ(released->state, "RELEASED");
  }
  // As the gate does, where the blade was scrap when it judged.
  void Tell() {
    absl::StatusOr<storage::Transaction> transaction = database_.database()->Begin(Soon());
    const auto inserted = transaction->Execute(
        "INSERT INTO correction_checks (correction_id, position_index, kind, subject, value, limit_value, passed, "
        "failed_count) VALUES ($1, 20, 'SCRAPPED', 'dispositions/d1', 1, 0, false, 1)",
        storage::Params().Uuid(part_.correction.substr(12)));
    ASSERT_TRUE(inserted.ok()) << inserted.status();
    ASSERT_TRUE(transaction->Commit().ok());
  }
  absl::Status Fetch() {
    storage::ProgramFetchRow fetch;
    fetch.fetch_id = storage::NewUuid();
    fetch.correction_id = part_.correction.substr(12);
    fetch.nc_program = "G0 X1";
    fetch.hole_count = 1;
    fetch.proof.reader_version = "test";
    fetch.proof.pose_count = 1;
    fetch.requested_by = "machines/m1";
    fetch.software_version = "test";
    return events_
        ->RecordFetch(
            {"correction.FetchProgram", "", ""}, fetch, [](const auto&) { return absl::OkStatus(); }, Soon())
        .status();
  }
  std::shared_ptr<storage::CorrectionEventStore> events_ = storage::CorrectionEventsIn(database_.database());
};

TEST_F(ScrappedBlades, AProgramThatWasReleasedBeforeDoesNotLeave) {
  Release();
  ASSERT_TRUE(Fetch().ok());
  ASSERT_TRUE(Dispose(Request(v1::DISPOSITION_KIND_SCRAP)).ok());
  const absl::Status refused = Fetch();
  EXPECT_EQ(refused.code(), absl::StatusCode::kFailedPrecondition) << refused;
  EXPECT_THAT(std::string(refused.message()), ::testing::HasSubstr("scrapped"));
  ASSERT_TRUE(Dispose(Request(v1::DISPOSITION_KIND_REWORK)).ok());
  EXPECT_TRUE(Fetch().ok());
}

TEST_F(ScrappedBlades, WhatAPersonReleasesInSpiteOfItLeaves) {
  ASSERT_TRUE(Dispose(Request(v1::DISPOSITION_KIND_SCRAP)).ok());
  Tell();
  Release();
  const absl::Status fetched = Fetch();
  EXPECT_TRUE(fetched.ok()) << fetched;
  EXPECT_FALSE(events_->ScrappedAgainst(part_.correction.substr(12), Soon())->has_value());
}

TEST_F(ScrappedBlades, WhatWasReleasedByWhoWasNotToldDoesNotLeave) {
  const auto scrap = Dispose(Request(v1::DISPOSITION_KIND_SCRAP));
  ASSERT_TRUE(scrap.ok());
  Release();  // the gate had judged before
  EXPECT_EQ(Fetch().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(*events_->ScrappedAgainst(part_.correction.substr(12), Soon()), scrap->name());
}

TEST_F(Dispositions, WhatSaysTooLittleIsRefused) {
  v1::DisposeRequest request = Request(v1::DISPOSITION_KIND_SCRAP);
  request.clear_reason();
  EXPECT_EQ(Dispose(request).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(Dispose(Request(v1::DISPOSITION_KIND_CONCESSION)).status().code(), absl::StatusCode::kInvalidArgument)
      << "a concession has a number";
  EXPECT_EQ(Dispose(Request(v1::DISPOSITION_KIND_UNSPECIFIED)).status().code(), absl::StatusCode::kInvalidArgument);
  request = Request(v1::DISPOSITION_KIND_SCRAP);
  request.set_inspection("inspections/" + storage::NewUuid());
  EXPECT_EQ(runtime::ReasonOf(Dispose(request).status()), "INSPECTION_NOT_FOUND");
  EXPECT_TRUE(Inspection().dispositions.empty());
}

}  // namespace
}  // namespace sixpoint::inspection
