// The handlers of clearances on a fake store: no PostgreSQL.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "services/plant/clearance_service.h"
#include "tests/support/becomes.h"
#include "tests/support/call.h"
#include "tests/support/fake_clearance_store.h"
#include "tests/support/in_process_server.h"
#include "tests/support/some_uuid.h"

namespace sixpoint::plant {
namespace {

using sixpoint::testing::kSomeUuid;
using testing::Call;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ClearanceStub = v1::ClearanceService::Stub;

template <typename Request>
Request ClearanceRequest(const std::string& holder, const std::string& scope, const std::string& request_id) {
  Request request;
  request.set_holder(holder);
  request.set_scope(scope);
  request.set_request_id(request_id);
  return request;
}

class ClearanceHandlersTest : public ::testing::Test {
 protected:
  absl::StatusOr<v1::Clearance> Grant(const std::string& holder, const std::string& scope,
                                      const std::string& request_id = storage::NewUuid()) {
    return Call(*stub_, &ClearanceStub::GrantClearance,
                ClearanceRequest<v1::GrantClearanceRequest>(holder, scope, request_id));
  }
  absl::StatusOr<v1::Clearance> Withdraw(const std::string& holder, const std::string& scope,
                                         const std::string& request_id = storage::NewUuid()) {
    return Call(*stub_, &ClearanceStub::WithdrawClearance,
                ClearanceRequest<v1::WithdrawClearanceRequest>(holder, scope, request_id));
  }
  absl::StatusOr<v1::ListClearancesResponse> List(const v1::ListClearancesRequest& request = {}) {
    return Call(*stub_, &ClearanceStub::ListClearances, request);
  }
  std::size_t KeptCount() {
    return store_->List({"", "", true}, 0, 100, {}).value_or(std::vector<storage::ClearanceRow>()).size();
  }

  std::shared_ptr<testing::FakeClearanceStore> store_ = std::make_shared<testing::FakeClearanceStore>();
  ClearanceService service_{store_};
  testing::InProcessServer server_{{&service_}};
  std::unique_ptr<ClearanceStub> stub_ = v1::ClearanceService::NewStub(server_.Connect());
};

TEST_F(ClearanceHandlersTest, WhatIsGrantedIsAnsweredWithWhoGrantedItAndWhoWithdrewIt) {
  const auto granted = Grant("users/jane", "customers/acme");
  ASSERT_TRUE(granted.ok()) << granted.status();
  EXPECT_EQ(granted->holder(), "users/jane");
  EXPECT_EQ(granted->scope(), "customers/acme");
  EXPECT_TRUE(granted->has_granted_at());
  EXPECT_THAT(granted->granted_by(), HasSubstr("127.0.0.1"));  // without a certificate, the address
  EXPECT_FALSE(granted->has_withdrawn_at());
  const auto withdrawn = Withdraw("users/jane", "customers/acme");
  ASSERT_TRUE(withdrawn.ok()) << withdrawn.status();
  EXPECT_TRUE(withdrawn->has_withdrawn_at());
  EXPECT_THAT(withdrawn->withdrawn_by(), HasSubstr("127.0.0.1"));
  EXPECT_EQ(withdrawn->granted_at().SerializeAsString(), granted->granted_at().SerializeAsString());
}

TEST_F(ClearanceHandlersTest, ARetryGetsWhatStandsAndAnotherRequestIsRefused) {
  const auto granted = Grant("users/jane", "parts/vane", kSomeUuid);
  ASSERT_TRUE(granted.ok()) << granted.status();
  EXPECT_EQ(Grant("users/jane", "parts/vane", kSomeUuid)->SerializeAsString(), granted->SerializeAsString());
  ASSERT_TRUE(Withdraw("users/jane", "parts/vane").ok());
  EXPECT_TRUE(Grant("users/jane", "parts/vane", kSomeUuid)->has_withdrawn_at());
  EXPECT_EQ(List()->clearances_size(), 0);
  for (const absl::Status& refused :
       {Grant("users/joe", "parts/vane", kSomeUuid).status(), Withdraw("users/jane", "parts/vane", kSomeUuid).status()})
    EXPECT_EQ(runtime::ReasonOf(refused), "REQUEST_ID_REUSED");
  EXPECT_EQ(KeptCount(), 1u);
}

TEST_F(ClearanceHandlersTest, WhatWasNeverGrantedIsNotFound) {
  ASSERT_TRUE(Grant("users/jane", "parts/vane").ok());
  const absl::Status refused = Withdraw("users/jane", "parts/blade").status();
  EXPECT_EQ(runtime::ReasonOf(refused), "CLEARANCE_NOT_FOUND");
  EXPECT_EQ(runtime::MetadataOf(refused)["resource"], "users/jane");
  EXPECT_THAT(std::string(refused.message()), HasSubstr("of users/jane for parts/blade, want one that was granted"));
}

TEST_F(ClearanceHandlersTest, WhoMayHoldOneIsAUserAMachineOrALoginThatReads) {
  const std::string longest = "readers/" + std::string(63, 'a');
  for (const std::string& holder :
       {std::string("users/jane"), std::string("machines/m1"), std::string("readers/mes_1"), longest})
    EXPECT_TRUE(Grant(holder, "parts/vane").ok()) << holder;
  constexpr char kWanted[] = "users/NAME, machines/ID or readers/LOGIN";
  for (const std::string& holder :
       {std::string("jane"), std::string("users/"), std::string("services/plant"), std::string("readers/"),
        std::string("readers/1st"), std::string("readers/MES"), std::string("readers/a-b")}) {
    const std::vector<Violation> expected{{"holder", holder, kWanted}};
    EXPECT_EQ(ViolationsOf(Grant(holder, "parts/vane").status()), expected) << holder;
    EXPECT_EQ(ViolationsOf(Withdraw(holder, "parts/vane").status()), expected) << holder;
    v1::ListClearancesRequest request;
    request.set_holder(holder);
    EXPECT_EQ(ViolationsOf(List(request).status()), expected) << holder;
  }
  EXPECT_EQ(Grant(longest + "a", "parts/vane").status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(KeptCount(), 4u);
}

TEST_F(ClearanceHandlersTest, AScopeIsACustomerOrAPartAndAllRefusalsComeAtOnce) {
  const Violation scope{"scope", "blades/sn1", "customers/ID or parts/ID"};
  EXPECT_THAT(ViolationsOf(Grant("users/jane", "blades/sn1").status()), ElementsAre(scope));
  EXPECT_THAT(ViolationsOf(Withdraw("jane", "blades/sn1").status()),
              ElementsAre(Violation{"holder", "jane", "users/NAME, machines/ID or readers/LOGIN"}, scope));
  v1::ListClearancesRequest request;
  request.set_scope("blades/sn1");
  EXPECT_THAT(ViolationsOf(List(request).status()), ElementsAre(scope));
  for (const char* none : {"parts/", "customers/", "parts/a b"})
    EXPECT_EQ(Grant("users/jane", none).status().code(), absl::StatusCode::kInvalidArgument) << none;
  EXPECT_EQ(KeptCount(), 0u);
}

TEST_F(ClearanceHandlersTest, AreListedByPagesAndFilters) {
  for (const char* scope : {"parts/a", "parts/b", "parts/c"}) ASSERT_TRUE(Grant("users/jane", scope).ok());
  ASSERT_TRUE(Grant("users/joe", "parts/a").ok());
  ASSERT_TRUE(Withdraw("users/jane", "parts/b").ok());
  v1::ListClearancesRequest request;
  request.set_page_size(2);
  const auto first = List(request);
  ASSERT_TRUE(first.ok()) << first.status();
  ASSERT_EQ(first->clearances_size(), 2);
  EXPECT_EQ(first->clearances(0).holder(), "users/joe");
  EXPECT_EQ(first->clearances(1).scope(), "parts/c");
  request.set_page_token(first->next_page_token());
  const auto second = List(request);
  ASSERT_TRUE(second.ok()) << second.status();
  ASSERT_EQ(second->clearances_size(), 1);
  EXPECT_EQ(second->clearances(0).scope(), "parts/a");
  EXPECT_EQ(second->next_page_token(), "");
  // A token is of its own list.
  request.set_withdrawn_too(true);
  EXPECT_EQ(List(request).status().code(), absl::StatusCode::kInvalidArgument);
  request.Clear();
  request.set_holder("users/jane");
  EXPECT_EQ(List(request)->clearances_size(), 2);
  request.set_withdrawn_too(true);
  EXPECT_EQ(List(request)->clearances_size(), 3);
  request.set_scope("parts/b");
  ASSERT_EQ(List(request)->clearances_size(), 1);
  EXPECT_TRUE(List(request)->clearances(0).has_withdrawn_at());
  request.set_page_size(-1);
  EXPECT_EQ(List(request).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(ClearanceHandlersTest, AStoreThatFailsComesToTheClient) {
  store_->commits.Fail(absl::UnavailableError("database: away"));
  EXPECT_EQ(Grant("users/jane", "parts/vane").status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(Withdraw("users/jane", "parts/vane").status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(List().status().code(), absl::StatusCode::kUnavailable);
}

TEST_F(ClearanceHandlersTest, NothingIsGrantedOrWithdrawnForAClientThatIsGone) {
  ASSERT_TRUE(Grant("users/jane", "parts/a").ok());
  std::unique_ptr<grpc::ClientContext> context = runtime::ContextFor(60);
  store_->commits.BeforeCommit([&](const storage::StillWanted& still_wanted) {
    context->TryCancel();
    EXPECT_TRUE(testing::Becomes(std::chrono::seconds(30), [&] { return !still_wanted(); }));
  });
  v1::Clearance response;
  const auto grant = ClearanceRequest<v1::GrantClearanceRequest>("users/jane", "parts/b", storage::NewUuid());
  EXPECT_EQ(stub_->GrantClearance(context.get(), grant, &response).error_code(), grpc::StatusCode::CANCELLED);
  EXPECT_EQ(KeptCount(), 1u);
  context = runtime::ContextFor(60);
  const auto withdrawal = ClearanceRequest<v1::WithdrawClearanceRequest>("users/jane", "parts/a", storage::NewUuid());
  EXPECT_EQ(stub_->WithdrawClearance(context.get(), withdrawal, &response).error_code(), grpc::StatusCode::CANCELLED);
  EXPECT_EQ(store_->List({}, 0, 100, {})->size(), 1u);
}

}  // namespace
}  // namespace sixpoint::plant
