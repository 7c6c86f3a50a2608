// The service over real gRPC on a real PostgreSQL.
#include "services/plant/record_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "storage/plant_registry.h"
#include "storage/record.h"
#include "tests/support/in_process_server.h"
#include "tests/support/registered.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::plant {
namespace {

using ::testing::ElementsAre;

storage::RecordEntry Entry(const std::string& kind, const std::string& name, const std::vector<std::string>& inputs) {
  storage::RecordEntry entry;
  entry.kind = kind;
  entry.name = name;
  entry.inputs = inputs;
  entry.software_version = "test";
  return entry;
}

// machines/m1@1 <- calibrations/a1 <- calibrations/c1 <- registrations/r1..3 of blades/sn1, each with its scan.
class RecordServiceTest : public ::testing::Test {
 protected:
  RecordServiceTest()
      : service_(storage::PlantIn(database_.database()).journal, storage::PlantIn(database_.database()).blades),
        server_({&service_}),
        stub_(v1::RecordService::NewStub(server_.Connect())) {}

  void SetUp() override {
    absl::StatusOr<storage::Transaction> transaction = database_.database()->Begin(testing::Soon());
    ASSERT_TRUE(transaction.ok()) << transaction.status();
    testing::RegisterPart(*transaction, "vane");
    ASSERT_TRUE(storage::InsertBlade(*transaction, {"sn1", "vane", {}}, Entry("", "", {"parts/vane@1"})).ok());
    testing::RegisterMachine(*transaction, "m1");
    Append(&*transaction, Entry("calibration", "calibrations/a1", {"machines/m1@1"}));
    storage::RecordEntry calibration = Entry("calibration", "calibrations/c1", {"machines/m1@1", "calibrations/a1"});
    calibration.machine = "m1";
    calibration.requested_by = "operator";
    calibration.summary_json = R"({"residual_rms_um": 7})";
    Append(&*transaction, calibration);
    for (const std::string id : {"1", "2", "3"}) {
      storage::RecordEntry scan = Entry("scan", "scans/s" + id, {"blades/sn1"});
      scan.blade = "sn1";
      scan.measured_at = storage::Instant(std::chrono::seconds(1795231646));
      Append(&*transaction, scan);
      storage::RecordEntry registration = Entry("registration", "registrations/r" + id, {scan.name, "calibrations/c1"});
      registration.blade = "sn1";
      Append(&*transaction, registration);
    }
    ASSERT_TRUE(transaction->Commit().ok());
  }

  static void Append(storage::Transaction* transaction, const storage::RecordEntry& entry) {
    const absl::StatusOr<storage::Recorded> recorded = storage::AppendRecord(*transaction, storage::NewUuid(), entry);
    ASSERT_TRUE(recorded.ok()) << recorded.status();
  }

  template <typename Request, typename Response>
  absl::StatusOr<Response> Call(grpc::Status (v1::RecordService::Stub::*method)(grpc::ClientContext*, const Request&,
                                                                                Response*),
                                const Request& request) {
    Response response;
    const auto context = runtime::ContextFor(20.0);
    const absl::Status status = runtime::FromGrpc(((*stub_).*method)(context.get(), request, &response));
    if (!status.ok()) return status;
    return response;
  }
  absl::StatusOr<v1::RecordEntry> Get(const std::string& name) {
    v1::GetRecordEntryRequest request;
    request.set_name(name);
    return Call(&v1::RecordService::Stub::GetRecordEntry, request);
  }
  // The names on all pages of that size.
  std::vector<std::string> Recall(const std::string& name, const std::vector<std::string>& kinds, int page_size) {
    v1::RecallRequest request;
    request.set_name(name);
    for (const std::string& kind : kinds) request.add_kinds(kind);
    request.set_page_size(page_size);
    std::vector<std::string> names;
    do {
      const auto page = Call(&v1::RecordService::Stub::Recall, request);
      EXPECT_TRUE(page.ok()) << page.status();
      if (!page.ok()) return names;
      EXPECT_LE(page->entries_size(), page_size);
      for (const v1::RecordEntry& entry : page->entries()) names.push_back(entry.name());
      request.set_page_token(page->next_page_token());
    } while (!request.page_token().empty());
    return names;
  }

  testing::ThrowawayDatabase database_;
  RecordService service_;
  testing::InProcessServer server_;
  std::unique_ptr<v1::RecordService::Stub> stub_;
};

TEST_F(RecordServiceTest, AnEntryIsGotByTheNameItWasRecordedUnder) {
  const auto entry = Get("calibrations/c1");
  ASSERT_TRUE(entry.ok()) << entry.status();
  EXPECT_EQ(entry->kind(), "calibration");
  EXPECT_EQ(entry->machine(), "machines/m1");
  EXPECT_EQ(entry->blade(), "");
  EXPECT_EQ(entry->requested_by(), "operator");
  EXPECT_FALSE(entry->has_measured_at());
  EXPECT_THAT(entry->inputs(), ElementsAre("machines/m1@1", "calibrations/a1"));
  EXPECT_EQ(entry->summary().fields().at("residual_rms_um").number_value(), 7);
  const auto scan = Get("scans/s1");
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_EQ(scan->blade(), "blades/sn1");
  EXPECT_EQ(scan->measured_at().seconds(), 1795231646);
  EXPECT_TRUE(Get("machines/m1@1").ok());
  EXPECT_EQ(runtime::ReasonOf(Get("machines/m1").status()), "RECORD_ENTRY_NOT_FOUND");
  EXPECT_EQ(Get("no name").status().code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(RecordServiceTest, RecallFollowsEveryEdgePageByPage) {
  const std::vector<std::string> rest_on_the_axis = {"calibrations/c1", "registrations/r1", "registrations/r2",
                                                     "registrations/r3"};
  for (const int page_size : {1, 2, 4, 100})
    EXPECT_EQ(Recall("calibrations/a1", {}, page_size), rest_on_the_axis) << page_size;
  EXPECT_THAT(Recall("machines/m1", {"calibration"}, 1), ElementsAre("calibrations/a1", "calibrations/c1"));
  EXPECT_THAT(Recall("scans/s2", {}, 10), ElementsAre("registrations/r2"));
  EXPECT_THAT(Recall("registrations/r3", {}, 10), ElementsAre());
}

TEST_F(RecordServiceTest, RecallByASpanOfTimeAndByReleases) {
  v1::RecallRequest request;
  const auto refused = [&] { return Call(&v1::RecordService::Stub::Recall, request).status(); };
  EXPECT_EQ(refused().code(), absl::StatusCode::kInvalidArgument);  // of nothing at all
  request.mutable_recorded()->mutable_from()->set_seconds(1795231646);
  request.mutable_recorded()->mutable_until()->set_seconds(1795231645);
  EXPECT_THAT(std::string(refused().message()), ::testing::HasSubstr("recorded"));
  request.mutable_recorded()->clear_until();
  request.mutable_recorded()->mutable_from()->set_seconds(1600000000);
  // A kind that no entry has would find nothing, which reads as nothing being there.
  request.add_kinds("registrations");
  EXPECT_THAT(std::string(refused().message()), ::testing::HasSubstr("kinds[0]: registrations, want one of"));
  request.clear_kinds();
  request.add_kinds("registration");
  const auto all = Call(&v1::RecordService::Stub::Recall, request);
  ASSERT_TRUE(all.ok()) << all.status();
  EXPECT_EQ(all->entries_size(), 3);
  request.mutable_recorded()->mutable_from()->set_seconds(4000000000);
  EXPECT_EQ(Call(&v1::RecordService::Stub::Recall, request)->entries_size(), 0);
  EXPECT_EQ(Recall("software/test", {"registration"}, 2).size(), 3u);
  request.clear_recorded();
  for (const char* name : {"software/", "sensors/none", "sensors/a\nb", "nothing", ""}) {
    request.set_name(name);
    EXPECT_FALSE(refused().ok()) << name;
  }
  // A page of another question.
  request.set_name("machines/m1");
  request.set_page_size(1);
  request.set_page_token(Call(&v1::RecordService::Stub::Recall, request)->next_page_token());
  request.mutable_recorded()->mutable_from()->set_seconds(1600000000);
  EXPECT_EQ(refused().code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(RecordServiceTest, TraceGoesBackFromAResultPageByPage) {
  v1::TraceRequest request;
  request.set_name("registrations/r2");
  request.set_page_size(2);
  std::vector<std::string> names;
  do {
    const auto page = Call(&v1::RecordService::Stub::Trace, request);
    ASSERT_TRUE(page.ok()) << page.status();
    for (const v1::RecordEntry& entry : page->entries()) names.push_back(entry.name());
    request.set_page_token(page->next_page_token());
  } while (!request.page_token().empty());
  EXPECT_THAT(names, ElementsAre("parts/vane@1", "blades/sn1", "machines/m1@1", "calibrations/a1", "calibrations/c1",
                                 "scans/s2"));
  request.set_name("registrations/r9");
  EXPECT_EQ(runtime::ReasonOf(Call(&v1::RecordService::Stub::Trace, request).status()), "RECORD_ENTRY_NOT_FOUND");
  request.set_name("r2");
  EXPECT_EQ(Call(&v1::RecordService::Stub::Trace, request).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(RecordServiceTest, WhatWasNeverRecordedDoesNotReadAsUnused) {
  v1::RecallRequest request;
  request.set_name("calibrations/c9");
  const absl::Status refused = Call(&v1::RecordService::Stub::Recall, request).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(runtime::ReasonOf(refused), "RECORD_ENTRY_NOT_FOUND");
}

TEST_F(RecordServiceTest, ATokenHoldsForItsOwnQuestionOnly) {
  v1::RecallRequest request;
  request.set_name("machines/m1");
  request.set_page_size(1);
  const auto page = Call(&v1::RecordService::Stub::Recall, request);
  ASSERT_TRUE(page.ok()) << page.status();
  request.set_page_token(page->next_page_token());
  request.add_kinds("registration");
  EXPECT_EQ(Call(&v1::RecordService::Stub::Recall, request).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(RecordServiceTest, TheRecordOfABladeBeginsWithItselfAndComesByPages) {
  v1::GetBladeRecordRequest request;
  request.set_name("blades/sn1");
  request.set_page_size(3);
  std::vector<std::string> names;
  do {
    const auto page = Call(&v1::RecordService::Stub::GetBladeRecord, request);
    ASSERT_TRUE(page.ok()) << page.status();
    EXPECT_EQ(page->blade().part(), "parts/vane");
    for (const v1::RecordEntry& entry : page->entries()) names.push_back(entry.name());
    request.set_page_token(page->next_page_token());
  } while (!request.page_token().empty());
  EXPECT_THAT(names, ElementsAre("blades/sn1", "scans/s1", "registrations/r1", "scans/s2", "registrations/r2",
                                 "scans/s3", "registrations/r3"));
  request.set_name("blades/sn9");
  EXPECT_EQ(Call(&v1::RecordService::Stub::GetBladeRecord, request).status().code(), absl::StatusCode::kNotFound);
}

}  // namespace
}  // namespace sixpoint::plant
