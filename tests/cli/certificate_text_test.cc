#include "cli/certificate_text.h"

#include <gtest/gtest.h>

#include <chrono>
#include <nlohmann/json.hpp>

namespace sixpoint::cli {
namespace {

using std::chrono::hours;

constexpr hours kDay{24};

// One of so many days, in its last so many.
CertificateState StateWith(int days, int left_days) {
  identity::IssuedCertificate certificate;
  certificate.not_before = identity::TimePoint(400 * kDay);
  certificate.not_after = certificate.not_before + days * kDay;
  return StateOf(certificate, certificate.not_after - left_days * kDay);
}

TEST(CertificateState, IsToldAMonthBeforeItsEnd) {
  EXPECT_EQ(StateWith(397, 31), CertificateState::kValid);
  EXPECT_EQ(StateWith(397, 30), CertificateState::kValid);
  EXPECT_EQ(StateWith(397, 29), CertificateState::kExpiresSoon);
  EXPECT_EQ(StateWith(397, 0), CertificateState::kExpired);
}

TEST(CertificateState, OfOneForAMonthIsToldInItsLastThird) {
  EXPECT_EQ(StateWith(30, 30), CertificateState::kValid);
  EXPECT_EQ(StateWith(30, 10), CertificateState::kValid);
  EXPECT_EQ(StateWith(30, 9), CertificateState::kExpiresSoon);
}

TEST(CertificateState, RevokedIsRevokedToItsEndAndAfter) {
  identity::IssuedCertificate certificate;
  certificate.not_after = std::chrono::system_clock::now() + kDay;
  certificate.revoked_at = std::chrono::system_clock::now();
  EXPECT_EQ(StateText(certificate), "revoked");
  certificate.not_after -= 10 * kDay;
  EXPECT_EQ(StateText(certificate), "revoked");
}

TEST(CertificateJson, HoldsAll) {
  identity::IssuedCertificate certificate;
  certificate.serial = "0a1b";
  certificate.identity = {identity::Kind::kUser, "jane", {identity::Role::kEngineer, identity::Role::kQuality}};
  certificate.not_before = identity::TimePoint(kDay);
  certificate.not_after = identity::TimePoint(2 * kDay);
  const nlohmann::json json = CertificateToJson(certificate);
  EXPECT_EQ(json, (nlohmann::json{{"serial", "0a1b"},
                                  {"who", "users/jane"},
                                  {"roles", {"engineer", "quality"}},
                                  {"hosts", nlohmann::json::array()},
                                  {"from", "1970-01-02T00:00:00Z"},
                                  {"until", "1970-01-03T00:00:00Z"},
                                  {"state", "expired"}}));
}

}  // namespace
}  // namespace sixpoint::cli
