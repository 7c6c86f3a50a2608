// Work orders over real gRPC on a real PostgreSQL: assigned, and carried by what is recorded after.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/plant/plant_service.h"
#include "services/plant/record_service.h"
#include "services/runtime/call.h"
#include "services/runtime/errors.h"
#include "storage/record.h"
#include "tests/support/customers_parts.h"
#include "tests/support/in_process_server.h"
#include "tests/support/registered.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::plant {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class WorkOrders : public ::testing::Test {
 protected:
  void SetUp() override {
    absl::StatusOr<storage::Transaction> transaction = database_.database()->Begin(testing::Soon());
    testing::RegisterPart(*transaction, "vane");
    ASSERT_TRUE(transaction->Commit().ok());
    v1::CreateBladeRequest request;
    request.set_serial("sn1");
    request.set_part("parts/vane");
    request.set_work_order("4711");
    request.set_request_id(storage::NewUuid());
    const auto blade = Call(*plant_stub_, &v1::PlantService::Stub::CreateBlade, request);
    ASSERT_TRUE(blade.ok()) << blade.status();
    EXPECT_EQ(blade->work_order(), "4711");
  }
  template <typename Stub, typename Request, typename Response>
  absl::StatusOr<Response> Call(Stub& stub,
                                grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                                const Request& request) {
    Response response;
    const auto context = runtime::ContextFor(20.0);
    const absl::Status status = runtime::FromGrpc((stub.*method)(context.get(), request, &response));
    if (!status.ok()) return status;
    return response;
  }
  static v1::AssignWorkOrderRequest Assignment(const std::string& work_order, const std::string& operation) {
    v1::AssignWorkOrderRequest request;
    request.set_blade("blades/sn1");
    request.set_work_order(work_order);
    request.set_operation(operation);
    request.set_request_id(storage::NewUuid());
    return request;
  }
  absl::StatusOr<v1::Blade> Assign(const v1::AssignWorkOrderRequest& request) {
    return Call(*plant_stub_, &v1::PlantService::Stub::AssignWorkOrder, request);
  }
  // What is recorded of the blade, as any service does it.
  void Record(const std::string& name, const std::string& stated = "") {
    absl::StatusOr<storage::Transaction> transaction = database_.database()->Begin(testing::Soon());
    storage::RecordEntry entry;
    entry.kind = "registration";
    entry.name = name;
    entry.blade = "sn1";
    entry.software_version = "test";
    entry.work_order = stated;
    const auto recorded = storage::AppendRecord(*transaction, storage::NewUuid(), entry);
    ASSERT_TRUE(recorded.ok()) << recorded.status();
    ASSERT_TRUE(transaction->Commit().ok());
  }
  std::vector<std::string> Names(const std::string& work_order, const std::string& operation = "",
                                 const std::vector<std::string>& kinds = {}) {
    v1::ListRecordEntriesRequest request;
    request.set_work_order(work_order);
    request.set_operation(operation);
    for (const std::string& kind : kinds) request.add_kinds(kind);
    request.set_page_size(2);
    std::vector<std::string> names;
    do {
      const auto page = Call(*record_stub_, &v1::RecordService::Stub::ListRecordEntries, request);
      EXPECT_TRUE(page.ok()) << page.status();
      if (!page.ok()) return names;
      for (const v1::RecordEntry& entry : page->entries()) {
        EXPECT_EQ(entry.work_order(), work_order);
        names.push_back(entry.kind() == "assignment" ? entry.kind() : entry.name());
      }
      request.set_page_token(page->next_page_token());
    } while (!request.page_token().empty());
    return names;
  }
  testing::ThrowawayDatabase database_;
  storage::PlantStores stores_ = storage::PlantIn(database_.database());
  PlantService plant_{PlantServiceOptions(), stores_};
  RecordService record_{stores_.journal, stores_.blades};
  testing::InProcessServer server_{{&plant_, &record_}};
  std::unique_ptr<v1::PlantService::Stub> plant_stub_ = v1::PlantService::NewStub(server_.Connect());
  std::unique_ptr<v1::RecordService::Stub> record_stub_ = v1::RecordService::NewStub(server_.Connect());
};

TEST_F(WorkOrders, WhatIsRecordedCarriesTheOneOfThen) {
  Record("registrations/r1");
  ASSERT_TRUE(Assign(Assignment("4711", "0030")).ok());
  Record("registrations/r2");
  const auto rework = Assign(Assignment("4790", ""));
  ASSERT_TRUE(rework.ok()) << rework.status();
  EXPECT_EQ(rework->work_order(), "4790");
  EXPECT_EQ(rework->operation(), "");
  Record("registrations/r3");
  Record("registrations/r4", "4711");
  EXPECT_THAT(Names("4711"),
              ElementsAre("blades/sn1", "registrations/r1", "assignment", "registrations/r2", "registrations/r4"));
  EXPECT_THAT(Names("4711", "0030"), ElementsAre("assignment", "registrations/r2"));
  EXPECT_THAT(Names("4790", "", {"registration"}), ElementsAre("registrations/r3"));
  EXPECT_THAT(Names("4712"), IsEmpty());
  v1::ListRecordEntriesRequest span;
  span.set_work_order("4711");
  v1::GetRecordEntryRequest second;
  second.set_name("registrations/r2");
  const auto at = Call(*record_stub_, &v1::RecordService::Stub::GetRecordEntry, second);
  ASSERT_TRUE(at.ok()) << at.status();
  *span.mutable_recorded()->mutable_from() = at->recorded_at();
  const auto later = Call(*record_stub_, &v1::RecordService::Stub::ListRecordEntries, span);
  ASSERT_TRUE(later.ok()) << later.status();
  ASSERT_EQ(later->entries_size(), 2);
  EXPECT_EQ(later->entries(0).name(), "registrations/r2");
  span.mutable_recorded()->mutable_until()->set_seconds(at->recorded_at().seconds() - 1);
  EXPECT_EQ(Call(*record_stub_, &v1::RecordService::Stub::ListRecordEntries, span).status().code(),
            absl::StatusCode::kInvalidArgument);
}

TEST_F(WorkOrders, BladesAreFoundByTheOneThatWasAssignedLast) {
  const auto of = [&](const std::string& work_order) {
    v1::ListBladesRequest request;
    request.set_work_order(work_order);
    std::vector<std::string> names;
    const auto page = Call(*plant_stub_, &v1::PlantService::Stub::ListBlades, request);
    EXPECT_TRUE(page.ok()) << page.status();
    if (page.ok())
      for (const v1::Blade& blade : page->blades()) names.push_back(blade.name());
    return names;
  };
  EXPECT_THAT(of("4711"), ElementsAre("blades/sn1"));
  ASSERT_TRUE(Assign(Assignment("4790", "0010")).ok());
  EXPECT_THAT(of("4711"), IsEmpty());
  EXPECT_THAT(of("4790"), ElementsAre("blades/sn1"));
}

TEST_F(WorkOrders, TheSameRequestAssignsOnce) {
  const v1::AssignWorkOrderRequest request = Assignment("4790", "");
  ASSERT_TRUE(Assign(request).ok());
  ASSERT_TRUE(Assign(Assignment("4800", "")).ok());
  const auto again = Assign(request);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->work_order(), "4800") << "as it stands now";
  EXPECT_THAT(Names("4790"), ElementsAre("assignment"));
}

TEST_F(WorkOrders, ABladeThatIsThereIsNotGivenAnotherByCreatingIt) {
  v1::CreateBladeRequest request;
  request.set_serial("sn1");
  request.set_part("parts/vane");
  const auto create = [&](const std::string& work_order, const std::string& operation) {
    request.set_work_order(work_order);
    request.set_operation(operation);
    request.set_request_id(storage::NewUuid());
    return Call(*plant_stub_, &v1::PlantService::Stub::CreateBlade, request);
  };
  EXPECT_TRUE(create("", "").ok());
  const auto same = create("4711", "");
  ASSERT_TRUE(same.ok()) << same.status();
  const v1::CreateBladeRequest answered = request;
  const absl::Status other = create("4790", "0010").status();
  EXPECT_TRUE(absl::IsAlreadyExists(other)) << other;
  EXPECT_EQ(other.message(),
            "work_order: 4790 operation 0010, want 4711, which blade sn1 already has: another is assigned by "
            "AssignWorkOrder");
  EXPECT_TRUE(absl::IsAlreadyExists(create("4711", "0010").status()));
  ASSERT_TRUE(Assign(Assignment("4790", "0010")).ok());
  EXPECT_TRUE(create("4790", "").ok());
  const auto again = Call(*plant_stub_, &v1::PlantService::Stub::CreateBlade, answered);
  ASSERT_TRUE(again.ok()) << "the same request again: " << again.status();
  EXPECT_EQ(again->work_order(), "4790");
}

TEST_F(WorkOrders, WhatIsNoneIsRefused) {
  for (const auto& [work_order, operation] : std::vector<std::pair<std::string, std::string>>{
           {"", ""}, {"47 11", ""}, {"4711\n", ""}, {"4711", "a;b"}, {std::string(65, '4'), ""}})
    EXPECT_EQ(Assign(Assignment(work_order, operation)).status().code(), absl::StatusCode::kInvalidArgument)
        << work_order;
  v1::AssignWorkOrderRequest request = Assignment("4711", "");
  request.set_blade("blades/none");
  EXPECT_EQ(runtime::ReasonOf(Assign(request).status()), "BLADE_NOT_FOUND");
  v1::ListRecordEntriesRequest list;
  EXPECT_EQ(Call(*record_stub_, &v1::RecordService::Stub::ListRecordEntries, list).status().code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace sixpoint::plant
