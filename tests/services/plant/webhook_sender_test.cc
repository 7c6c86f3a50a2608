// The sender on fake stores and a fake journal, over real HTTP: no PostgreSQL. What it sends, and how it is signed, is webhook_test.cc's.
#include "services/plant/webhook_sender.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/services/plant/http_receiver.h"
#include "tests/support/becomes.h"
#include "tests/support/fake_events.h"
#include "tests/support/fake_webhooks.h"

namespace sixpoint::plant {
namespace {

using namespace std::chrono_literals;
using testing::Becomes;
using ::testing::ElementsAre;
using testing::HttpReceiver;
using testing::TakenSubjects;

WebhookSenderOptions QuickSending() {
  WebhookSenderOptions options;
  options.first_pause = 50ms;
  options.longest_pause = 200ms;
  options.between_looks = 50ms;
  options.post.patience = 60s;  // longer than any test waits
  return options;
}

class WebhookSenderTest : public ::testing::Test {
 protected:
  void SetUp() override { Start(); }
  void Start() { sender_ = std::make_unique<WebhookSender>(webhooks_, webhooks_, events_, tail_, QuickSending()); }
  // From the first entry of the journal on.
  void Make(const std::string& id, const HttpReceiver& receiver, const storage::EventFilter& filter = {}) {
    storage::WebhookRow row;
    row.webhook_id = id;
    row.url = receiver.url();
    row.filter = filter;
    row.secret = std::string(32, 'k');
    row.reader.identity = row.requested_by = "users/jane";
    row.request_id = storage::NewUuid();
    const auto made = webhooks_->Create(row, [] { return true; }, {});
    ASSERT_TRUE(made.ok()) << made.status();
  }
  void Withdraw(const std::string& id) {
    const auto withdrawn = webhooks_->Withdraw({id, "users/jane", storage::NewUuid()}, [] { return true; }, {});
    ASSERT_TRUE(withdrawn.ok() && withdrawn->has_value()) << withdrawn.status();
  }
  storage::WebhookDelivery DeliveryOf(const std::string& id) {
    const auto found = webhooks_->Find(id, storage::Reader::Everything(), {});
    EXPECT_TRUE(found.ok() && found->has_value()) << found.status();
    return found.ok() && found->has_value() ? (*found)->delivery : storage::WebhookDelivery();
  }
  // Whether so much was taken, and the store knows.
  bool HasDelivered(const std::string& id, std::int64_t sequence) {
    return Becomes(20s, [&] { return DeliveryOf(id).delivered_sequence == sequence; });
  }
  void Record(const std::string& name) { events_->Record("policy", "policies/" + name); }

  const std::shared_ptr<testing::FakeWebhooks> webhooks_ = std::make_shared<testing::FakeWebhooks>();
  const std::shared_ptr<testing::FakeEvents> events_ = std::make_shared<testing::FakeEvents>();
  const std::shared_ptr<EventTail> tail_ = std::make_shared<EventTail>(events_);
  std::unique_ptr<WebhookSender> sender_;
};

TEST_F(WebhookSenderTest, SendsInTheJournalsOrderAndGoesOnAfterARestartWhereItWas) {
  std::vector<std::string> expected;
  const auto record = [&](int from, int until) {
    for (int i = from; i < until; ++i) {
      Record("p" + std::to_string(i));
      expected.push_back("policies/p" + std::to_string(i));
    }
  };
  HttpReceiver receiver;
  record(0, 150);
  Make("mes", receiver);
  ASSERT_TRUE(HasDelivered("mes", 150));
  EXPECT_TRUE(DeliveryOf("mes").delivered_at.has_value());
  EXPECT_EQ(DeliveryOf("mes").looked_at_sequence, 150);
  EXPECT_GE(receiver.posted().size(), 2u);  // of a hundred at most
  record(150, 151);
  ASSERT_TRUE(HasDelivered("mes", 151));
  sender_.reset();
  record(151, 153);
  Start();
  ASSERT_TRUE(HasDelivered("mes", 153));
  EXPECT_EQ(TakenSubjects(receiver), expected);
}

TEST_F(WebhookSenderTest, WhatIsNotTakenComesAgainBeforeAnythingElse) {
  HttpReceiver receiver;
  receiver.Answer(503);
  Record("a");
  Record("b");
  Make("mes", receiver);
  ASSERT_TRUE(Becomes(20s, [&] { return receiver.posted().size() >= 3; }));
  const storage::WebhookDelivery failing = DeliveryOf("mes");
  EXPECT_GE(failing.failure_count, 1);
  EXPECT_TRUE(failing.failing_since.has_value());
  EXPECT_EQ(failing.last_failure, "HTTP 503, want 200 to 299");
  EXPECT_EQ(failing.looked_at_sequence, 0);
  EXPECT_EQ(failing.delivered_sequence, 0);
  Record("c");
  receiver.Answer(204);
  ASSERT_TRUE(HasDelivered("mes", 3));
  EXPECT_THAT(TakenSubjects(receiver), ElementsAre("policies/a", "policies/b", "policies/c"));
  const storage::WebhookDelivery sound = DeliveryOf("mes");
  EXPECT_FALSE(sound.failing_since.has_value());
  EXPECT_EQ(sound.failure_count, 0);
  EXPECT_EQ(sound.last_failure, "HTTP 503, want 200 to 299");
}

// Neither a connection nor a place of the store is held while an answer is waited for.
TEST_F(WebhookSenderTest, OneThatDoesNotAnswerHoldsUpNeitherTheOthersNorTheStore) {
  HttpReceiver silent, sound;
  silent.Answer(0);
  Record("a");
  Make("silent", silent);
  ASSERT_TRUE(Becomes(20s, [&] { return silent.posted().size() == 1; }));
  Make("sound", sound);
  ASSERT_TRUE(HasDelivered("sound", 1));
  Record("b");
  ASSERT_TRUE(HasDelivered("sound", 2));
  EXPECT_EQ(silent.posted().size(), 1u);
  EXPECT_EQ(DeliveryOf("silent").looked_at_sequence, 0);
  // Withdrawn, it is waited for no more: whoever came after it is begun with once it has ended.
  Withdraw("silent");
  HttpReceiver later;
  Make("later", later);
  ASSERT_TRUE(HasDelivered("later", 2));
  EXPECT_EQ(DeliveryOf("silent").failure_count, 0);  // given up, not refused
}

TEST_F(WebhookSenderTest, ToOneThatIsWithdrawnNothingMoreIsSent) {
  HttpReceiver withdrawn, holding;
  Record("a");
  Make("withdrawn", withdrawn);
  ASSERT_TRUE(HasDelivered("withdrawn", 1));
  Withdraw("withdrawn");
  // Whoever begins to send to this one has seen that the other is gone, and has ended it before.
  Make("holding", holding);
  ASSERT_TRUE(HasDelivered("holding", 1));
  Record("b");
  ASSERT_TRUE(HasDelivered("holding", 2));
  EXPECT_THAT(TakenSubjects(withdrawn), ElementsAre("policies/a"));
}

TEST_F(WebhookSenderTest, WhileTheJournalIsAwayNothingIsSentAndThenAllOfIt) {
  HttpReceiver receiver;
  Record("a");
  Make("mes", receiver);
  ASSERT_TRUE(HasDelivered("mes", 1));
  events_->Fail(absl::UnavailableError("the database is away"));
  Record("b");
  std::this_thread::sleep_for(200ms);
  EXPECT_EQ(receiver.posted().size(), 1u);
  EXPECT_EQ(DeliveryOf("mes").failure_count, 0);  // of the receiver's
  events_->Fail(absl::OkStatus());
  ASSERT_TRUE(HasDelivered("mes", 2));
  EXPECT_THAT(TakenSubjects(receiver), ElementsAre("policies/a", "policies/b"));
}

TEST_F(WebhookSenderTest, WhatWasTakenIsNotSentAgainWhereTheStoreWasAway) {
  HttpReceiver receiver;
  Record("a");
  Make("mes", receiver);
  ASSERT_TRUE(HasDelivered("mes", 1));
  webhooks_->commits.Fail(absl::UnavailableError("the database is away"));
  Record("b");
  ASSERT_TRUE(Becomes(20s, [&] { return TakenSubjects(receiver).size() == 2; }));
  // What comes now waits until it is kept that b was taken.
  Record("c");
  std::this_thread::sleep_for(200ms);
  EXPECT_EQ(receiver.posted().size(), 2u);
  webhooks_->commits.Fail(absl::OkStatus());
  ASSERT_TRUE(HasDelivered("mes", 3));
  EXPECT_THAT(TakenSubjects(receiver), ElementsAre("policies/a", "policies/b", "policies/c"));
}

TEST_F(WebhookSenderTest, SendsByTheFilterWhatItsMakerMaySee) {
  events_->clearances.customers["kappa-part"] = "kappa";
  const auto scan = [&](const std::string& name, const std::string& part) {
    storage::EventRow row;
    row.entry.entry.kind = "scan";
    row.entry.entry.name = "scans/" + name;
    row.parts = std::vector<std::string>{part};
    events_->Record(row);
  };
  scan("hidden", "kappa-part");
  scan("seen", "sigma-part");
  Record("not asked for");
  HttpReceiver receiver;
  storage::EventFilter filter;
  filter.kinds = {"scan"};
  Make("mes", receiver, filter);
  ASSERT_TRUE(HasDelivered("mes", 2));
  scan("last", "sigma-part");
  ASSERT_TRUE(HasDelivered("mes", 4));
  EXPECT_THAT(TakenSubjects(receiver), ElementsAre("scans/seen", "scans/last"));
}

TEST_F(WebhookSenderTest, ATestIsOneEventThatTellsNothingOfTheJournal) {
  HttpReceiver receiver;
  storage::WebhookRow row;
  row.webhook_id = "mes";
  row.url = receiver.url();
  row.secret = std::string(32, 'k');
  Record("a");
  EXPECT_TRUE(sender_->Test(row, "an id", "urn:uuid:plant").is_taken());
  EXPECT_THAT(TakenSubjects(receiver), ElementsAre("webhooks/mes"));
  EXPECT_EQ(receiver.posted().at(0).headers.at("webhook-id"), "an id");
  receiver.Answer(500);
  const WebhookAnswer refused = sender_->Test(row, "an id", "urn:uuid:plant");
  EXPECT_EQ(refused.http_status, 500);
  EXPECT_EQ(refused.failure, "HTTP 500, want 200 to 299");
}

}  // namespace
}  // namespace sixpoint::plant
