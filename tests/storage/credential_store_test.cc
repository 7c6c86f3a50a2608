// What every CredentialStore does, PostgreSQL's and the fake that handlers are tested on.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <thread>

#include "storage/blobs.h"
#include "storage/credentials.h"
#include "tests/support/fake_credentials.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::FakeCredentials;
using sixpoint::testing::Soon;
using sixpoint::testing::ThrowawayDatabase;
using std::chrono::hours;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

const StillWanted kCredentialsWanted = [] { return true; };

CredentialOffer OfferUnder(const std::string& word) {
  return {Sha256Hex(word), std::string("sealed\0of ", 10) + word, "machines/" + word, "users/it", 2};
}

CertificateRenewal RenewalOf(const std::string& key, const std::string& serial, Instant not_after) {
  return {Sha256Hex(key), serial, "machines/m1", "pem of " + serial, not_after, "users/it"};
}

struct CredentialStoreUnderTest {
  CredentialStore& store;
  std::function<void(hours time)> let_pass;     // the offers have waited so much longer
  std::function<void(int count)> keep_so_many;  // offers of others, which wait for an hour

  absl::StatusOr<Instant> Keep(const CredentialOffer& offer) const {
    return store.KeepOffer(offer, kCredentialsWanted, Soon());
  }
  absl::Status Keep(const CertificateRenewal& renewal) const {
    return store.KeepRenewal(renewal, kCredentialsWanted, Soon());
  }
  std::optional<CredentialOffer> Take(const std::string& word) const {
    const auto taken = store.TakeOffer(Sha256Hex(word), kCredentialsWanted, Soon());
    EXPECT_TRUE(taken.ok()) << taken.status();
    return taken.value_or(std::nullopt);
  }
  std::vector<std::string> Serials(const std::string& key) const {
    const auto found = store.FindRenewals(Sha256Hex(key), Soon());
    EXPECT_TRUE(found.ok()) << found.status();
    std::vector<std::string> serials;
    for (const CertificateRenewal& renewal : found.value_or(std::vector<CertificateRenewal>()))
      serials.push_back(renewal.serial);
    return serials;
  }
};

// Each test runs on both.
void OnBothCredentialStores(const std::function<void(const CredentialStoreUnderTest& credentials)>& test) {
  {
    SCOPED_TRACE("the fake");
    FakeCredentials fake;
    const auto keep_so_many = [&](int count) {
      for (int i = 0; i < count; ++i)
        ASSERT_TRUE(fake.KeepOffer(OfferUnder(std::to_string(i)), kCredentialsWanted, Soon()).ok());
    };
    test({fake, [&](hours time) { fake.LetPass(time); }, keep_so_many});
  }
  SCOPED_TRACE("PostgreSQL");
  ThrowawayDatabase database;
  const auto execute = [&](const std::string& sql, int number) {
    Transaction transaction = *database.database()->Begin(Soon());
    const auto done = transaction.Execute(sql, Params().Int(number));
    ASSERT_TRUE(done.ok()) << done.status();
    ASSERT_TRUE(transaction.Commit().ok());
  };
  const auto let_pass = [&](hours time) {
    execute(
        "UPDATE credential_offers SET offered_at = offered_at - make_interval(hours => $1::integer), "
        "expires_at = expires_at - make_interval(hours => $1::integer)",
        static_cast<int>(time.count()));
  };
  const auto keep_so_many = [&](int count) {
    execute(
        "INSERT INTO credential_offers (pickup_sha256, sealed, identity, offered_by, expires_at) SELECT "
        "sha256(convert_to(i::text, 'UTF8')), 'sealed', 'machines/m1', 'users/it', clock_timestamp() + interval '1 "
        "hour' "
        "FROM generate_series(1, $1::integer) i",
        count);
  };
  test({*CredentialsIn(database.database()), let_pass, keep_so_many});
}

TEST(CredentialStore, WhatIsOfferedIsTakenOnceAsItWas) {
  OnBothCredentialStores([](const CredentialStoreUnderTest& credentials) {
    const auto ends = credentials.Keep(OfferUnder("m1"));
    ASSERT_TRUE(ends.ok()) << ends.status();
    // One clock, as both run on one computer.
    const Instant now = std::chrono::system_clock::now();
    EXPECT_GT(*ends, now + hours(1));
    EXPECT_LT(*ends, now + hours(3));
    ASSERT_TRUE(credentials.Keep(OfferUnder("m2")).ok());
    const std::optional<CredentialOffer> taken = credentials.Take("m1");
    ASSERT_TRUE(taken.has_value());
    EXPECT_EQ(taken->pickup_sha256, Sha256Hex("m1"));
    EXPECT_EQ(taken->sealed, OfferUnder("m1").sealed);
    EXPECT_EQ(taken->identity, "machines/m1");
    EXPECT_EQ(taken->offered_by, "users/it");
    EXPECT_FALSE(credentials.Take("m1").has_value());
    EXPECT_FALSE(credentials.Take("m3").has_value());
    EXPECT_TRUE(credentials.Take("m2").has_value());
  });
}

TEST(CredentialStore, TheSameOfferAgainChangesNothing) {
  OnBothCredentialStores([](const CredentialStoreUnderTest& credentials) {
    const auto ends = credentials.Keep(OfferUnder("m1"));
    ASSERT_TRUE(ends.ok()) << ends.status();
    CredentialOffer again = OfferUnder("m1");
    again.sealed = "others";
    again.valid_hours = 20;
    EXPECT_EQ(*credentials.Keep(again), *ends);
    EXPECT_EQ(credentials.Take("m1")->sealed, OfferUnder("m1").sealed);
    EXPECT_FALSE(credentials.Take("m1").has_value());
  });
}

TEST(CredentialStore, AnOfferThatIsOverIsNotGivenAndItsPlaceIsFree) {
  OnBothCredentialStores([](const CredentialStoreUnderTest& credentials) {
    const auto first = credentials.Keep(OfferUnder("m1"));
    ASSERT_TRUE(first.ok()) << first.status();
    credentials.let_pass(hours(1));
    EXPECT_EQ(*credentials.Keep(OfferUnder("m1")), *first - hours(1));  // still waits
    credentials.let_pass(hours(1));
    EXPECT_FALSE(credentials.Take("m1").has_value());
    EXPECT_GT(*credentials.Keep(OfferUnder("m1")), *first - hours(1));
    EXPECT_TRUE(credentials.Take("m1").has_value());
  });
}

TEST(CredentialStore, NoMoreThanAThousandWait) {
  OnBothCredentialStores([](const CredentialStoreUnderTest& credentials) {
    credentials.keep_so_many(999);
    ASSERT_TRUE(credentials.Keep(OfferUnder("m1")).ok());
    EXPECT_EQ(credentials.Keep(OfferUnder("m2")).status().code(), absl::StatusCode::kResourceExhausted);
    EXPECT_TRUE(credentials.Take("m1").has_value());
    EXPECT_TRUE(credentials.Keep(OfferUnder("m2")).ok());
    // What is over counts no more.
    credentials.let_pass(hours(3));
    EXPECT_TRUE(credentials.Keep(OfferUnder("m3")).ok());
  });
}

TEST(CredentialStore, OfManyWhoTakeAtOnceOneGetsIt) {
  OnBothCredentialStores([](const CredentialStoreUnderTest& credentials) {
    constexpr int kTakers = 4;
    ASSERT_TRUE(credentials.Keep(OfferUnder("m1")).ok());
    std::atomic<int> taken{0};
    std::vector<std::thread> takers;
    for (int i = 0; i < kTakers; ++i) takers.emplace_back([&] { taken += credentials.Take("m1").has_value(); });
    for (std::thread& taker : takers) taker.join();
    EXPECT_EQ(taken, 1);
  });
}

TEST(CredentialStore, RenewalsAreOfTheirKeyAndTheLongestComesFirst) {
  OnBothCredentialStores([](const CredentialStoreUnderTest& credentials) {
    const Instant ends = std::chrono::floor<std::chrono::seconds>(std::chrono::system_clock::now()) + hours(24);
    EXPECT_THAT(credentials.Serials("key"), IsEmpty());
    ASSERT_TRUE(credentials.Keep(RenewalOf("key", "b2", ends)).ok());
    ASSERT_TRUE(credentials.Keep(RenewalOf("key", "c3", ends + hours(1))).ok());
    ASSERT_TRUE(credentials.Keep(RenewalOf("key", "a1", ends)).ok());
    ASSERT_TRUE(credentials.Keep(RenewalOf("another", "d4", ends)).ok());
    EXPECT_THAT(credentials.Serials("key"), ElementsAre("c3", "a1", "b2"));
    EXPECT_THAT(credentials.Serials("another"), ElementsAre("d4"));
    // The same certificate again changes nothing.
    CertificateRenewal again = RenewalOf("another", "d4", ends + hours(9));
    again.offered_by = "users/boss";
    ASSERT_TRUE(credentials.Keep(again).ok());
    const auto found = credentials.store.FindRenewals(Sha256Hex("another"), Soon());
    ASSERT_TRUE(found.ok() && found->size() == 1) << found.status();
    const CertificateRenewal& renewal = found->front();
    EXPECT_EQ(renewal.public_key_sha256, Sha256Hex("another"));
    EXPECT_EQ(renewal.identity, "machines/m1");
    EXPECT_EQ(renewal.certificate_pem, "pem of d4");
    EXPECT_EQ(renewal.not_after, ends);
    EXPECT_EQ(renewal.offered_by, "users/it");
    for (int i = 0; i < 12; ++i)
      ASSERT_TRUE(credentials.Keep(RenewalOf("key", "e" + std::to_string(10 + i), ends + hours(2 + i))).ok());
    EXPECT_THAT(credentials.Serials("key"),
                ElementsAre("e21", "e20", "e19", "e18", "e17", "e16", "e15", "e14", "e13", "e12"));
  });
}

TEST(CredentialStore, WhatIsWantedNoMoreIsNotDone) {
  OnBothCredentialStores([](const CredentialStoreUnderTest& credentials) {
    const auto is_gone = [] { return false; };
    const Instant ends = std::chrono::system_clock::now() + hours(24);
    EXPECT_EQ(credentials.store.KeepOffer(OfferUnder("m1"), is_gone, Soon()).status().code(),
              absl::StatusCode::kCancelled);
    EXPECT_FALSE(credentials.Take("m1").has_value());
    ASSERT_TRUE(credentials.Keep(OfferUnder("m1")).ok());
    EXPECT_EQ(credentials.store.TakeOffer(Sha256Hex("m1"), is_gone, Soon()).status().code(),
              absl::StatusCode::kCancelled);
    EXPECT_TRUE(credentials.Take("m1").has_value());
    EXPECT_EQ(credentials.store.KeepRenewal(RenewalOf("key", "a1", ends), is_gone, Soon()).code(),
              absl::StatusCode::kCancelled);
    EXPECT_THAT(credentials.Serials("key"), IsEmpty());
  });
}

}  // namespace
}  // namespace sixpoint::storage
