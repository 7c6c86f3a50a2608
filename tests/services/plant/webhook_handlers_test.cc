// The handlers of webhooks on a fake store and a fake journal: no PostgreSQL. What is sent to them is webhook_sender_test.cc's.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "services/plant/webhook_service.h"
#include "services/runtime/time_proto.h"
#include "tests/services/plant/http_receiver.h"
#include "tests/support/becomes.h"
#include "tests/support/call.h"
#include "tests/support/fake_events.h"
#include "tests/support/fake_webhooks.h"
#include "tests/support/in_process_server.h"
#include "tests/support/some_uuid.h"

namespace sixpoint::plant {
namespace {

using sixpoint::testing::kSomeUuid;
using testing::Becomes;
using testing::Call;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::HttpReceiver;
using WebhookStub = v1::WebhookService::Stub;

constexpr char kNowhere[] = "http://127.0.0.1:1/in?token=hush";

v1::CreateWebhookRequest CreationOf(const std::string& id, const std::string& url = kNowhere,
                                    const std::string& request_id = storage::NewUuid()) {
  v1::CreateWebhookRequest request;
  request.set_webhook_id(id);
  request.set_url(url);
  request.set_request_id(request_id);
  return request;
}

v1::WithdrawWebhookRequest WithdrawalOf(const std::string& name, const std::string& request_id = storage::NewUuid()) {
  v1::WithdrawWebhookRequest request;
  request.set_name(name);
  request.set_request_id(request_id);
  return request;
}

class WebhookHandlersTest : public ::testing::Test {
 protected:
  absl::StatusOr<v1::CreateWebhookResponse> Create(const v1::CreateWebhookRequest& request) {
    return Call(*stub_, &WebhookStub::CreateWebhook, request);
  }
  absl::StatusOr<v1::Webhook> Withdraw(const std::string& name) {
    return Call(*stub_, &WebhookStub::WithdrawWebhook, WithdrawalOf(name));
  }
  absl::StatusOr<v1::Webhook> Get(const std::string& name) {
    v1::GetWebhookRequest request;
    request.set_name(name);
    return Call(*stub_, &WebhookStub::GetWebhook, request);
  }
  absl::StatusOr<v1::ListWebhooksResponse> List(const v1::ListWebhooksRequest& request = {}) {
    return Call(*stub_, &WebhookStub::ListWebhooks, request);
  }
  absl::StatusOr<v1::TestWebhookResponse> Try(const std::string& name) {
    v1::TestWebhookRequest request;
    request.set_name(name);
    request.set_request_id(kSomeUuid);
    return Call(*stub_, &WebhookStub::TestWebhook, request);
  }
  // Eve's, of kappa's part and blade.
  void PutOfEve(const std::string& id, const std::string& request_id = storage::NewUuid()) {
    storage::WebhookRow row;
    row.webhook_id = id;
    row.url = kNowhere;
    row.filter.blade_serial = "kappa-sn";
    row.filter.part_id = "kappa-part";
    row.filter.machine_id = "m1";
    row.secret = std::string(32, 'k');
    row.reader.identity = row.requested_by = "users/eve";
    row.request_id = request_id;
    const auto made = store_->Create(row, [] { return true; }, {});
    ASSERT_TRUE(made.ok()) << made.status();
  }
  void Record(int count) {
    for (int i = 0; i < count; ++i) journal_->Record("policy", "policies/p" + std::to_string(i));
  }
  std::vector<storage::WebhookRow> Kept() {
    return store_->List(true, "", 100, storage::Reader::Everything(), {}).value_or(std::vector<storage::WebhookRow>());
  }
  // One that nobody has to send to: it only tests.
  std::unique_ptr<WebhookSender> Tester() {
    const auto none = std::make_shared<testing::FakeWebhooks>();
    return std::make_unique<WebhookSender>(none, none, journal_, std::make_shared<EventTail>(journal_));
  }

  const std::shared_ptr<testing::FakeWebhooks> store_ = std::make_shared<testing::FakeWebhooks>();
  const std::shared_ptr<testing::FakeEvents> journal_ = std::make_shared<testing::FakeEvents>();
  WebhookService service_{store_, journal_, Tester()};
  testing::InProcessServer server_{{&service_}};
  const std::unique_ptr<WebhookStub> stub_ = v1::WebhookService::NewStub(server_.Connect());
};

TEST_F(WebhookHandlersTest, WhatIsMadeIsAnsweredWithItsSecretAndFoundWithoutIt) {
  Record(3);
  v1::CreateWebhookRequest request = CreationOf("mes");
  request.set_from_now(true);
  request.set_after_sequence(99);  // means nothing then
  v1::EventFilter* const filter = request.mutable_filter();
  filter->add_kinds("inspection");
  filter->add_verdicts("NOT_CONFORM");
  filter->set_machine("machines/m1");
  filter->set_blade("blades/sn1");
  filter->set_part("parts/vane");
  const auto made = Create(request);
  ASSERT_TRUE(made.ok()) << made.status();
  const v1::Webhook& webhook = made->webhook();
  EXPECT_EQ(webhook.name(), "webhooks/mes");
  EXPECT_EQ(webhook.url(), kNowhere);
  EXPECT_EQ(webhook.filter().SerializeAsString(), request.filter().SerializeAsString());
  EXPECT_TRUE(webhook.has_created_at());
  EXPECT_THAT(webhook.requested_by(), HasSubstr("127.0.0.1"));  // without a certificate, the address
  EXPECT_FALSE(webhook.has_withdrawn_at());
  EXPECT_EQ(webhook.looked_at_sequence(), 3);
  EXPECT_EQ(webhook.lag_count(), 0);
  ASSERT_EQ(Kept().size(), 1u);
  EXPECT_EQ(Kept()[0].secret.size(), 32u);
  EXPECT_EQ(made->secret(), SecretText(Kept()[0].secret));

  const auto got = Get("webhooks/mes");
  ASSERT_TRUE(got.ok()) << got.status();
  EXPECT_EQ(got->SerializeAsString(), webhook.SerializeAsString());
  Record(2);
  EXPECT_EQ(Get("webhooks/mes")->lag_count(), 2);
  request = CreationOf("other");
  request.set_after_sequence(1);
  const auto from_first = Create(request);
  ASSERT_TRUE(from_first.ok()) << from_first.status();
  EXPECT_EQ(from_first->webhook().looked_at_sequence(), 1);
  EXPECT_EQ(from_first->webhook().lag_count(), 4);
  EXPECT_NE(from_first->secret(), made->secret());
}

TEST_F(WebhookHandlersTest, ARetryGetsTheSameSecretAndAnotherRequestIsRefused) {
  const v1::CreateWebhookRequest request = CreationOf("mes", kNowhere, kSomeUuid);
  const auto made = Create(request);
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(Create(request)->SerializeAsString(), made->SerializeAsString());
  ASSERT_TRUE(Withdraw("webhooks/mes").ok());
  const auto late = Create(request);
  ASSERT_TRUE(late.ok()) << late.status();
  EXPECT_TRUE(late->webhook().has_withdrawn_at());
  EXPECT_EQ(late->secret(), made->secret());

  v1::CreateWebhookRequest filtered = request;
  filtered.mutable_filter()->add_kinds("scan");
  for (const v1::CreateWebhookRequest& other :
       {CreationOf("other", kNowhere, kSomeUuid), CreationOf("mes", "http://127.0.0.1:2/", kSomeUuid), filtered})
    EXPECT_EQ(runtime::ReasonOf(Create(other).status()), "REQUEST_ID_REUSED");
  EXPECT_EQ(Kept().size(), 1u);
  // Of another, whatever somebody learned of it: the answer would tell the secret.
  const std::string eves_request = storage::NewUuid();
  PutOfEve("eves", eves_request);
  v1::CreateWebhookRequest stolen = CreationOf("eves", kNowhere, eves_request);
  stolen.mutable_filter()->set_blade("blades/kappa-sn");
  stolen.mutable_filter()->set_part("parts/kappa-part");
  stolen.mutable_filter()->set_machine("machines/m1");
  EXPECT_EQ(runtime::ReasonOf(Create(stolen).status()), "REQUEST_ID_REUSED");
}

TEST_F(WebhookHandlersTest, ANameIsGivenOnceForEverAndNoMoreThanMayHoldAreMade) {
  for (int i = 0; i < storage::kMostWebhooks; ++i) ASSERT_TRUE(Create(CreationOf("w" + std::to_string(i))).ok()) << i;
  EXPECT_EQ(runtime::ReasonOf(Create(CreationOf("more")).status()), "WEBHOOKS_FULL");
  EXPECT_EQ(runtime::ReasonOf(Create(CreationOf("w3")).status()), "WEBHOOK_EXISTS");
  ASSERT_TRUE(Withdraw("webhooks/w3").ok());
  const absl::Status given = Create(CreationOf("w3")).status();
  EXPECT_EQ(runtime::ReasonOf(given), "WEBHOOK_EXISTS");
  EXPECT_THAT(std::string(given.message()), HasSubstr("webhook_id: w3 is given"));
  EXPECT_TRUE(Create(CreationOf("more")).ok());
}

TEST_F(WebhookHandlersTest, AllThatIsWrongIsToldAtOnceAndNothingIsMade) {
  Record(3);
  v1::CreateWebhookRequest request = CreationOf("a b", "ftp://mes.example/");
  request.mutable_filter()->set_machine("m1");
  request.mutable_filter()->add_kinds("scan");
  request.mutable_filter()->add_kinds("inspektion");
  request.mutable_filter()->add_verdicts("conform");
  request.set_after_sequence(4);
  const std::vector<Violation> refused = ViolationsOf(Create(request).status());
  std::vector<std::string> fields;
  for (const Violation& violation : refused) fields.push_back(violation.field);
  EXPECT_THAT(fields, ElementsAre("webhook_id", "url", "filter.machine", "filter.kinds[1]", "filter.verdicts[0]",
                                  "after_sequence"));
  EXPECT_THAT(refused, Contains(Violation{"url", "ftp://mes.example/",
                                          "http:// or https:// with a host, without a user and a password"}));
  EXPECT_THAT(refused, Contains(Violation{"after_sequence", "4", "0 to 3, the newest entry of this plant's journal"}));
  request = CreationOf("mes");
  request.set_after_sequence(-1);
  EXPECT_EQ(Create(request).status().code(), absl::StatusCode::kInvalidArgument);
  for (const char* request_id : {"", "one"})
    EXPECT_EQ(Create(CreationOf("mes", kNowhere, request_id)).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_TRUE(Kept().empty());
}

TEST_F(WebhookHandlersTest, WhatIsWithdrawnStaysAsItWasWithdrawnFirst) {
  Record(2);
  ASSERT_TRUE(Create(CreationOf("mes")).ok());
  const auto withdrawn = Withdraw("webhooks/mes");
  ASSERT_TRUE(withdrawn.ok()) << withdrawn.status();
  EXPECT_EQ(withdrawn->name(), "webhooks/mes");
  EXPECT_EQ(withdrawn->url(), kNowhere);
  EXPECT_TRUE(withdrawn->has_withdrawn_at());
  EXPECT_THAT(withdrawn->withdrawn_by(), HasSubstr("127.0.0.1"));
  EXPECT_EQ(withdrawn->lag_count(), 0);  // nothing is left to be sent
  EXPECT_EQ(Withdraw("webhooks/mes")->SerializeAsString(), withdrawn->SerializeAsString());
  EXPECT_EQ(Get("webhooks/mes")->withdrawn_at().seconds(), withdrawn->withdrawn_at().seconds());
  EXPECT_EQ(Call(*stub_, &WebhookStub::WithdrawWebhook, WithdrawalOf("webhooks/mes", "one")).status().code(),
            absl::StatusCode::kInvalidArgument);
}

TEST_F(WebhookHandlersTest, WhatIsNoWebhookIsNotFoundAndWhatIsNoNameRefused) {
  ASSERT_TRUE(Create(CreationOf("mes")).ok());
  const auto on_all = [&](const std::string& name) {
    return std::vector<absl::Status>{Get(name).status(), Withdraw(name).status(), Try(name).status()};
  };
  for (const absl::Status& refused : on_all("webhooks/none")) {
    EXPECT_EQ(runtime::ReasonOf(refused), "WEBHOOK_NOT_FOUND");
    EXPECT_EQ(runtime::MetadataOf(refused)["resource"], "webhooks/none");
  }
  for (const char* name : {"", "mes", "webhooks/", "machines/mes"})
    for (const absl::Status& refused : on_all(name)) {
      const std::vector<Violation> violations = ViolationsOf(refused);
      ASSERT_EQ(violations.size(), 1u) << name << ": " << refused;
      EXPECT_EQ(violations[0].field, "name");
    }
  EXPECT_FALSE(Get("webhooks/mes")->has_withdrawn_at());
}

TEST_F(WebhookHandlersTest, SaysHowFarItHasComeAndSinceWhenItFails) {
  Record(9);
  ASSERT_TRUE(Create(CreationOf("mes")).ok());
  const storage::Instant delivered_at(std::chrono::seconds(1'700'000'000)),
      failing_since = delivered_at + std::chrono::minutes(5);
  storage::WebhookDelivery delivery;
  delivery.looked_at_sequence = 7;
  delivery.delivered_sequence = 5;
  delivery.delivered_at = delivered_at;
  delivery.failing_since = failing_since;
  delivery.failure_count = 3;
  delivery.last_failure = "HTTP 503, want 200 to 299";
  ASSERT_TRUE(store_->Save("mes", delivery, {}).ok());
  const auto got = Get("webhooks/mes");
  ASSERT_TRUE(got.ok()) << got.status();
  EXPECT_EQ(got->looked_at_sequence(), 7);
  EXPECT_EQ(got->delivered_sequence(), 5);
  EXPECT_EQ(runtime::MomentOf(got->delivered_at()), delivered_at);
  EXPECT_EQ(got->lag_count(), 2);
  EXPECT_EQ(runtime::MomentOf(got->failing_since()), failing_since);
  EXPECT_EQ(got->failure_count(), 3);
  EXPECT_EQ(got->last_failure(), "HTTP 503, want 200 to 299");
  EXPECT_EQ(List()->webhooks(0).SerializeAsString(), got->SerializeAsString());
}

TEST_F(WebhookHandlersTest, AreListedByNameAndByPages) {
  for (const char* id : {"c", "a", "d", "b"}) ASSERT_TRUE(Create(CreationOf(id)).ok());
  ASSERT_TRUE(Withdraw("webhooks/b").ok());
  v1::ListWebhooksRequest request;
  request.set_page_size(2);
  const auto first = List(request);
  ASSERT_TRUE(first.ok()) << first.status();
  ASSERT_EQ(first->webhooks_size(), 2);
  EXPECT_EQ(first->webhooks(0).name(), "webhooks/a");
  EXPECT_EQ(first->webhooks(1).name(), "webhooks/c");
  request.set_page_token(first->next_page_token());
  const auto second = List(request);
  ASSERT_TRUE(second.ok()) << second.status();
  ASSERT_EQ(second->webhooks_size(), 1);
  EXPECT_EQ(second->webhooks(0).name(), "webhooks/d");
  EXPECT_EQ(second->next_page_token(), "");
  // A token is of its own list.
  request.set_withdrawn_too(true);
  EXPECT_EQ(List(request).status().code(), absl::StatusCode::kInvalidArgument);
  request.Clear();
  request.set_withdrawn_too(true);
  const auto all = List(request);
  ASSERT_TRUE(all.ok()) << all.status();
  ASSERT_EQ(all->webhooks_size(), 4);
  EXPECT_TRUE(all->webhooks(1).has_withdrawn_at());
  request.set_page_size(-1);
  EXPECT_EQ(List(request).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(WebhookHandlersTest, OthersAreToldNeitherTokensNorWhatIsHiddenFromThem) {
  store_->clearances.customers["kappa-part"] = "kappa";
  store_->clearances.part_of["parts/kappa-part"] = store_->clearances.part_of["blades/kappa-sn"] = "kappa-part";
  PutOfEve("mes");
  const auto listed = List();
  ASSERT_TRUE(listed.ok() && listed->webhooks_size() == 1) << listed.status();
  const auto got = Get("webhooks/mes"), withdrawn = Withdraw("webhooks/mes");
  ASSERT_TRUE(got.ok() && withdrawn.ok()) << got.status() << withdrawn.status();
  for (const v1::Webhook& told : {listed->webhooks(0), *got, *withdrawn}) {
    EXPECT_EQ(told.url(), "http://127.0.0.1:1/in");
    EXPECT_EQ(told.filter().part() + told.filter().blade(), "");
    EXPECT_EQ(told.filter().machine(), "machines/m1");
    EXPECT_EQ(told.requested_by(), "users/eve");
  }
  // What is hidden from nobody is told, and the token all the same is not.
  store_->clearances.customers.clear();
  EXPECT_EQ(Kept().at(0).filter.part_id, "kappa-part");
  EXPECT_EQ(Get("webhooks/mes")->filter().blade(), "blades/kappa-sn");
  EXPECT_EQ(Get("webhooks/mes")->filter().part(), "parts/kappa-part");
  EXPECT_EQ(Get("webhooks/mes")->url(), "http://127.0.0.1:1/in");
}

TEST_F(WebhookHandlersTest, ATestPostsOneEventAndChangesNothing) {
  HttpReceiver receiver;
  Record(1);
  ASSERT_TRUE(Create(CreationOf("mes", receiver.url())).ok());
  const auto taken = Try("webhooks/mes");
  ASSERT_TRUE(taken.ok()) << taken.status();
  EXPECT_TRUE(taken->is_taken());
  EXPECT_EQ(taken->http_status(), 204);
  ASSERT_EQ(receiver.posted().size(), 1u);
  const auto sent = nlohmann::json::parse(receiver.posted()[0].body);
  ASSERT_EQ(sent.size(), 1u);
  EXPECT_EQ(sent[0]["type"], "sixpoint.webhook.test");
  EXPECT_EQ(sent[0]["id"], kSomeUuid);
  EXPECT_EQ(sent[0]["source"], "urn:uuid:" + journal_->Now({})->plant_id);
  receiver.Answer(500);
  const auto refused = Try("webhooks/mes");
  ASSERT_TRUE(refused.ok()) << refused.status();
  EXPECT_FALSE(refused->is_taken());
  EXPECT_EQ(refused->failure(), "HTTP 500, want 200 to 299");
  EXPECT_EQ(Get("webhooks/mes")->failure_count(), 0);
  EXPECT_EQ(Get("webhooks/mes")->looked_at_sequence(), 0);

  ASSERT_TRUE(Withdraw("webhooks/mes").ok());
  const absl::Status withdrawn = Try("webhooks/mes").status();
  EXPECT_EQ(runtime::ReasonOf(withdrawn), "WEBHOOK_WITHDRAWN");
  EXPECT_EQ(runtime::MetadataOf(withdrawn)["resource"], "webhooks/mes");
  EXPECT_EQ(receiver.posted().size(), 2u);
}

TEST_F(WebhookHandlersTest, NothingOfTheStoreIsHeldWhileATestWaitsForItsAnswer) {
  HttpReceiver receiver;
  receiver.Answer(0);
  ASSERT_TRUE(Create(CreationOf("mes", receiver.url())).ok());
  std::thread waiting([&] { EXPECT_TRUE(Try("webhooks/mes").ok()); });
  EXPECT_TRUE(Becomes(std::chrono::seconds(10), [&] { return receiver.posted().size() == 1; }));
  EXPECT_TRUE(Withdraw("webhooks/mes").ok());
  receiver.Answer(204);
  waiting.join();
}

TEST_F(WebhookHandlersTest, AStoreOrAJournalThatFailsComesToTheClient) {
  HttpReceiver receiver;
  ASSERT_TRUE(Create(CreationOf("mes", receiver.url())).ok());
  const auto code_of = [](const auto& answer) { return answer.status().code(); };
  store_->commits.Fail(absl::UnavailableError("database: away"));
  for (const absl::StatusCode code : {code_of(Create(CreationOf("other"))), code_of(Withdraw("webhooks/mes")),
                                      code_of(Get("webhooks/mes")), code_of(List()), code_of(Try("webhooks/mes"))})
    EXPECT_EQ(code, absl::StatusCode::kUnavailable);
  store_->commits.Fail(absl::OkStatus());
  journal_->Fail(absl::UnavailableError("database: away"));
  for (const absl::StatusCode code : {code_of(Create(CreationOf("other"))), code_of(Get("webhooks/mes")),
                                      code_of(List()), code_of(Try("webhooks/mes"))})
    EXPECT_EQ(code, absl::StatusCode::kUnavailable);
  EXPECT_TRUE(Withdraw("webhooks/mes").ok());  // asks the journal nothing
  EXPECT_EQ(Kept().size(), 1u);
  EXPECT_TRUE(receiver.posted().empty());
}

TEST_F(WebhookHandlersTest, NothingIsMadeOrWithdrawnForAClientThatIsGone) {
  ASSERT_TRUE(Create(CreationOf("mes")).ok());
  std::unique_ptr<grpc::ClientContext> context = runtime::ContextFor(60);
  store_->commits.BeforeCommit([&](const storage::StillWanted& still_wanted) {
    context->TryCancel();
    EXPECT_TRUE(Becomes(std::chrono::seconds(30), [&] { return !still_wanted(); }));
  });
  v1::CreateWebhookResponse created;
  EXPECT_EQ(stub_->CreateWebhook(context.get(), CreationOf("other"), &created).error_code(),
            grpc::StatusCode::CANCELLED);
  EXPECT_EQ(Kept().size(), 1u);
  context = runtime::ContextFor(60);
  v1::Webhook withdrawn;
  EXPECT_EQ(stub_->WithdrawWebhook(context.get(), WithdrawalOf("webhooks/mes"), &withdrawn).error_code(),
            grpc::StatusCode::CANCELLED);
  store_->commits.BeforeCommit(nullptr);
  EXPECT_FALSE(Get("webhooks/mes")->has_withdrawn_at());
  EXPECT_TRUE(Create(CreationOf("other")).ok());
}

}  // namespace
}  // namespace sixpoint::plant
