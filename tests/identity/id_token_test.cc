// ID tokens that another library made (tests/identity/make_id_tokens, by PyJWT): those that hold, and what is known of how they are forged.
#include "identity/id_token.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <map>

#include "tests/identity/forged.h"

namespace sixpoint::identity {
namespace {

namespace fs = std::filesystem;
using testing::Contents;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::Must;
using ::testing::Not;

class IdTokenTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (std::system("/usr/bin/python3 -c 'import jwt, cryptography' 2>/dev/null") != 0)
      GTEST_SKIP() << "python3-jwt or python3-cryptography is absent";
    const std::string command = std::string(std::getenv("SIXPOINT_SOURCE_DIR")) + "/tests/identity/make_id_tokens " +
                                (folder_ / "").string() + " " +
                                std::to_string(std::chrono::system_clock::to_time_t(now_));
    ASSERT_EQ(std::system(command.c_str()), 0);
    policy_.issuer = "https://id.plant.example";
    policy_.client_id = "sixpoint";
    policy_.roles = {{"turbine-engineers", Role::kEngineer}, {"turbine-admins", Role::kAdmin}};
  }

  // Of each whose file begins so, by the rest of its name.
  std::map<std::string, std::string> Tokens(const std::string& kind) const {
    std::map<std::string, std::string> tokens;
    for (const std::string& name : testing::NamesIn(folder_ / ""))
      if (name.rfind(kind + ".", 0) == 0) tokens[name.substr(kind.size() + 1)] = Contents(folder_ / name);
    return tokens;
  }
  KeySet Keys(const std::string& file = "keys.json") const { return Must(KeySet::Read(Contents(folder_ / file))); }
  absl::StatusOr<SignedInPerson> Judged(const std::string& token) const {
    return JudgeIdToken(token, "n-1", policy_, Keys(), now_);
  }

  testing::TemporaryFolder folder_;
  const TimePoint now_ = std::chrono::system_clock::now();
  IdTokenPolicy policy_;
};

TEST_F(IdTokenTest, WhatTheProviderSignedIsBelieved) {
  const auto tokens = Tokens("good");
  ASSERT_GE(tokens.size(), 8u);
  for (const auto& [name, token] : tokens) {
    const auto person = Judged(token);
    ASSERT_TRUE(person.ok()) << name << ": " << person.status();
    EXPECT_EQ(person->person.Text(), "users/jane") << name;
    EXPECT_THAT(person->person.roles, ElementsAre(Role::kEngineer)) << name;
    EXPECT_EQ(person->subject, "f3a1") << name;
  }
}

TEST_F(IdTokenTest, NoForgeryIsBelieved) {
  const auto tokens = Tokens("bad");
  ASSERT_GE(tokens.size(), 70u);
  for (const auto& [name, token] : tokens) {
    const absl::Status refused = Judged(token).status();
    // A key that the set does not name may be a new one.
    EXPECT_TRUE(absl::IsUnauthenticated(refused) || (absl::IsNotFound(refused) && name.rfind("k", 0) == 0) ||
                (absl::IsNotFound(refused) && (name == "exponent_of_one" || name.rfind("hs256", 0) == 0)))
        << name << ": " << refused;
    EXPECT_THAT(std::string(refused.message()), Not(HasSubstr("jane"))) << name;
  }
  std::printf("%zu forged ID tokens, none believed\n", tokens.size());
}

// Every byte: whatever it becomes, its signature does not hold.
TEST_F(IdTokenTest, NoMutationIsBelieved) {
  const std::string token = Tokens("good").at("es256");
  const KeySet keys = Keys();
  for (std::size_t at = 0; at < token.size(); ++at) {
    std::string mutant = token;
    mutant[at] = token[at] == 'A' ? 'B' : 'A';
    EXPECT_FALSE(JudgeIdToken(mutant, "n-1", policy_, keys, now_).ok()) << at;
    EXPECT_FALSE(JudgeIdToken(token.substr(0, at), "n-1", policy_, keys, now_).ok()) << at;
  }
}

TEST_F(IdTokenTest, IsForItsOwnSignInAlone) {
  const std::string token = Tokens("good").at("rs256");
  const KeySet keys = Keys();
  for (const char* nonce : {"", "n-2", "N-1"})
    EXPECT_TRUE(absl::IsUnauthenticated(JudgeIdToken(token, nonce, policy_, keys, now_).status())) << nonce;
  policy_.client_id = "another";
  EXPECT_TRUE(absl::IsUnauthenticated(Judged(token).status()));
  policy_.client_id = "sixpoint";
  EXPECT_TRUE(
      absl::IsUnauthenticated(JudgeIdToken(token, "n-1", policy_, keys, now_ + std::chrono::hours(1)).status()));
}

TEST_F(IdTokenTest, OfAKeyThatIsNotThereItSaysSo) {
  const std::string token = Tokens("good").at("es256");
  const auto unknown = JudgeIdToken(token, "n-1", policy_, Keys("one_key.json"), now_);
  EXPECT_TRUE(absl::IsNotFound(unknown.status())) << unknown.status();
}

TEST(KeySet, IsReadOnlyAsWhatItIs) {
  for (const std::string text :
       {"", "[]", "{}", R"({"keys":{}})", R"({"keys":[]})", R"({"keys":[{"kty":"oct","k":"AAAA"}]})",
        R"({"keys":[{"kty":"RSA","n":"AAAA","e":"AQAB"}]})", R"({"keys":[1,"x",null]})", R"({"keys":[],"keys":[]})"})
    EXPECT_TRUE(absl::IsInvalidArgument(KeySet::Read(text).status())) << text;
  EXPECT_TRUE(absl::IsInvalidArgument(KeySet::Read(std::string(kLongestKeySet_bytes + 1, ' ')).status()));
}

}  // namespace
}  // namespace sixpoint::identity
