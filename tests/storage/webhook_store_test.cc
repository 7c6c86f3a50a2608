// What every WebhookStore and its WebhookDeliveries do, PostgreSQL's and the fake that handlers and the sender are tested on.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <thread>

#include "storage/reasons.h"
#include "storage/webhooks.h"
#include "tests/support/customers_parts.h"
#include "tests/support/fake_webhooks.h"
#include "tests/support/some_uuid.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::FakeWebhooks;
using sixpoint::testing::kSomeUuid;
using sixpoint::testing::Soon;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

const StillWanted kWebhookWanted = [] { return true; };

WebhookRow WebhookOfJane(const std::string& webhook_id, const std::string& request_id = NewUuid()) {
  WebhookRow row;
  row.webhook_id = webhook_id;
  row.url = "https://mes.example/in?token=hush";
  row.filter = {{"inspection", "scan"}, "m1", "kappa-sn", "kappa-part", {"NOT_CONFORM"}};
  row.begins_after = 7;
  row.secret = std::string(31, 'k') + '\0';
  row.reader.identity = "users/jane";
  row.requested_by = "users/jane via services/gateway";
  row.request_id = request_id;
  return row;
}

struct WebhooksUnderTest {
  WebhookStore& store;
  WebhookDeliveries& deliveries;
  std::function<void()> put_kappa;  // kappa-part and its blade kappa-sn, which jane may see and joe may not

  absl::StatusOr<WebhookRow> Create(const WebhookRow& row) const { return store.Create(row, kWebhookWanted, Soon()); }
  std::optional<WebhookRow> Withdraw(const std::string& webhook_id, const std::string& requested_by,
                                     const Reader& reader = Reader::Everything()) const {
    const auto withdrawn = store.Withdraw({webhook_id, requested_by, NewUuid(), reader}, kWebhookWanted, Soon());
    EXPECT_TRUE(withdrawn.ok()) << withdrawn.status();
    return withdrawn.value_or(std::nullopt);
  }
  std::optional<WebhookRow> Find(const std::string& webhook_id, const Reader& reader = Reader::Everything()) const {
    const auto found = store.Find(webhook_id, reader, Soon());
    EXPECT_TRUE(found.ok()) << found.status();
    return found.value_or(std::nullopt);
  }
  std::vector<WebhookRow> List(bool withdrawn_too = false, const std::string& after_id = "", int limit = 100,
                               const Reader& reader = Reader::Everything()) const {
    const auto listed = store.List(withdrawn_too, after_id, limit, reader, Soon());
    EXPECT_TRUE(listed.ok()) << listed.status();
    return listed.value_or(std::vector<WebhookRow>());
  }
  std::vector<std::string> Ids(bool withdrawn_too = false, const std::string& after_id = "", int limit = 100) const {
    std::vector<std::string> ids;
    for (const WebhookRow& row : List(withdrawn_too, after_id, limit)) ids.push_back(row.webhook_id);
    return ids;
  }
};

// Each test runs on both.
void OnBothWebhookStores(const std::function<void(const WebhooksUnderTest& webhooks)>& test) {
  {
    SCOPED_TRACE("the fake");
    FakeWebhooks fake;
    test({fake, fake, [&] {
            fake.clearances.customers["kappa-part"] = "kappa";
            for (const char* name : {"parts/kappa-part", "blades/kappa-sn"})
              fake.clearances.part_of[name] = "kappa-part";
            fake.clearances.clearances.emplace("users/jane", "parts/kappa-part");
          }});
  }
  SCOPED_TRACE("PostgreSQL");
  sixpoint::testing::ThrowawayDatabase database;
  const auto put_kappa = [&] {
    const auto calibrations = sixpoint::testing::PutCalibratedMachine(database.database());
    sixpoint::testing::PutCustomersPart(database.database(), "kappa", true, calibrations);
    sixpoint::testing::Clear(database.database(), "users/jane", "parts/kappa-part");
  };
  test({*WebhooksIn(database.database()), *WebhookDeliveriesIn(database.database()), put_kappa});
}

TEST(WebhookStore, WhatIsMadeIsFoundAsItWasAskedFor) {
  OnBothWebhookStores([](const WebhooksUnderTest& webhooks) {
    const WebhookRow asked = WebhookOfJane("mes", kSomeUuid);
    const auto made = webhooks.Create(asked);
    ASSERT_TRUE(made.ok()) << made.status();
    const std::vector<WebhookRow> listed = webhooks.List();
    ASSERT_EQ(listed.size(), 1u);
    ASSERT_TRUE(webhooks.Find("mes").has_value());
    for (const WebhookRow& row : {*made, *webhooks.Find("mes"), listed[0]}) {
      EXPECT_EQ(row.webhook_id, "mes");
      EXPECT_EQ(row.url, asked.url);
      EXPECT_TRUE(row.filter == asked.filter);
      EXPECT_EQ(row.begins_after, 7);
      EXPECT_EQ(row.secret, asked.secret);
      EXPECT_EQ(row.reader.identity, "users/jane");
      EXPECT_EQ(row.requested_by, asked.requested_by);
      EXPECT_EQ(row.request_id, kSomeUuid);
      EXPECT_NE(row.recorded_at, Instant());
      EXPECT_EQ(row.recorded_at, made->recorded_at);
      EXPECT_FALSE(row.withdrawn_at.has_value());
      EXPECT_EQ(row.withdrawn_by, "");
      EXPECT_EQ(row.delivery.looked_at_sequence, 7);
      EXPECT_EQ(row.delivery.delivered_sequence, 0);
      EXPECT_FALSE(row.delivery.delivered_at.has_value() || row.delivery.failing_since.has_value());
      EXPECT_EQ(row.delivery.failure_count, 0);
      EXPECT_EQ(row.delivery.last_failure, "");
    }
    EXPECT_FALSE(webhooks.Find("me").has_value());
  });
}

// Nobody sees all because he once did.
TEST(WebhookStore, ThatAReaderSeesAllIsNotKept) {
  OnBothWebhookStores([](const WebhooksUnderTest& webhooks) {
    WebhookRow row = WebhookOfJane("mes");
    row.reader = Reader::Everything();
    const auto made = webhooks.Create(row);
    ASSERT_TRUE(made.ok()) << made.status();
    EXPECT_FALSE(made->reader.sees_all);
    EXPECT_EQ(made->reader.identity, "");
  });
}

TEST(WebhookStore, ARequestThatComesAgainMakesOneAndIsAnsweredWithItsSecret) {
  OnBothWebhookStores([](const WebhooksUnderTest& webhooks) {
    const auto made = webhooks.Create(WebhookOfJane("mes", kSomeUuid));
    ASSERT_TRUE(made.ok()) << made.status();
    WebhookRow retry = WebhookOfJane("mes", kSomeUuid);
    retry.secret = std::string(32, 'x');
    retry.begins_after = 9;
    const auto again = webhooks.Create(retry);
    ASSERT_TRUE(again.ok()) << again.status();
    EXPECT_EQ(again->secret, made->secret);
    EXPECT_EQ(again->begins_after, 7);
    EXPECT_EQ(again->recorded_at, made->recorded_at);
    // Late, it gets what stands by then.
    ASSERT_TRUE(webhooks.Withdraw("mes", "users/boss").has_value());
    const auto late = webhooks.Create(retry);
    ASSERT_TRUE(late.ok()) << late.status();
    EXPECT_TRUE(late->withdrawn_at.has_value());
    EXPECT_EQ(webhooks.Ids(true), std::vector<std::string>{"mes"});
  });
}

TEST(WebhookStore, ARequestIdIsOfOneRequest) {
  OnBothWebhookStores([](const WebhooksUnderTest& webhooks) {
    const WebhookRow asked = WebhookOfJane("mes", kSomeUuid);
    ASSERT_TRUE(webhooks.Create(asked).ok());
    std::vector<WebhookRow> others(4, asked);
    others[0].webhook_id = "other";
    others[1].url = "https://mes.example/out";
    others[2].filter.verdicts.clear();
    others[3].requested_by = "users/eve";
    for (const WebhookRow& other : others) {
      const absl::Status refused = webhooks.Create(other).status();
      EXPECT_EQ(refused.code(), absl::StatusCode::kAlreadyExists) << refused;
      EXPECT_EQ(refused.GetPayload(kReasonPayload), kRequestIdReused);
    }
    for (const char* request_id : {"", "one"})
      EXPECT_EQ(webhooks.Create(WebhookOfJane("more", request_id)).status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_EQ(webhooks.store.Withdraw({"mes", "users/boss", "one"}, kWebhookWanted, Soon()).status().code(),
              absl::StatusCode::kInvalidArgument);
    EXPECT_EQ(webhooks.Ids(), std::vector<std::string>{"mes"});
  });
}

TEST(WebhookStore, ANameIsGivenOnceForEver) {
  OnBothWebhookStores([](const WebhooksUnderTest& webhooks) {
    ASSERT_TRUE(webhooks.Create(WebhookOfJane("mes")).ok());
    for (const bool is_withdrawn : {false, true}) {
      if (is_withdrawn) {
        ASSERT_TRUE(webhooks.Withdraw("mes", "users/boss").has_value());
      }
      const absl::Status refused = webhooks.Create(WebhookOfJane("mes")).status();
      EXPECT_EQ(refused.code(), absl::StatusCode::kAlreadyExists) << refused;
      EXPECT_EQ(refused.GetPayload(kReasonPayload), kWebhookExists);
    }
    EXPECT_TRUE(webhooks.Create(WebhookOfJane("mes2")).ok());
  });
}

TEST(WebhookStore, SoManyHoldAtOnceAndOneThatIsWithdrawnLeavesItsPlace) {
  OnBothWebhookStores([](const WebhooksUnderTest& webhooks) {
    for (int i = 0; i < kMostWebhooks; ++i)
      ASSERT_TRUE(webhooks.Create(WebhookOfJane("w" + std::to_string(i))).ok()) << i;
    const absl::Status refused = webhooks.Create(WebhookOfJane("more")).status();
    EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted) << refused;
    EXPECT_EQ(refused.GetPayload(kReasonPayload), kWebhooksFull);
    ASSERT_TRUE(webhooks.Withdraw("w3", "users/boss").has_value());
    EXPECT_TRUE(webhooks.Create(WebhookOfJane("more")).ok());
    EXPECT_EQ(webhooks.List(true).size(), static_cast<std::size_t>(kMostWebhooks) + 1);
  });
}

TEST(WebhookStore, WhoWithdrewItFirstDid) {
  OnBothWebhookStores([](const WebhooksUnderTest& webhooks) {
    const auto made = webhooks.Create(WebhookOfJane("mes"));
    ASSERT_TRUE(made.ok()) << made.status();
    ASSERT_TRUE(webhooks.Create(WebhookOfJane("other")).ok());
    EXPECT_FALSE(webhooks.Withdraw("none", "users/boss").has_value());
    const std::optional<WebhookRow> withdrawn = webhooks.Withdraw("mes", "users/boss");
    ASSERT_TRUE(withdrawn.has_value() && withdrawn->withdrawn_at.has_value());
    EXPECT_EQ(withdrawn->withdrawn_by, "users/boss");
    EXPECT_GE(*withdrawn->withdrawn_at, made->recorded_at);
    EXPECT_EQ(withdrawn->secret, made->secret);
    for (const auto& row : {webhooks.Withdraw("mes", "users/joe"), webhooks.Find("mes")}) {
      ASSERT_TRUE(row.has_value());
      EXPECT_EQ(row->withdrawn_by, "users/boss");
      EXPECT_EQ(row->withdrawn_at, withdrawn->withdrawn_at);
    }
    EXPECT_FALSE(webhooks.Find("other")->withdrawn_at.has_value());
  });
}

TEST(WebhookStore, ListsByNameAndByPages) {
  OnBothWebhookStores([](const WebhooksUnderTest& webhooks) {
    EXPECT_THAT(webhooks.Ids(true), IsEmpty());
    for (const char* id : {"b", "a", "B", "c"}) ASSERT_TRUE(webhooks.Create(WebhookOfJane(id)).ok());
    ASSERT_TRUE(webhooks.Withdraw("b", "users/boss").has_value());
    EXPECT_THAT(webhooks.Ids(), ElementsAre("B", "a", "c"));
    EXPECT_THAT(webhooks.Ids(true), ElementsAre("B", "a", "b", "c"));
    EXPECT_THAT(webhooks.Ids(false, "", 2), ElementsAre("B", "a"));
    EXPECT_THAT(webhooks.Ids(false, "a", 2), ElementsAre("c"));
    EXPECT_THAT(webhooks.Ids(true, "a", 1), ElementsAre("b"));
    EXPECT_THAT(webhooks.Ids(true, "c"), IsEmpty());
  });
}

TEST(WebhookStore, HowFarOneHasComeIsKeptAndNeverGoesBack) {
  OnBothWebhookStores([](const WebhooksUnderTest& webhooks) {
    ASSERT_TRUE(webhooks.Create(WebhookOfJane("mes")).ok());
    ASSERT_TRUE(webhooks.Create(WebhookOfJane("other")).ok());
    const Instant moment(std::chrono::seconds(1'700'000'000));
    const WebhookDelivery failing{12, 11, moment, moment + std::chrono::microseconds(5), 3, "HTTP 503"};
    ASSERT_TRUE(webhooks.deliveries.Save("mes", failing, Soon()).ok());
    WebhookDelivery kept = webhooks.Find("mes")->delivery;
    EXPECT_EQ(kept.looked_at_sequence, 12);
    EXPECT_EQ(kept.delivered_sequence, 11);
    EXPECT_EQ(kept.delivered_at, failing.delivered_at);
    EXPECT_EQ(kept.failing_since, failing.failing_since);
    EXPECT_EQ(kept.failure_count, 3);
    EXPECT_EQ(kept.last_failure, "HTTP 503");
    EXPECT_EQ(webhooks.List().at(0).delivery.failure_count, 3);
    EXPECT_EQ(webhooks.Find("other")->delivery.looked_at_sequence, 7);
    // As a process has it that was overtaken.
    ASSERT_TRUE(webhooks.deliveries.Save("mes", {11, 11, std::nullopt, std::nullopt, 0, ""}, Soon()).ok());
    EXPECT_EQ(webhooks.Find("mes")->delivery.failure_count, 3);
    // At the same number, and one that was withdrawn meanwhile.
    ASSERT_TRUE(webhooks.Withdraw("mes", "users/boss").has_value());
    ASSERT_TRUE(webhooks.deliveries.Save("mes", {12, 12, moment, std::nullopt, 0, "HTTP 503"}, Soon()).ok());
    kept = webhooks.Find("mes")->delivery;
    EXPECT_EQ(kept.delivered_sequence, 12);
    EXPECT_FALSE(kept.failing_since.has_value());
    EXPECT_EQ(kept.failure_count, 0);
    EXPECT_TRUE(webhooks.deliveries.Save("none", failing, Soon()).ok());
    EXPECT_FALSE(webhooks.Find("none").has_value());
  });
}

TEST(WebhookStore, OfAFilterIsToldWhatItsReaderMaySee) {
  OnBothWebhookStores([](const WebhooksUnderTest& webhooks) {
    WebhookRow unrecorded = WebhookOfJane("unrecorded");
    unrecorded.filter.blade_serial = unrecorded.filter.part_id = "nothing";
    ASSERT_TRUE(webhooks.Create(WebhookOfJane("mes")).ok());
    ASSERT_TRUE(webhooks.Create(unrecorded).ok());
    const auto told = [&](const std::string& identity) {
      std::vector<std::string> names;
      for (const WebhookRow& row : webhooks.List(false, "", 100, {identity})) {
        names.push_back(row.filter.blade_serial + "," + row.filter.part_id);
        const std::optional<WebhookRow> found = webhooks.Find(row.webhook_id, {identity});
        EXPECT_TRUE(found.has_value() && found->filter == row.filter);
        EXPECT_EQ(row.filter.machine_id, "m1");
        EXPECT_EQ(row.url, "https://mes.example/in?token=hush");
      }
      return names;
    };
    // Nothing is hidden from anybody.
    EXPECT_THAT(told("users/joe"), ElementsAre("kappa-sn,kappa-part", "nothing,nothing"));
    webhooks.put_kappa();
    EXPECT_THAT(told("users/jane"), ElementsAre("kappa-sn,kappa-part", "nothing,nothing"));
    // From whom something is hidden, what is not recorded is as well.
    EXPECT_THAT(told("users/joe"), ElementsAre(",", ","));
    EXPECT_EQ(webhooks.Find("mes")->filter.part_id, "kappa-part");
    const std::optional<WebhookRow> withdrawn = webhooks.Withdraw("mes", "users/joe", {"users/joe"});
    ASSERT_TRUE(withdrawn.has_value());
    EXPECT_EQ(withdrawn->filter.blade_serial + withdrawn->filter.part_id, "");
    EXPECT_EQ(webhooks.Find("mes")->filter.blade_serial, "kappa-sn");
  });
}

TEST(WebhookStore, OfTheSameRequestsAtOnceOneIsMade) {
  OnBothWebhookStores([](const WebhooksUnderTest& webhooks) {
    std::vector<std::string> secrets(4);
    std::vector<std::thread> makers;
    for (std::size_t i = 0; i < secrets.size(); ++i)
      makers.emplace_back([&, i] {
        WebhookRow row = WebhookOfJane("mes", kSomeUuid);
        row.secret = std::string(32, static_cast<char>('a' + i));
        const auto made = webhooks.Create(row);
        EXPECT_TRUE(made.ok()) << made.status();
        if (made.ok()) secrets[i] = made->secret;
      });
    for (std::thread& maker : makers) maker.join();
    EXPECT_THAT(secrets, ::testing::Each(webhooks.Find("mes")->secret));
  });
}

TEST(WebhookStore, WhatIsWantedNoMoreIsNotDone) {
  OnBothWebhookStores([](const WebhooksUnderTest& webhooks) {
    const auto is_gone = [] { return false; };
    EXPECT_EQ(webhooks.store.Create(WebhookOfJane("mes"), is_gone, Soon()).status().code(),
              absl::StatusCode::kCancelled);
    EXPECT_THAT(webhooks.Ids(true), IsEmpty());
    ASSERT_TRUE(webhooks.Create(WebhookOfJane("mes")).ok());
    EXPECT_EQ(webhooks.store.Withdraw({"mes", "users/boss", NewUuid()}, is_gone, Soon()).status().code(),
              absl::StatusCode::kCancelled);
    EXPECT_FALSE(webhooks.Find("mes")->withdrawn_at.has_value());
  });
}

}  // namespace
}  // namespace sixpoint::storage
