// The handler of dispositions on fake stores: no PostgreSQL.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/inspection/disposition_service.h"
#include "tests/support/call.h"
#include "tests/support/fake_dispositions.h"
#include "tests/support/fake_inspections.h"
#include "tests/support/in_process_server.h"
#include "tests/support/listed_results.h"
#include "tests/support/must.h"
#include "tests/support/some_uuid.h"

namespace sixpoint::inspection {
namespace {

using sixpoint::testing::kSomeUuid;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class DispositionHandlersTest : public ::testing::Test {
 protected:
  DispositionHandlersTest() {
    storage::InspectionRow row;
    row.inspection_id = kInspectionId;
    row.blade_serial = "sn1";
    row.machine_id = "m1";
    row.verdict = "NOT_CONFORM";
    testing::Must(inspections_->Record({}, row, {}, {}).status());
  }
  static v1::DisposeRequest Request(v1::DispositionKind kind, const std::string& request_id = "") {
    v1::DisposeRequest request;
    request.set_inspection(std::string("inspections/") + kInspectionId);
    request.set_kind(kind);
    request.set_reason("one hole is out");
    request.set_request_id(request_id);
    return request;
  }
  absl::StatusOr<v1::Disposition> Dispose(const v1::DisposeRequest& request) {
    return testing::Call(*stub_, &v1::DispositionService::Stub::Dispose, request);
  }

  static constexpr char kInspectionId[] = "00000000-0000-7000-8000-0000000000b1";
  std::shared_ptr<testing::FakeDispositions> store_ = std::make_shared<testing::FakeDispositions>();
  std::shared_ptr<testing::FakeInspections> inspections_ = std::make_shared<testing::FakeInspections>();
  DispositionService service_{store_, inspections_};
  testing::InProcessServer server_{{&service_}};
  std::unique_ptr<v1::DispositionService::Stub> stub_ = v1::DispositionService::NewStub(server_.Connect());
};

TEST_F(DispositionHandlersTest, RecordsWhatWasDecidedAndOfWhat) {
  v1::DisposeRequest request = Request(v1::DISPOSITION_KIND_CONCESSION);
  request.set_reference("C-118");
  const auto disposition = Dispose(request);
  ASSERT_TRUE(disposition.ok()) << disposition.status();
  ASSERT_THAT(store_->rows(), SizeIs(1));
  const storage::DispositionRow row = store_->rows().front();
  EXPECT_EQ(disposition->name(), "dispositions/" + row.disposition_id);
  EXPECT_EQ(disposition->inspection(), request.inspection());
  EXPECT_EQ(disposition->blade(), "blades/sn1");
  EXPECT_EQ(disposition->kind(), v1::DISPOSITION_KIND_CONCESSION);
  EXPECT_EQ(disposition->reason(), "one hole is out");
  EXPECT_EQ(disposition->reference(), "C-118");
  EXPECT_EQ(disposition->requested_by(), row.requested_by);
  EXPECT_THAT(row.requested_by, ::testing::StartsWith("ipv4:127.0.0.1:"));  // no certificate
  EXPECT_EQ(disposition->record_sequence(), 1);
  EXPECT_EQ(row.machine_id, "m1");
  const storage::RecordEntry entry = store_->entries().front();
  EXPECT_EQ(entry.kind, "disposition");
  EXPECT_EQ(entry.name, disposition->name());
  EXPECT_THAT(entry.inputs, ElementsAre(request.inspection()));
  EXPECT_EQ(entry.blade, "sn1");
  EXPECT_EQ(entry.machine, "m1");
  EXPECT_EQ(entry.method, "CONCESSION");
  EXPECT_THAT(entry.summary_json, ::testing::AllOf(HasSubstr("NOT_CONFORM"), HasSubstr("C-118")));
}

TEST_F(DispositionHandlersTest, ARetryIsTheSameDisposition) {
  const v1::DisposeRequest request = Request(v1::DISPOSITION_KIND_SCRAP, kSomeUuid);
  const auto first = Dispose(request);
  ASSERT_TRUE(first.ok()) << first.status();
  inspections_->Fail(absl::ResourceExhaustedError("database: full"));  // a retry does not ask for it
  const auto again = Dispose(request);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->DebugString(), first->DebugString());
  EXPECT_THAT(store_->rows(), SizeIs(1));
  EXPECT_EQ(Dispose(Request(v1::DISPOSITION_KIND_REWORK, kSomeUuid)).status().code(), absl::StatusCode::kAlreadyExists);
}

TEST_F(DispositionHandlersTest, RefusesEachFieldByItsNameAndRecordsNothing) {
  v1::DisposeRequest request = Request(v1::DISPOSITION_KIND_SCRAP);
  request.set_inspection("blades/sn1");
  EXPECT_EQ(testing::RefusedField(Dispose(request).status()), "inspection");
  request = Request(v1::DISPOSITION_KIND_UNSPECIFIED);
  EXPECT_EQ(testing::RefusedField(Dispose(request).status()), "kind");
  request.set_kind(static_cast<v1::DispositionKind>(99));
  EXPECT_EQ(testing::RefusedField(Dispose(request).status()), "kind");
  request = Request(v1::DISPOSITION_KIND_SCRAP);
  request.clear_reason();
  EXPECT_EQ(testing::RefusedField(Dispose(request).status()), "reason");
  EXPECT_EQ(testing::RefusedField(Dispose(Request(v1::DISPOSITION_KIND_CONCESSION)).status()), "reference");
  EXPECT_EQ(ViolationsOf(Dispose({}).status()).size(), 3u) << "all that is wrong is told at once";
  EXPECT_THAT(store_->rows(), IsEmpty());
  EXPECT_THAT(store_->entries(), IsEmpty());
}

TEST_F(DispositionHandlersTest, OfAnInspectionThatIsNotRecordedThereIsNone) {
  v1::DisposeRequest request = Request(v1::DISPOSITION_KIND_SCRAP);
  request.set_inspection(std::string("inspections/") + kSomeUuid);
  const absl::Status status = Dispose(request).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kNotFound) << status;
  EXPECT_EQ(runtime::ReasonOf(status), "INSPECTION_NOT_FOUND");
  EXPECT_EQ(runtime::MetadataOf(status)["resource"], request.inspection());
  EXPECT_THAT(store_->rows(), IsEmpty());
}

TEST_F(DispositionHandlersTest, SaysWhatTheStoresSay) {
  const v1::DisposeRequest request = Request(v1::DISPOSITION_KIND_SCRAP);
  inspections_->Fail(absl::ResourceExhaustedError("database: full"));
  EXPECT_EQ(Dispose(request).status().code(), absl::StatusCode::kResourceExhausted);
  inspections_->Fail(absl::OkStatus());
  store_->Fail(absl::DeadlineExceededError("database: slow"));
  EXPECT_EQ(Dispose(request).status().code(), absl::StatusCode::kDeadlineExceeded);
  store_->Fail(absl::OkStatus());
  EXPECT_TRUE(Dispose(request).ok());
  EXPECT_THAT(store_->rows(), SizeIs(1));
}

}  // namespace
}  // namespace sixpoint::inspection
