// Whose certificate is due to be followed by another.
#include "cli/certs_handover.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace sixpoint::cli {
namespace {

using std::chrono::hours;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

const identity::TimePoint kNow = std::chrono::system_clock::from_time_t(1'800'000'000);

identity::IssuedCertificate Given(const std::string& who, hours since, hours left, const std::string& key,
                                  bool revoked = false) {
  identity::IssuedCertificate certificate;
  const bool user = who.rfind("users/", 0) == 0;
  certificate.identity = identity::IdentityOf(who, user ? std::vector<identity::Role>{identity::Role::kEngineer}
                                                        : std::vector<identity::Role>{})
                             .value();
  certificate.serial = key + std::to_string(since.count());
  certificate.not_before = kNow - since;
  certificate.not_after = kNow + left;
  certificate.public_key_sha256 = key;
  if (revoked) certificate.revoked_at = kNow;
  return certificate;
}

std::vector<std::string> Serials(const std::vector<identity::IssuedCertificate>& certificates) {
  std::vector<std::string> serials;
  for (const auto& one : certificates) serials.push_back(one.serial);
  return serials;
}

TEST(HandOver, WhatHasLessThanHalfLeftIsDue) {
  const HandedOver over = HandOver(
      {Given("machines/m1", hours(20), hours(21), "a"), Given("machines/m2", hours(20), hours(19), "b")}, {}, kNow);
  EXPECT_THAT(Serials(over.due), ElementsAre("b20"));
  EXPECT_THAT(over.to_offer, IsEmpty());
}

TEST(HandOver, NothingFollowsWhatDoesNotCountNorServicesNorUsersWhomNobodyNames) {
  const std::vector<identity::IssuedCertificate> issued = {
      Given("machines/m1", hours(20), hours(-1), "a"), Given("machines/m2", hours(20), hours(0), "b"),
      Given("machines/m3", hours(20), hours(1), "c", /*revoked=*/true),
      Given("services/ingest", hours(20), hours(1), "d"), Given("users/jane", hours(20), hours(1), "e")};
  EXPECT_THAT(HandOver(issued, {}, kNow).due, IsEmpty());
  EXPECT_THAT(Serials(HandOver(issued, {"users/jane"}, kNow).due), ElementsAre("e20"));
}

// A newest one that was revoked, or that nobody took, does not hide the one that a machine works with.
TEST(HandOver, EachKeyIsByItself) {
  EXPECT_THAT(Serials(HandOver({Given("machines/m1", hours(1), hours(100), "a", /*revoked=*/true),
                                Given("machines/m1", hours(2), hours(100), "b"),
                                Given("machines/m1", hours(200), hours(1), "c")},
                               {}, kNow)
                          .due),
              ElementsAre("c200"));
}

// What was made and not brought to the plant is brought with the next.
TEST(HandOver, WhatFollowedAnotherIsOfferedAgain) {
  const HandedOver over = HandOver(
      {Given("machines/m1", hours(1), hours(100), "a"), Given("machines/m1", hours(200), hours(1), "a")}, {}, kNow);
  EXPECT_THAT(over.due, IsEmpty());
  EXPECT_THAT(Serials(over.to_offer), ElementsAre("a1"));
}

}  // namespace
}  // namespace sixpoint::cli
