#include "identity/session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openssl/bn.h>

#include <cstring>
#include <ctime>

#include "identity/base64url.h"
#include "refusal/refusal.h"
#include "tests/identity/forged.h"

namespace sixpoint::identity {
namespace {

using std::chrono::hours;
using std::chrono::minutes;
using std::chrono::seconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::Must;

constexpr char kTokenLetters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_.";

class SessionTest : public ::testing::Test {
 protected:
  std::filesystem::path FolderOf(const std::string& who, const std::vector<Role>& roles = {}) {
    const std::filesystem::path folder = plant_.beside(who.substr(who.find('/') + 1));
    EXPECT_TRUE(WriteCredentials(folder, plant_.Issue(who, roles)).ok());
    return folder / kIdentityFile;
  }
  Session Jane() const {
    return {Must(IdentityOf("users/jane", {Role::kEngineer, Role::kQuality})), SignedInBy::kPassword, now_,
            now_ + kLongestToken};
  }

  testing::Plant plant_;
  // Whole microseconds, as a token keeps them.
  TimePoint now_ = std::chrono::time_point_cast<std::chrono::microseconds>(std::chrono::system_clock::now());
  Trust trust_{plant_.certificate_file(), plant_.revoked_file()};
  SessionTrust sessions_{&trust_, [this] { return now_; }};
};

TEST_F(SessionTest, SaysWhoSignedIn) {
  const std::string token = Must(SignSession(Jane(), FolderOf("services/plant")));
  std::printf("a token has %zu bytes\n", token.size());
  EXPECT_LE(token.size(), kLongestSession_bytes);
  EXPECT_EQ(token.find_first_not_of(kTokenLetters), std::string::npos);
  for (int i = 0; i < 2; ++i) {  // and when it is known already
    const SessionJudgement judged = sessions_.Judge(token);
    ASSERT_EQ(judged.standing, SessionStanding::kGood) << judged.why_not;
    EXPECT_EQ(judged.session.person.Text(), "users/jane");
    EXPECT_THAT(judged.session.person.roles, ElementsAre(Role::kEngineer, Role::kQuality));
    EXPECT_EQ(judged.session.signed_in_by, SignedInBy::kPassword);
    EXPECT_EQ(judged.session.since, now_);
    EXPECT_EQ(judged.session.until, now_ + kLongestToken);
  }
  EXPECT_EQ(Must(ReadSession(token)).person.Text(), "users/jane");
}

TEST_F(SessionTest, IsOverAtItsEnd) {
  const std::string token = Must(SignSession(Jane(), FolderOf("services/plant")));
  now_ += kLongestToken - seconds(1);
  EXPECT_EQ(sessions_.Judge(token).standing, SessionStanding::kGood);
  now_ += seconds(1);
  const SessionJudgement over = sessions_.Judge(token);
  EXPECT_EQ(over.standing, SessionStanding::kOver);
  EXPECT_EQ(over.session.person.Text(), "users/jane");
  EXPECT_THAT(over.why_not, HasSubstr("want"));
}

// What a call costs with it: the first time a service sees it, and from then on.
TEST_F(SessionTest, IsVerifiedOnce) {
  const std::string token = Must(SignSession(Jane(), FolderOf("services/plant")));
  const auto spent_us = [&](int times, const std::function<void()>& work) {
    const std::clock_t begin = std::clock();
    for (int i = 0; i < times; ++i) work();
    return 1e6 * static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC / times;
  };
  const double first_us = spent_us(200, [&] {
    SessionTrust fresh(&trust_, [this] { return now_; });
    EXPECT_EQ(fresh.Judge(token).standing, SessionStanding::kGood);
  });
  const double again_us = spent_us(2000, [&] { EXPECT_EQ(sessions_.Judge(token).standing, SessionStanding::kGood); });
  std::printf("a session is judged in %.0f us of processor time, known already in %.0f us\n", first_us, again_us);
  EXPECT_LT(again_us, first_us);
}

// Whatever one byte becomes, and wherever one goes, comes or is cut: none of it is believed.
TEST_F(SessionTest, NoMutationIsBelieved) {
  const std::string token = Must(SignSession(Jane(), FolderOf("services/plant")));
  int tried = 0, read = 0;
  const auto refused = [&](const std::string& mutant) {
    if (mutant == token) return;
    ++tried;
    if (ReadSession(mutant).ok()) ++read;
    ASSERT_EQ(sessions_.Judge(mutant).standing, SessionStanding::kNotValid) << mutant;
  };
  for (std::size_t at = 0; at < token.size(); ++at) {
    std::string mutant = token;
    const char* const letter = std::strchr(kTokenLetters, token[at]);
    for (const char other : {kTokenLetters[(letter - kTokenLetters + 1) % 65],
                             kTokenLetters[(letter - kTokenLetters + 32) % 65], '=', '\0', '\xff'}) {
      mutant[at] = other;
      refused(mutant);
    }
    refused(std::string(token).erase(at, 1));
    refused(std::string(token).insert(at, 1, 'A'));
    refused(token.substr(0, at));
  }
  for (const char* tail : {"=", ".", "A", " ", "\n", ".AAAA"}) refused(token + tail);
  refused(" " + token);
  refused(token + token);
  refused(std::string(5000, 'A'));
  EXPECT_EQ(sessions_.Judge(token).standing, SessionStanding::kGood);
  std::printf("%d mutants, %d of them of a token's form, none believed\n", tried, read);
  EXPECT_GT(read, 0);  // of some only the signature says so
}

// Of an ECDSA signature another half is as good to mathematics; one session has one text.
TEST_F(SessionTest, TheOtherHalfOfItsSignatureIsNotBelieved) {
  const std::string token = Must(SignSession(Jane(), FolderOf("services/plant")));
  const std::size_t last = token.rfind('.') + 1;
  std::string raw = *FromBase64Url(token.substr(last));
  BIGNUM* order = nullptr;
  BN_hex2bn(&order, "FFFFFFFF00000000FFFFFFFFFFFFFFFFBCE6FAADA7179E84F3B9CAC2FC632551");
  auto* const s_bytes = reinterpret_cast<unsigned char*>(raw.data()) + 32;
  BIGNUM* const s = BN_bin2bn(s_bytes, 32, nullptr);
  BN_sub(s, order, s);
  BN_bn2binpad(s, s_bytes, 32);
  BN_free(s);
  BN_free(order);
  EXPECT_EQ(sessions_.Judge(token.substr(0, last) + ToBase64Url(raw)).standing, SessionStanding::kNotValid);
}

// A good certificate signs for itself alone: only the plant service says who signed in.
TEST_F(SessionTest, OfNobodyElsesKeyIsBelieved) {
  for (const auto& [who, roles] :
       std::vector<std::pair<std::string, std::vector<Role>>>{{"services/ingest", {}},
                                                              {"services/gateway", {}},
                                                              {"users/plant", {Role::kAdmin}},
                                                              {"machines/plant", {}}}) {
    const std::filesystem::path file =
        who == "services/gateway" ? plant_.beside("gateway") / kIdentityFile : FolderOf(who, roles);
    if (who == "services/gateway") {
      CertificateWish wish;
      wish.identity = Must(IdentityOf(who, {}));
      ASSERT_TRUE(WriteCredentials(plant_.beside("gateway"), plant_.Issue(wish)).ok());
    }
    const std::string token = Must(SignSession(Jane(), file));
    EXPECT_EQ(sessions_.Judge(token).standing, SessionStanding::kNotValid) << who;
  }
  testing::Plant other("elsewhere");
  const auto folder = other.beside("plant");
  ASSERT_TRUE(WriteCredentials(folder, other.Issue("services/plant")).ok());
  EXPECT_EQ(sessions_.Judge(Must(SignSession(Jane(), folder / kIdentityFile))).standing, SessionStanding::kNotValid);
}

// One token's words under another's certificate or signature.
TEST_F(SessionTest, PartsOfTwoAreNone) {
  const auto file = FolderOf("services/plant");
  Session boss = Jane();
  boss.person = Must(IdentityOf("users/boss", {Role::kAdmin}));
  const std::string first = Must(SignSession(Jane(), file)), second = Must(SignSession(boss, file));
  const auto part = [](const std::string& token, int number) {
    std::size_t begin = 0;
    for (int i = 0; i < number; ++i) begin = token.find('.', begin) + 1;
    return token.substr(begin, token.find('.', begin) - begin);
  };
  EXPECT_EQ(sessions_.Judge("s1." + part(second, 1) + "." + part(first, 2) + "." + part(first, 3)).standing,
            SessionStanding::kNotValid);
  EXPECT_EQ(sessions_.Judge("s1." + part(first, 1) + "." + part(second, 2) + "." + part(second, 3)).standing,
            SessionStanding::kNotValid);
}

TEST_F(SessionTest, EndsWithThePlantsCertificate) {
  const Credentials credentials = plant_.Issue("services/plant");
  const auto folder = plant_.beside("plant");
  ASSERT_TRUE(WriteCredentials(folder, credentials).ok());
  const std::string token = Must(SignSession(Jane(), folder / kIdentityFile));
  EXPECT_EQ(sessions_.Judge(token).standing, SessionStanding::kGood);
  ASSERT_TRUE(plant_.authority().Revoke(testing::SerialOf(credentials)).ok());
  EXPECT_EQ(sessions_.Judge(token).standing, SessionStanding::kNotValid);
  std::filesystem::remove(plant_.revoked_file());
  EXPECT_EQ(sessions_.Judge(token).standing, SessionStanding::kUndecidable);
}

TEST_F(SessionTest, LastsNoLongerThanItMay) {
  const auto file = FolderOf("services/plant");
  Session session = Jane();
  session.until = now_ + hours(13);
  EXPECT_TRUE(absl::IsInvalidArgument(SignSession(session, file).status()));
  session.until = now_;
  EXPECT_TRUE(absl::IsInvalidArgument(SignSession(session, file).status()));
  // What a plant of other habits signed: an hour at once, or from tomorrow on.
  session.until = now_ + hours(1);
  EXPECT_EQ(sessions_.Judge(Must(SignSession(session, file))).standing, SessionStanding::kNotValid);
  session = Jane();
  session.since += hours(24);
  session.until += hours(24);
  EXPECT_EQ(sessions_.Judge(Must(SignSession(session, file))).standing, SessionStanding::kNotValid);
  // Clocks that differ by less than a minute do not matter.
  session = Jane();
  session.since += seconds(50);
  EXPECT_EQ(sessions_.Judge(Must(SignSession(session, file))).standing, SessionStanding::kGood);
}

TEST_F(SessionTest, IsOfAPerson) {
  const auto file = FolderOf("services/plant");
  Session session = Jane();
  for (const char* who : {"machines/m1", "services/plant", "services/gateway"}) {
    session.person = Must(IdentityOf(who, {}));
    EXPECT_TRUE(absl::IsInvalidArgument(SignSession(session, file).status())) << who;
  }
}

TEST(Base64Url, IsOneTextForTheSameBytes) {
  for (const auto& [bytes, text] : std::vector<std::pair<std::string, std::string>>{
           {"", ""}, {"f", "Zg"}, {"fo", "Zm8"}, {"foo", "Zm9v"}, {"foob", "Zm9vYg"}, {"\xff\xfe\xfb", "__77"}}) {
    EXPECT_EQ(ToBase64Url(bytes), text);
    EXPECT_EQ(FromBase64Url(text), bytes);
  }
  for (const char* other : {"Zh", "Zm9", "Zg==", "Z", "Zm9v ", "Zm9+", "Zm9/", "Zm9vY"})
    EXPECT_FALSE(FromBase64Url(other)) << other;
}

}  // namespace
}  // namespace sixpoint::identity
