#include "identity/password.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <ctime>

#include "refusal/refusal.h"

namespace sixpoint::identity {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

constexpr char kPassword[] = "correct horse battery staple";

TEST(Password, MatchesItselfAndNothingElse) {
  const auto phc = HashPassword(kPassword), again = HashPassword(kPassword);
  ASSERT_TRUE(phc.ok()) << phc.status();
  EXPECT_THAT(*phc, StartsWith("$argon2id$v=19$m=65536,t=3,p=1$"));
  EXPECT_NE(*phc, *again);  // its salt
  EXPECT_THAT(*phc, Not(HasSubstr("horse")));
  EXPECT_EQ(*PasswordMatches(*phc, kPassword), true);
  for (const std::string other :
       {"", "correct horse battery stapl", "correct horse battery staple ", "Correct horse battery staple"})
    EXPECT_EQ(*PasswordMatches(*phc, other), false) << other;
  // What another program made, with other parameters: the argon2 tool's own example of a text that holds.
  EXPECT_FALSE(PasswordMatches("$argon2i$v=19$m=65536,t=3,p=1$c29tZXNhbHQ$AAAA", kPassword).ok());
}

// A row does not decide how much memory and time this process takes.
TEST(Password, ATextThatWantsTooMuchIsRefused) {
  for (const std::string phc : {"$argon2id$v=19$m=4194304,t=3,p=1$c29tZXNhbHRzb21lc2FsdA$AAAA",
                                "$argon2id$v=19$m=65536,t=1000,p=1$c29tZXNhbHRzb21lc2FsdA$AAAA",
                                "$argon2id$v=19$m=65536,t=3,p=64$c29tZXNhbHRzb21lc2FsdA$AAAA", "x"}) {
    const std::clock_t begin = std::clock();
    EXPECT_FALSE(PasswordMatches(phc, kPassword).ok()) << phc;
    EXPECT_LT(std::clock() - begin, CLOCKS_PER_SEC / 20) << phc;
  }
}

// Who asks for an account that is not there waits as long. Processor time, which a busy machine does not lengthen.
TEST(Password, NobodysTakesAsLong) {
  const auto phc = HashPassword(kPassword);
  ASSERT_TRUE(phc.ok());
  const auto spent_ms = [](const std::string& of) {
    double least_ms = 1e9;
    for (int i = 0; i < 5; ++i) {
      const std::clock_t begin = std::clock();
      EXPECT_EQ(*PasswordMatches(of, "something else"), false);
      least_ms = std::min(least_ms, 1e3 * static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC);
    }
    return least_ms;
  };
  const double theirs_ms = spent_ms(*phc), nobodys_ms = spent_ms("");
  std::printf("one password: %.0f ms of processor time; nobody's: %.0f ms\n", theirs_ms, nobodys_ms);
  EXPECT_GT(theirs_ms, 10);
  EXPECT_NEAR(nobodys_ms / theirs_ms, 1, 0.5);
}

TEST(Password, ANewOneIsLongEnoughAndNeverTold) {
  EXPECT_TRUE(CheckNewPassword("password", kPassword).ok());
  EXPECT_TRUE(CheckNewPassword("password", std::string(128, 'x')).ok());
  EXPECT_TRUE(CheckNewPassword("password", "überlänge-äö").ok());
  for (const std::string& bad : {std::string("shortsecret"), std::string(), "longsecret" + std::string(119, 'x'),
                                 std::string("secret\xff\xfe 123456"), std::string("secret\n1234567"),
                                 std::string("secret") + '\0' + "234567"}) {
    const absl::Status status = CheckNewPassword("new_password", bad);
    ASSERT_EQ(ViolationsOf(status).size(), 1u) << status;
    EXPECT_EQ(ViolationsOf(status)[0].field, "new_password");
    EXPECT_THAT(std::string(status.message()), Not(HasSubstr("secret")));
  }
}

}  // namespace
}  // namespace sixpoint::identity
