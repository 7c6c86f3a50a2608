// Whose certificate is due to be followed by another.
#include "cli/certs_handover.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace sixpoint::cli {
namespace {

using std::chrono::hours;

const identity::TimePoint kNow = std::chrono::system_clock::from_time_t(1'800'000'000);

identity::IssuedCertificate Given(const std::string& who, hours since, hours left, bool revoked = false) {
  identity::IssuedCertificate certificate;
  const bool user = who.rfind("users/", 0) == 0;
  certificate.identity = identity::IdentityOf(who, user ? std::vector<identity::Role>{identity::Role::kEngineer}
                                                        : std::vector<identity::Role>{})
                             .value();
  certificate.not_before = kNow - since;
  certificate.not_after = kNow + left;
  if (revoked) certificate.revoked_at = kNow;
  return certificate;
}

std::vector<std::string> Due(const std::vector<identity::IssuedCertificate>& newest_first) {
  std::vector<std::string> who;
  for (const auto& due : DueForRenewal(newest_first, kNow)) who.push_back(due.identity.Text());
  return who;
}

TEST(DueForRenewal, IsWhatHasLessThanAThirdLeft) {
  EXPECT_THAT(Due({Given("machines/m1", hours(20), hours(11)), Given("machines/m2", hours(20), hours(9)),
                   Given("users/jane", hours(200), hours(1))}),
              ::testing::ElementsAre("machines/m2", "users/jane"));
}

TEST(DueForRenewal, IsNothingThatDoesNotCountAndNoServices) {
  EXPECT_THAT(
      Due({Given("machines/m1", hours(20), hours(-1)), Given("machines/m2", hours(20), hours(0)),
           Given("users/jane", hours(200), hours(1), /*revoked=*/true), Given("services/ingest", hours(20), hours(1))}),
      ::testing::IsEmpty());
}

// A key that another followed is not kept alive, whoever has it.
TEST(DueForRenewal, IsTheNewestOfEachAlone) {
  EXPECT_THAT(Due({Given("machines/m1", hours(1), hours(100)), Given("machines/m1", hours(200), hours(1))}),
              ::testing::IsEmpty());
  EXPECT_THAT(
      Due({Given("machines/m1", hours(1), hours(100), /*revoked=*/true), Given("machines/m1", hours(200), hours(1))}),
      ::testing::IsEmpty());
}

}  // namespace
}  // namespace sixpoint::cli
