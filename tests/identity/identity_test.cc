#include "identity/identity.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "refusal/refusal.h"

namespace sixpoint::identity {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(Identity, IsTheSameAfterItsTextAndItsUris) {
  const std::pair<std::string, std::vector<Role>> known[] = {
      {"machines/m1", {}},
      {"services/ingest", {}},
      {"users/jane", {Role::kEngineer}},
      {"users/mes.line-2_B", {Role::kMesReader}},
      {"users/" + std::string(64, 'x'), {Role::kEngineer, Role::kQuality, Role::kMesReader, Role::kAdmin}},
      {"machines/_", {}},
      {"machines/-1", {}},  // as the plant's registry has it
  };
  for (const auto& [text, roles] : known) {
    SCOPED_TRACE(text);
    const auto identity = IdentityOf(text, roles);
    ASSERT_TRUE(identity.ok()) << identity.status();
    EXPECT_EQ(identity->Text(), text);
    const auto again = IdentityOfUris(UrisOf(*identity));
    ASSERT_TRUE(again.ok()) << again.status();
    EXPECT_EQ(again->Text(), text);
    EXPECT_EQ(again->kind, identity->kind);
    EXPECT_EQ(again->roles, identity->roles);
  }
}

TEST(Identity, HasTheRolesOfItsKindOrThoseThatWereGiven) {
  EXPECT_THAT(IdentityOf("machines/m1", {})->roles, ElementsAre(Role::kMachine));
  EXPECT_THAT(IdentityOf("services/plant", {})->roles, ElementsAre(Role::kService));
  const auto jane = IdentityOf("users/jane", {Role::kAdmin, Role::kEngineer, Role::kAdmin});
  EXPECT_THAT(jane->roles, ElementsAre(Role::kEngineer, Role::kAdmin));
  EXPECT_TRUE(jane->Has(Role::kAdmin));
  EXPECT_FALSE(jane->Has(Role::kQuality));
  EXPECT_FALSE(Identity().Has(Role::kEngineer));
}

TEST(Identity, StandsInUrisAsTheHeaderSays) {
  EXPECT_THAT(UrisOf(*IdentityOf("machines/m1", {})), ElementsAre("urn:sixpoint:machines:m1"));
  EXPECT_THAT(UrisOf(*IdentityOf("services/ingest", {})), ElementsAre("urn:sixpoint:services:ingest"));
  EXPECT_THAT(UrisOf(*IdentityOf("users/jane", {Role::kMesReader, Role::kQuality})),
              ElementsAre("urn:sixpoint:users:jane", "urn:sixpoint:roles:quality", "urn:sixpoint:roles:mes-reader"));
}

TEST(Identity, RefusesNamesThatAreNone) {
  const std::string names[] = {"",           ".",
                               "..",         ".hidden",
                               "a/b",        "../jane",
                               "a b",        "a\n",
                               "a:b",        std::string(65, 'x'),
                               "j\xc3\xa4n", std::string("a\0b", 3),
                               "a%2e",       "a\x7f"};
  for (const std::string& name : names) {
    const auto identity = IdentityOf("users/" + name, {Role::kEngineer});
    ASSERT_EQ(ViolationsOf(identity.status()).size(), 1U) << name;
    EXPECT_EQ(ViolationsOf(identity.status())[0].field, "identity");
  }
  for (const std::string text : {"", "/", "jane", "users", "user/jane", "Users/jane", "/users/jane", "users//jane",
                                 "roles/admin", "nobody/jane", "machines\n/m1"})
    EXPECT_FALSE(IdentityOf(text, {Role::kEngineer}).ok()) << text;
}

TEST(Identity, RefusesRolesThatAreNotItsKinds) {
  const std::pair<std::string, std::vector<Role>> refused[] = {
      {"users/jane", {}},
      {"users/jane", {Role::kMachine}},
      {"users/jane", {Role::kEngineer, Role::kService}},
      {"users/jane", {static_cast<Role>(99)}},
      {"machines/m1", {Role::kAdmin}},
      {"machines/m1", {Role::kMachine}},
      {"services/plant", {Role::kService}},
  };
  for (const auto& [text, roles] : refused) {
    const auto violations = ViolationsOf(IdentityOf(text, roles).status());
    ASSERT_EQ(violations.size(), 1U) << text;
    EXPECT_EQ(violations[0].field, "roles");
  }
}

TEST(Identity, OfUrisIsExactlyOne) {
  const std::string jane = "urn:sixpoint:users:jane", engineer = "urn:sixpoint:roles:engineer";
  EXPECT_EQ(IdentityOfUris({"https://example.com/users/eve", engineer, "urn:sixpoints:users:eve", jane, ""})->Text(),
            "users/jane");
  const std::vector<std::string> refused[] = {
      {},
      {"https://example.com"},
      {"URN:sixpoint:users:jane", engineer},  // only as the authority writes it
      {engineer},
      {jane},
      {jane, jane, engineer},
      {jane, "urn:sixpoint:machines:m1", engineer},
      {jane, "urn:sixpoint:users:eve", engineer},
      {jane, engineer, "urn:sixpoint:roles:root"},
      {jane, engineer, "urn:sixpoint:roles:"},
      {jane, engineer, "urn:sixpoint:roles"},
      {jane, "urn:sixpoint:roles:service"},
      {jane, "urn:sixpoint:roles:engineer:admin"},
      {jane, engineer, "urn:sixpoint:"},
      {jane, engineer, "urn:sixpoint:plants:p1"},
      {"urn:sixpoint:machines:m1", engineer},
      {"urn:sixpoint:machines:m1", "urn:sixpoint:roles:machine"},
      {"urn:sixpoint:services:plant", "urn:sixpoint:roles:admin"},
      {"urn:sixpoint:users/jane", engineer},
      {"urn:sixpoint:users:jane:x", engineer},
      {"urn:sixpoint:users/x:jane", engineer},
      {"urn:sixpoint::jane", engineer},
      {std::string("urn:sixpoint:users:jane\0.evil", 29), engineer},
      {"urn:sixpoint:users:jane\n", engineer},
      {"urn:sixpoint:users:..", engineer},
      {"urn:sixpoint:users:" + std::string(65, 'x'), engineer},
  };
  for (const auto& uris : refused) {
    const auto identity = IdentityOfUris(uris);
    EXPECT_TRUE(absl::IsInvalidArgument(identity.status())) << ::testing::PrintToString(uris);
    EXPECT_FALSE(ViolationsOf(identity.status()).empty());
  }
}

TEST(Role, IsTheSameAfterItsText) {
  for (const Role role : {Role::kMachine, Role::kEngineer, Role::kQuality, Role::kMesReader, Role::kAdmin,
                          Role::kService, Role::kGateway})
    EXPECT_EQ(*RoleOf("--role", RoleText(role)), role);
  EXPECT_EQ(RoleText(Role::kMesReader), "mes-reader");
  for (const std::string word : {"", "Engineer", "root", "engineer ", "unknown"}) {
    const auto role = RoleOf("--role", word);
    EXPECT_THAT(std::string(role.status().message()), HasSubstr("--role: "));
    EXPECT_EQ(ViolationsOf(role.status()).size(), 1U);
  }
}

}  // namespace
}  // namespace sixpoint::identity
