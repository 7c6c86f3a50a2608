#include "identity/certificate_token.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "identity/base64url.h"
#include "identity/session.h"
#include "tests/identity/forged.h"

namespace sixpoint::identity {
namespace {

using std::chrono::hours;
using std::chrono::minutes;
using std::chrono::seconds;
using testing::Must;

class CertificateTokenTest : public ::testing::Test {
 protected:
  std::filesystem::path FileOf(const std::string& who, const std::vector<Role>& roles = {}) {
    const std::filesystem::path folder = plant_.beside(who.substr(who.find('/') + 1));
    EXPECT_TRUE(WriteCredentials(folder, plant_.Issue(who, roles)).ok());
    return folder / kIdentityFile;
  }
  std::string Token(const std::filesystem::path& file) {
    return Must(SignCertificateToken(file, now_, now_ + minutes(10)));
  }
  SessionStanding StandingOf(const std::string& token) { return sessions_.Judge(token).standing; }
  // With another word in one of its first two parts, its signature as it was.
  static std::string Changed(const std::string& token, int part, const std::string& from, const std::string& to) {
    const std::size_t first = token.find('.'), second = token.find('.', first + 1);
    std::string texts[] = {FromBase64Url(token.substr(0, first)).value(),
                           FromBase64Url(token.substr(first + 1, second - first - 1)).value()};
    std::string& text = texts[part];
    EXPECT_NE(text.find(from), std::string::npos) << text;
    text.replace(text.find(from), from.size(), to);
    return ToBase64Url(texts[0]) + "." + ToBase64Url(texts[1]) + token.substr(second);
  }

  testing::Plant plant_;
  TimePoint now_ = std::chrono::time_point_cast<seconds>(std::chrono::system_clock::now());
  Trust trust_{plant_.certificate_file(), plant_.revoked_file()};
  SessionTrust sessions_{&trust_, [this] { return now_; }};
};

TEST_F(CertificateTokenTest, SaysWhoHoldsTheCertificate) {
  for (const auto& [who, roles] :
       {std::pair("machines/m1", std::vector<Role>()), std::pair("users/jane", std::vector<Role>{Role::kEngineer})}) {
    const std::string token = Token(FileOf(who, roles));
    EXPECT_LE(token.size(), kLongestSession_bytes);
    for (int i = 0; i < 2; ++i) {
      const SessionJudgement judged = sessions_.Judge(token);
      ASSERT_EQ(judged.standing, SessionStanding::kGood) << judged.why_not;
      EXPECT_EQ(judged.session.person.Text(), who);
      EXPECT_EQ(judged.session.signed_in_by, SignedInBy::kCertificate);
      EXPECT_EQ(judged.session.since, now_);
    }
    EXPECT_EQ(Must(ReadSession(token)).person.Text(), who);
  }
}

TEST_F(CertificateTokenTest, LastsAQuarterOfAnHourAtMost) {
  const auto file = FileOf("machines/m1");
  EXPECT_FALSE(SignCertificateToken(file, now_, now_ + minutes(16)).ok());
  EXPECT_FALSE(SignCertificateToken(file, now_, now_).ok());
  const std::string token = Token(file);
  now_ += minutes(10) - seconds(1);
  EXPECT_EQ(StandingOf(token), SessionStanding::kGood);
  now_ += seconds(1);
  EXPECT_EQ(StandingOf(token), SessionStanding::kOver);
  now_ -= hours(1);  // made in the future
  EXPECT_EQ(StandingOf(token), SessionStanding::kNotValid);
}

TEST_F(CertificateTokenTest, CountsAsItsCertificateDoes) {
  const auto file = FileOf("machines/m1");
  const std::string token = Token(file);
  EXPECT_EQ(StandingOf(token), SessionStanding::kGood);
  ASSERT_TRUE(plant_.authority().Revoke(Must(ReadCertificate(file)).serial).ok());
  EXPECT_EQ(StandingOf(token), SessionStanding::kNotValid);
  EXPECT_EQ(StandingOf(Token(FileOf("services/plant"))), SessionStanding::kNotValid);
  testing::Plant other;
  const std::filesystem::path folder = other.beside("m1");
  ASSERT_TRUE(WriteCredentials(folder, other.Issue("machines/m1", {})).ok());
  EXPECT_EQ(StandingOf(Token(folder / kIdentityFile)), SessionStanding::kNotValid);
}

TEST_F(CertificateTokenTest, IsRefusedWhateverIsChanged) {
  const std::string token = Token(FileOf("machines/m1"));
  const std::string later = std::to_string(std::chrono::duration_cast<seconds>(now_.time_since_epoch()).count() + 700),
                    ends = std::to_string(std::chrono::duration_cast<seconds>(now_.time_since_epoch()).count() + 600);
  EXPECT_EQ(StandingOf(Changed(token, 1, ends, later)), SessionStanding::kNotValid);
  EXPECT_EQ(StandingOf(Changed(token, 1, "sixpoint", "sixpoinT")), SessionStanding::kNotValid);
  EXPECT_EQ(StandingOf(Changed(token, 0, "ES256", "none")), SessionStanding::kNotValid);
  EXPECT_EQ(StandingOf(Changed(token, 0, "ES256", "HS256")), SessionStanding::kNotValid);
  EXPECT_EQ(StandingOf(Changed(token, 0, "\"x5c\"", "\"x5t\"")), SessionStanding::kNotValid);
  EXPECT_EQ(StandingOf(Changed(token, 0, "{", "{\"crit\":[\"exp\"],")), SessionStanding::kNotValid);
  // Another's certificate over this one's signature.
  const std::string other = Token(FileOf("machines/m2"));
  const std::string mixed = other.substr(0, other.find('.')) + token.substr(token.find('.'));
  EXPECT_EQ(StandingOf(mixed), SessionStanding::kNotValid);
  for (const char* const text : {"eyJ", "eyJ.eyJ.", "eyJ.e30.AA", "eyJhbGciOiJFUzI1NiJ9.e30.AA"})
    EXPECT_EQ(StandingOf(text), SessionStanding::kNotValid) << text;
  EXPECT_EQ(StandingOf("eyJ" + std::string(5000, 'A')), SessionStanding::kNotValid);
  for (std::size_t i = 0; i < token.size(); i += 7) {
    std::string bent = token;
    bent[i] = bent[i] == 'A' ? 'B' : 'A';
    if (bent == token) continue;
    EXPECT_NE(StandingOf(bent), SessionStanding::kGood) << i;
  }
}

}  // namespace
}  // namespace sixpoint::identity
