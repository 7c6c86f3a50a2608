// Events posted to a receiver, on a real PostgreSQL and over real HTTP: at least once, in order, signed, and nothing else.
#include <absl/strings/escaping.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "identity/message_code.h"
#include "services/plant/event_service.h"
#include "services/plant/webhook_service.h"
#include "services/runtime/errors.h"
#include "tests/services/plant/http_receiver.h"
#include "tests/support/becomes.h"
#include "tests/support/call.h"
#include "tests/support/customers_parts.h"
#include "tests/support/in_process_server.h"
#include "tests/support/registered.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::plant {
namespace {

using namespace std::chrono_literals;
using testing::Becomes;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::HttpReceiver;
using ::testing::IsEmpty;
using ::testing::Not;

// RFC 4231, test case 2.
TEST(MessageCode, IsHmacSha256) {
  EXPECT_EQ(absl::BytesToHexString(identity::MessageCode("Jefe", "what do ya want for nothing?")),
            "5bdcc146bf60754e6a042426089575c75a003f089d2739839dec58b964ec3843");
  EXPECT_NE(identity::NewMessageKey(), identity::NewMessageKey());
  EXPECT_EQ(identity::NewMessageKey().size(), 32u);
}

TEST(WebhookPost, AnAddressIsHttpWithAHostAndNoPassword) {
  for (const char* url : {"https://mes.example/a?b=c", "http://10.1.2.3:8080", "http://[fd00::1]/x"})
    EXPECT_EQ(WrongUrl(url), "") << url;
  for (const char* url :
       {"", "mes.example", "ftp://mes.example/", "file:///etc/passwd", "https://", "https://u:p@mes.example/",
        "https://mes.example/ a", "http:/mes.example", "gopher://x/", "https://a\nb/"})
    EXPECT_NE(WrongUrl(url), "") << url;
}

TEST(WebhookPost, CallsNoAddressOfTheLinkAndFollowsNoRedirect) {
  const std::atomic<bool> is_stopped{false};
  for (const char* url :
       {"http://169.254.169.254/latest/meta-data/", "http://[fe80::1%25lo]/", "http://[::ffff:169.254.1.1]/",
        "http://0xa9fea9fe/", "http://[64:ff9b::a9fe:a9fe]/", "http://[::169.254.169.254]/", "http://[fd00:ec2::254]/",
        "http://[fd20:ce::254]/", "http://168.63.129.16/", "http://100.100.100.200/"})
    EXPECT_THAT(PostEvents(url, {}, "[]", {}, is_stopped).failure, HasSubstr("address of the link")) << url;
  HttpReceiver receiver;
  receiver.Answer(302);
  const WebhookAnswer answer = PostEvents(receiver.url(), {}, "[]", {}, is_stopped);
  EXPECT_EQ(answer.http_status, 302);
  EXPECT_FALSE(answer.is_taken());
  EXPECT_EQ(receiver.posted().size(), 1u);
}

TEST(WebhookPost, GivesUpInTimeAndAtOnceWhenItIsStopped) {
  HttpReceiver receiver;
  receiver.Answer(0);
  std::atomic<bool> is_stopped{false};
  WebhookPostOptions options;
  options.patience = 300ms;
  const auto began = std::chrono::steady_clock::now();
  EXPECT_FALSE(PostEvents(receiver.url(), {}, "[]", options, is_stopped).is_taken());
  EXPECT_LT(std::chrono::steady_clock::now() - began, 2s);
  receiver.Answer(204);
  is_stopped = true;
  EXPECT_FALSE(PostEvents(receiver.url(), {}, "[]", options, is_stopped).is_taken());
}

// A journal of which its last number can be said to be less.
class PutBackJournal : public storage::EventReader {
 public:
  explicit PutBackJournal(std::shared_ptr<const storage::EventReader> journal) : journal_(std::move(journal)) {}
  absl::StatusOr<storage::EventPage> Events(const storage::EventQuery& query,
                                            storage::Deadline deadline) const override {
    return journal_->Events(query, deadline);
  }
  absl::StatusOr<storage::JournalNow> Now(storage::Deadline deadline) const override {
    absl::StatusOr<storage::JournalNow> now = journal_->Now(deadline);
    if (now.ok()) now->newest_sequence = std::min(now->newest_sequence, most.load());
    return now;
  }
  absl::StatusOr<std::vector<std::string>> HiddenParts(const storage::Reader& reader,
                                                       storage::Deadline deadline) const override {
    return journal_->HiddenParts(reader, deadline);
  }
  std::atomic<std::int64_t> most{1'000'000};

 private:
  const std::shared_ptr<const storage::EventReader> journal_;
};

class WebhookTest : public ::testing::Test {
 protected:
  void Serve() {
    const auto journal = [&](int connections) {
      return storage::EventsIn(storage::Database::Open(testing::AsRole(database_.conninfo(), "plant"), connections));
    };
    const auto pages = pages_ = std::make_shared<PutBackJournal>(journal(2));
    if (database_of_plant_ == nullptr)
      database_of_plant_ = storage::Database::Open(testing::AsRole(database_.conninfo(), "plant"), 4);
    events_ = std::make_unique<EventService>(journal(1), pages);
    WebhookSenderOptions options;
    options.first_pause = 50ms;
    options.longest_pause = 200ms;
    options.between_looks = 50ms;
    options.post.patience = 1s;
    const auto webhooks = storage::WebhooksIn(database_of_plant_.get());
    auto sender = std::make_unique<WebhookSender>(webhooks, storage::WebhookDeliveriesIn(database_of_plant_.get()),
                                                  pages, events_->tail(), options);
    service_ = std::make_unique<WebhookService>(webhooks, pages, std::move(sender));
    server_ = std::make_unique<testing::InProcessServer>(std::vector<grpc::Service*>{service_.get()});
    stub_ = v1::WebhookService::NewStub(server_->Connect());
  }
  void SetUp() override { Serve(); }

  void Record(const std::string& name) { testing::RecordName(database_.database(), "policy", "policies/" + name); }
  static v1::CreateWebhookRequest To(const std::string& url, const std::string& id = "mes") {
    v1::CreateWebhookRequest request;
    request.set_webhook_id(id);
    request.set_url(url);
    request.set_request_id(storage::NewUuid());
    return request;
  }
  absl::StatusOr<v1::CreateWebhookResponse> Create(const v1::CreateWebhookRequest& request) {
    return testing::Call(*stub_, &v1::WebhookService::Stub::CreateWebhook, request);
  }
  v1::Webhook Get(const std::string& name = "webhooks/mes") {
    v1::GetWebhookRequest request;
    request.set_name(name);
    const auto got = testing::Call(*stub_, &v1::WebhookService::Stub::GetWebhook, request);
    EXPECT_TRUE(got.ok()) << got.status();
    return got.ok() ? *got : v1::Webhook();
  }
  static std::vector<std::string> Taken(const HttpReceiver& receiver) { return testing::TakenSubjects(receiver); }

  testing::ThrowawayDatabase database_;
  std::unique_ptr<storage::Database> database_of_plant_;
  std::shared_ptr<PutBackJournal> pages_;
  std::unique_ptr<EventService> events_;
  std::unique_ptr<WebhookService> service_;
  std::unique_ptr<testing::InProcessServer> server_;
  std::unique_ptr<v1::WebhookService::Stub> stub_;
};

TEST_F(WebhookTest, SendsWhatWasAndWhatComesInOrderSignedAndGoesOnAfterARestart) {
  for (int i = 0; i < 150; ++i) Record("p" + std::to_string(i));
  HttpReceiver receiver;
  const auto made = Create(To(receiver.url()));
  ASSERT_TRUE(made.ok()) << made.status();
  ASSERT_TRUE(Becomes(10s, [&] { return Taken(receiver).size() >= 150; }));
  Record("p150");
  ASSERT_TRUE(Becomes(10s, [&] { return Taken(receiver).size() >= 151; }));
  ASSERT_TRUE(Becomes(10s, [&] { return Get().lag_count() == 0; }));
  EXPECT_EQ(Get().delivered_sequence(), 151);
  server_.reset();
  service_.reset();
  Record("p151");
  Serve();
  ASSERT_TRUE(Becomes(10s, [&] { return Taken(receiver).size() >= 152; }));
  std::vector<std::string> expected;
  for (int i = 0; i < 152; ++i) expected.push_back("policies/p" + std::to_string(i));
  EXPECT_EQ(Taken(receiver), expected);
  std::string key;
  ASSERT_TRUE(absl::Base64Unescape(made->secret().substr(sizeof "whsec_" - 1), &key));
  for (HttpReceiver::Posted posted : receiver.posted()) {
    EXPECT_EQ(posted.headers["content-type"], "application/cloudevents-batch+json; charset=utf-8");
    const std::string message =
        posted.headers["webhook-id"] + "." + posted.headers["webhook-timestamp"] + "." + posted.body;
    EXPECT_EQ(posted.headers["webhook-signature"], "v1," + absl::Base64Escape(identity::MessageCode(key, message)));
    EXPECT_LE(nlohmann::json::parse(posted.body).size(), 100u);
  }
}

TEST_F(WebhookTest, WhatIsNotTakenIsSentAgainAndOneThatFailsHoldsUpNoOther) {
  HttpReceiver failing, sound;
  failing.Answer(503);
  ASSERT_TRUE(Create(To(failing.url(), "failing")).ok());
  ASSERT_TRUE(Create(To("http://127.0.0.1:1/", "dead")).ok());
  ASSERT_TRUE(Create(To(sound.url(), "sound")).ok());
  Record("a");
  Record("b");
  ASSERT_TRUE(Becomes(10s, [&] { return Taken(sound).size() == 2; }));
  ASSERT_TRUE(Becomes(10s, [&] { return failing.posted().size() >= 3; }));
  const v1::Webhook seen = Get("webhooks/failing");
  EXPECT_GE(seen.failure_count(), 1);
  EXPECT_TRUE(seen.has_failing_since());
  EXPECT_EQ(seen.last_failure(), "HTTP 503, want 200 to 299");
  EXPECT_EQ(seen.delivered_sequence(), 0);
  EXPECT_EQ(seen.lag_count(), 2);
  EXPECT_NE(Get("webhooks/dead").last_failure(), "");
  failing.Answer(200);
  ASSERT_TRUE(Becomes(10s, [&] { return Taken(failing).size() == 2; }));
  EXPECT_THAT(Taken(failing), ElementsAre("policies/a", "policies/b"));
  ASSERT_TRUE(Becomes(10s, [&] { return !Get("webhooks/failing").has_failing_since(); }));
  EXPECT_EQ(Get("webhooks/failing").failure_count(), 0);
}

TEST_F(WebhookTest, IsWithdrawnForEverAndATestChangesNothing) {
  HttpReceiver receiver;
  const v1::CreateWebhookRequest asked = To(receiver.url());
  const auto made = Create(asked), again = Create(asked);
  ASSERT_TRUE(made.ok() && again.ok()) << made.status() << again.status();
  EXPECT_EQ(made->secret(), again->secret());
  EXPECT_TRUE(absl::IsAlreadyExists(Create(To(receiver.url())).status()));
  v1::TestWebhookRequest test;
  test.set_name("webhooks/mes");
  test.set_request_id(storage::NewUuid());
  const auto tested = testing::Call(*stub_, &v1::WebhookService::Stub::TestWebhook, test);
  ASSERT_TRUE(tested.ok()) << tested.status();
  EXPECT_TRUE(tested->is_taken()) << tested->failure();
  const auto sent = nlohmann::json::parse(receiver.posted().at(0).body);
  EXPECT_EQ(sent[0]["type"], "sixpoint.webhook.test");
  EXPECT_EQ(sent[0]["id"], test.request_id());
  EXPECT_EQ(Get().delivered_sequence(), 0);
  v1::WithdrawWebhookRequest withdraw;
  withdraw.set_name("webhooks/mes");
  withdraw.set_request_id(storage::NewUuid());
  const auto withdrawn = testing::Call(*stub_, &v1::WebhookService::Stub::WithdrawWebhook, withdraw);
  ASSERT_TRUE(withdrawn.ok()) << withdrawn.status();
  EXPECT_TRUE(withdrawn->has_withdrawn_at());
  std::this_thread::sleep_for(200ms);
  const std::size_t before = receiver.posted().size();
  Record("a");
  std::this_thread::sleep_for(300ms);
  EXPECT_EQ(receiver.posted().size(), before);
  EXPECT_TRUE(absl::IsFailedPrecondition(testing::Call(*stub_, &v1::WebhookService::Stub::TestWebhook, test).status()));
  EXPECT_TRUE(absl::IsAlreadyExists(Create(To(receiver.url())).status()));
  withdraw.set_name("webhooks/none");
  EXPECT_TRUE(absl::IsNotFound(testing::Call(*stub_, &v1::WebhookService::Stub::WithdrawWebhook, withdraw).status()));
}

TEST_F(WebhookTest, SendsByTheFilterAndWhatItsMakerMaySee) {
  const testing::MachinesCalibrations calibrations = testing::PutCalibratedMachine(database_.database());
  testing::PutCustomersPart(database_.database(), "kappa", true, calibrations);
  const testing::CustomersPart sigma = testing::PutCustomersPart(database_.database(), "sigma", false, calibrations);
  HttpReceiver receiver;
  v1::CreateWebhookRequest request = To(receiver.url());
  request.mutable_filter()->add_kinds("inspection");
  request.mutable_filter()->add_kinds("policy");
  ASSERT_TRUE(Create(request).ok());
  Record("last");
  ASSERT_TRUE(Becomes(10s, [&] { return Taken(receiver).size() == 2; }));
  EXPECT_THAT(Taken(receiver), ElementsAre(sigma.inspection, "policies/last"));
}

TEST_F(WebhookTest, GoesOnFromTheRowWhereTheDatabaseWasPutBack) {
  HttpReceiver receiver;
  ASSERT_TRUE(Create(To(receiver.url())).ok());
  Record("a");
  Record("b");
  ASSERT_TRUE(Becomes(10s, [&] { return Taken(receiver).size() == 2; }));
  ASSERT_TRUE(Becomes(10s, [&] { return Get().delivered_sequence() == 2; }));
  absl::StatusOr<storage::Transaction> transaction = database_.database()->Begin(testing::Soon());
  ASSERT_TRUE(
      transaction->Execute("UPDATE webhook_deliveries SET looked_at_sequence = 1, delivered_sequence = 1").ok());
  ASSERT_TRUE(transaction->Commit().ok());
  std::this_thread::sleep_for(200ms);
  EXPECT_EQ(Taken(receiver).size(), 2u) << "the row alone says nothing";
  pages_->most = 1;
  ASSERT_TRUE(Becomes(10s, [&] { return Taken(receiver).size() >= 3; }));
  pages_->most = 1'000'000;
  EXPECT_EQ(Taken(receiver).at(2), "policies/b");
}

TEST_F(WebhookTest, OthersAreToldNeitherTokensNorWhatIsHiddenNorTheSecret) {
  const testing::MachinesCalibrations calibrations = testing::PutCalibratedMachine(database_.database());
  testing::PutCustomersPart(database_.database(), "kappa", true, calibrations);
  testing::PutCustomersPart(database_.database(), "sigma", false, calibrations);
  storage::WebhookRow row;
  row.url = "http://127.0.0.1:1/in?token=hush";
  row.secret = std::string(32, 'k');
  row.reader.identity = row.requested_by = "users/eve";
  absl::StatusOr<storage::Transaction> transaction = database_.database()->Begin(testing::Soon());
  for (const std::string word : {"kappa", "sigma"}) {
    row.webhook_id = word;
    row.filter.part_id = word + "-part";
    row.filter.blade_serial = word + "-sn";
    row.request_id = storage::NewUuid();
    ASSERT_TRUE(storage::InsertWebhook(*transaction, row).ok());
  }
  ASSERT_TRUE(transaction->Commit().ok());
  const v1::Webhook kappa = Get("webhooks/kappa"), sigma = Get("webhooks/sigma");
  EXPECT_EQ(kappa.url(), "http://127.0.0.1:1/in");
  EXPECT_EQ(kappa.filter().part() + kappa.filter().blade(), "");
  EXPECT_EQ(sigma.filter().part() + sigma.filter().blade(), "parts/sigma-partblades/sigma-sn");
  const auto listed = testing::Call(*stub_, &v1::WebhookService::Stub::ListWebhooks, v1::ListWebhooksRequest());
  ASSERT_TRUE(listed.ok()) << listed.status();
  EXPECT_THAT(listed->ShortDebugString(), Not(HasSubstr("hush")));
  EXPECT_EQ(listed->webhooks(0).filter().part(), "");
  v1::CreateWebhookRequest again = To(row.url, "sigma");
  again.mutable_filter()->set_part("parts/sigma-part");
  again.mutable_filter()->set_blade("blades/sigma-sn");
  again.set_request_id(row.request_id);
  EXPECT_TRUE(absl::IsAlreadyExists(Create(again).status()));
  v1::WithdrawWebhookRequest withdraw;
  withdraw.set_name("webhooks/kappa");
  withdraw.set_request_id(storage::NewUuid());
  const auto withdrawn = testing::Call(*stub_, &v1::WebhookService::Stub::WithdrawWebhook, withdraw);
  ASSERT_TRUE(withdrawn.ok()) << withdrawn.status();
  EXPECT_THAT(withdrawn->ShortDebugString(), Not(::testing::AnyOf(HasSubstr("hush"), HasSubstr("kappa-sn"))));
}

TEST_F(WebhookTest, RefusesWhatIsWrongAndMoreThanMayHold) {
  v1::CreateWebhookRequest request = To("ftp://mes.example/", "a b");
  request.mutable_filter()->add_kinds("inspektion");
  request.set_after_sequence(99);
  const absl::Status refused = Create(request).status();
  for (const char* field :
       {"webhook_id: a b", "url: ftp://mes.example/", "filter.kinds[0]: inspektion", "after_sequence: 99"})
    EXPECT_THAT(std::string(refused.message()), HasSubstr(field));
  for (int i = 0; i < storage::kMostWebhooks; ++i)
    ASSERT_TRUE(Create(To("http://127.0.0.1:1/", "w" + std::to_string(i))).ok()) << i;
  EXPECT_TRUE(absl::IsResourceExhausted(Create(To("http://127.0.0.1:1/", "more")).status()));
  v1::ListWebhooksRequest list;
  list.set_page_size(10);
  const auto first = testing::Call(*stub_, &v1::WebhookService::Stub::ListWebhooks, list);
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_EQ(first->webhooks_size(), 10);
  list.set_page_token(first->next_page_token());
  const auto second = testing::Call(*stub_, &v1::WebhookService::Stub::ListWebhooks, list);
  ASSERT_TRUE(second.ok()) << second.status();
  EXPECT_EQ(second->webhooks_size(), 6);
  EXPECT_EQ(second->next_page_token(), "");
}

}  // namespace
}  // namespace sixpoint::plant
