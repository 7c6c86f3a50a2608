// The handlers of accounts, but sign-ins (sign_in_handlers_test.cc), on a fake store.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "identity/password.h"
#include "refusal/refusal.h"
#include "tests/services/plant/account_handlers_fixture.h"
#include "tests/support/processor_time.h"

namespace sixpoint::plant {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr char kAnotherPassword[] = "something else that is long";
constexpr char kWantedName[] = "users/ and 1 to 64 of A-Z, a-z, 0-9, '.', '_', '-', the first not '.'";

class AccountHandlersTest : public AccountHandlersFixture {};

// Whom the identity provider vouches for, as a sign-in made him.
void MakeVouchedAccount(storage::AccountStore& store, const std::string& name) {
  storage::VouchedPerson person;
  person.account.name = name;
  person.account.sign_in_method = "oidc";
  person.account.roles = {"engineer"};
  person.account.issuer = "https://id.plant.example";
  person.account.issuer_subject = "f3a1";
  storage::SignInOrder order;
  order.requested_by = "services/gateway";
  order.judge = [](const std::optional<storage::AccountRow>&) { return absl::OkStatus(); };
  order.begun = [](const storage::AccountRow&, const storage::SessionStart&) { return absl::OkStatus(); };
  const absl::Status made = store.SignInOfSubject(person, order, [] { return true; }, {});
  ASSERT_TRUE(made.ok()) << made;
}

TEST_F(AccountHandlersTest, AnAccountIsMadeOnceAndACallThatIsRepeatedFindsItsOwn) {
  const auto creation = Creation("users/jane", {access::v1::ROLE_QUALITY, access::v1::ROLE_ENGINEER});
  const auto made = Create(creation);
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(made->name(), "users/jane");
  EXPECT_THAT(made->roles(), ElementsAre(access::v1::ROLE_ENGINEER, access::v1::ROLE_QUALITY));
  EXPECT_EQ(made->sign_in_method(), v1::SIGN_IN_METHOD_PASSWORD);
  EXPECT_FALSE(made->disabled());
  EXPECT_TRUE(made->has_created_at() && made->has_changed_at());
  EXPECT_EQ(Create(creation)->SerializeAsString(), made->SerializeAsString());
  for (const auto& other :
       {Creation("users/jane"),
        Creation("users/jane", {access::v1::ROLE_ENGINEER, access::v1::ROLE_QUALITY}, kAnotherPassword)}) {
    const absl::Status there = Create(other).status();
    EXPECT_EQ(runtime::ReasonOf(there), "ACCOUNT_EXISTS");
    EXPECT_EQ(runtime::MetadataOf(there)["resource"], "users/jane");
  }
  EXPECT_THAT(Events(), ElementsAre("users/jane created by users/it"));
  // What is kept is no password.
  const std::string phc = store_->Find("users/jane", {})->value().password_phc;
  EXPECT_THAT(phc, HasSubstr("$argon2id$"));
  EXPECT_TRUE(*identity::PasswordMatches(phc, kJanesPassword));
}

TEST_F(AccountHandlersTest, AllThatIsWrongWithAnAccountIsToldAtOnce) {
  EXPECT_THAT(ViolationsOf(Create(Creation("jane", {access::v1::ROLE_MACHINE}, "shortsecret")).status()),
              ElementsAre(Violation{"name", "jane", kWantedName},
                          Violation{"roles", std::to_string(access::v1::ROLE_MACHINE),
                                    "ROLE_ENGINEER, ROLE_QUALITY, ROLE_MES_READER or ROLE_ADMIN"},
                          Violation{"password", "11 bytes", "12 to 128 bytes of UTF-8 without control characters"}));
  EXPECT_EQ(Create(Creation("users/jane", {})).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(store_->events(), IsEmpty());
  for (const auto& refused :
       {SetRoles("machines/m1", {access::v1::ROLE_ADMIN}), SetPassword("machines/m1", kAnotherPassword),
        Ask(&AccountsStub::DisableAccount, "machines/m1"), Ask(&AccountsStub::EnableAccount, "machines/m1"),
        Ask(&AccountsStub::GetAccount, "machines/m1")})
    EXPECT_THAT(ViolationsOf(refused.status()), ElementsAre(Violation{"name", "machines/m1", kWantedName}));
  EXPECT_EQ(ViolationsOf(SetRoles("users/jane", {access::v1::ROLE_GATEWAY}).status()).at(0).field, "roles");
  EXPECT_EQ(ViolationsOf(SetPassword("users/jane", "short").status()).at(0).field, "password");
  EXPECT_EQ(ViolationsOf(ChangeOwnPassword("", kJanesPassword, "short")).at(0).field, "new_password");
}

TEST_F(AccountHandlersTest, WhatIsAskedOfNobodysAccountIsNotFound) {
  for (const auto& refused :
       {SetRoles("users/joe", {access::v1::ROLE_ADMIN}), SetPassword("users/joe", kAnotherPassword),
        Ask(&AccountsStub::DisableAccount, "users/joe"), Ask(&AccountsStub::EnableAccount, "users/joe"),
        Ask(&AccountsStub::GetAccount, "users/joe")}) {
    EXPECT_EQ(runtime::ReasonOf(refused.status()), "ACCOUNT_NOT_FOUND") << refused.status();
    EXPECT_EQ(runtime::MetadataOf(refused.status())["resource"], "users/joe");
  }
}

TEST_F(AccountHandlersTest, RolesThatAreOthersEndSessions) {
  ASSERT_TRUE(Create("users/jane").ok());
  const std::string token = TokenOf("users/jane");
  // As they are: nothing is done.
  EXPECT_THAT(SetRoles("users/jane", {access::v1::ROLE_ENGINEER, access::v1::ROLE_ENGINEER})->roles(),
              ElementsAre(access::v1::ROLE_ENGINEER));
  EXPECT_TRUE(Renew(token).ok());
  const auto set = SetRoles("users/jane", {access::v1::ROLE_ADMIN, access::v1::ROLE_QUALITY});
  ASSERT_TRUE(set.ok()) << set.status();
  EXPECT_THAT(set->roles(), ElementsAre(access::v1::ROLE_QUALITY, access::v1::ROLE_ADMIN));
  EXPECT_EQ(runtime::ReasonOf(Renew(token).status()), "SESSION_ENDED");
  EXPECT_EQ(Ask(&AccountsStub::GetAccount, "users/jane")->SerializeAsString(), set->SerializeAsString());
  EXPECT_THAT(Events(), ElementsAre("users/jane created by users/it", "users/jane signed_in by services/gateway",
                                    "users/jane roles_set by users/it"));
}

TEST_F(AccountHandlersTest, APasswordThatIsSetCountsFromThenOnAndNobodySetsHisOwnSo) {
  ASSERT_TRUE(Create("users/jane").ok());
  const std::string token = TokenOf("users/jane");
  // Who only found an open browser does not make himself its owner.
  const absl::Status own =
      handlers_.OverGateway(&AccountsStub::SetPassword, Setting("users/jane", kAnotherPassword), token).status();
  EXPECT_EQ(runtime::ReasonOf(own), "ROLE_MISSING");
  EXPECT_THAT(std::string(own.message()), HasSubstr("want ChangeOwnPassword"));
  EXPECT_TRUE(Renew(token).ok());
  ASSERT_TRUE(SetPassword("users/jane", kAnotherPassword).ok());
  EXPECT_EQ(runtime::ReasonOf(Renew(token).status()), "SESSION_ENDED");
  EXPECT_EQ(runtime::ReasonOf(SignIn("users/jane").status()), "SIGN_IN_REFUSED");
  EXPECT_TRUE(SignIn("users/jane", kAnotherPassword).ok());
  EXPECT_EQ(Events().at(2), "users/jane password_set by users/it");
}

// It says the roles, and it keeps the password.
TEST_F(AccountHandlersTest, OfWhomTheProviderVouchesForNeitherRolesNorPasswordAreSet) {
  MakeVouchedAccount(*store_, "users/jane");
  const auto got = Ask(&AccountsStub::GetAccount, "users/jane");
  ASSERT_TRUE(got.ok()) << got.status();
  EXPECT_EQ(got->sign_in_method(), v1::SIGN_IN_METHOD_OIDC);
  for (const auto& refused :
       {SetRoles("users/jane", {access::v1::ROLE_ADMIN}), SetPassword("users/jane", kAnotherPassword)})
    EXPECT_THAT(
        ViolationsOf(refused.status()),
        ElementsAre(Violation{"name", "users/jane (signs in by the identity provider)", "an account with a password"}));
  EXPECT_EQ(runtime::ReasonOf(Create("users/jane").status()), "ACCOUNT_EXISTS");
  EXPECT_EQ(Events().size(), 2u);
  EXPECT_TRUE(Ask(&AccountsStub::DisableAccount, "users/jane")->disabled());
}

TEST_F(AccountHandlersTest, WhoSignedInWithAPasswordChangesHisOwn) {
  ASSERT_TRUE(Create("users/jane").ok());
  const std::string token = TokenOf("users/jane");
  EXPECT_EQ(runtime::ReasonOf(ChangeOwnPassword("", kJanesPassword, kAnotherPassword)), "ROLE_MISSING");
  EXPECT_EQ(runtime::ReasonOf(ChangeOwnPassword(token, kWrongPassword, kAnotherPassword)), "SIGN_IN_REFUSED");
  EXPECT_EQ(store_->FailedCount(), 1);  // of the account; there is no address
  ASSERT_EQ(handlers_.refused().size(), 1u);
  EXPECT_EQ(handlers_.refused()[0].method, "sixpoint.plant.v1.AccountService/ChangeOwnPassword");
  EXPECT_EQ(handlers_.refused()[0].account, "users/jane");
  EXPECT_TRUE(Renew(token).ok());
  const absl::Status changed = ChangeOwnPassword(token, kJanesPassword, kAnotherPassword);
  ASSERT_TRUE(changed.ok()) << changed;
  EXPECT_EQ(store_->FailedCount(), 0);
  EXPECT_EQ(runtime::ReasonOf(Renew(token).status()), "SESSION_ENDED");
  EXPECT_TRUE(SignIn("users/jane", kAnotherPassword).ok());
  EXPECT_EQ(Events().at(2), "users/jane password_set by users/jane via services/gateway");
}

// Whoever set another one while the old one was judged is not overruled.
TEST_F(AccountHandlersTest, AnOwnPasswordThatChangedMeanwhileStays) {
  ASSERT_TRUE(Create("users/jane").ok());
  const std::string token = TokenOf("users/jane");
  store_->ChangeMeanwhile("users/jane", [](storage::AccountRow* account) { account->password_phc = "another"; });
  EXPECT_EQ(ChangeOwnPassword(token, kJanesPassword, kAnotherPassword).code(), absl::StatusCode::kAborted);
  EXPECT_EQ(store_->Find("users/jane", {})->value().password_phc, "another");
  EXPECT_EQ(Events().size(), 2u);
}

TEST_F(AccountHandlersTest, AnAccountIsDisabledAndEnabledOnce) {
  ASSERT_TRUE(Create("users/jane").ok());
  const std::string token = TokenOf("users/jane");
  for (int i = 0; i < 2; ++i) EXPECT_TRUE(Ask(&AccountsStub::DisableAccount, "users/jane")->disabled());
  EXPECT_EQ(runtime::ReasonOf(Renew(token).status()), "SESSION_ENDED");
  EXPECT_EQ(runtime::ReasonOf(SignIn("users/jane").status()), "SIGN_IN_REFUSED");
  for (int i = 0; i < 2; ++i) EXPECT_FALSE(Ask(&AccountsStub::EnableAccount, "users/jane")->disabled());
  EXPECT_EQ(runtime::ReasonOf(Renew(token).status()), "SESSION_ENDED");  // what ended stays so
  EXPECT_TRUE(SignIn("users/jane").ok());
  EXPECT_THAT(Events(), ElementsAre("users/jane created by users/it", "users/jane signed_in by services/gateway",
                                    "users/jane disabled by users/it", "users/jane enabled by users/it",
                                    "users/jane signed_in by services/gateway"));
}

TEST_F(AccountHandlersTest, AccountsAreListedByPages) {
  for (const char* name : {"users/c", "users/a", "users/b"}) ASSERT_TRUE(Create(name).ok());
  v1::ListAccountsRequest request;
  request.set_page_size(2);
  const auto first = handlers_.ByAdmin(&AccountsStub::ListAccounts, request);
  ASSERT_TRUE(first.ok()) << first.status();
  ASSERT_EQ(first->accounts_size(), 2);
  EXPECT_EQ(first->accounts(0).name(), "users/a");
  EXPECT_EQ(first->accounts(1).SerializeAsString(), Ask(&AccountsStub::GetAccount, "users/b")->SerializeAsString());
  request.set_page_token(first->next_page_token());
  const auto second = handlers_.ByAdmin(&AccountsStub::ListAccounts, request);
  ASSERT_TRUE(second.ok()) << second.status();
  ASSERT_EQ(second->accounts_size(), 1);
  EXPECT_EQ(second->accounts(0).name(), "users/c");
  EXPECT_EQ(second->next_page_token(), "");
  request.set_page_size(-1);
  EXPECT_EQ(handlers_.ByAdmin(&AccountsStub::ListAccounts, request).status().code(),
            absl::StatusCode::kInvalidArgument);
}

TEST_F(AccountHandlersTest, AccountsAreListedByRoleAndByWhetherSomebodyMaySignIn) {
  for (const char* name : {"users/a", "users/b", "users/c"}) ASSERT_TRUE(Create(name).ok());
  ASSERT_TRUE(SetRoles("users/b", {access::v1::ROLE_ADMIN}).ok());
  ASSERT_TRUE(Ask(&AccountsStub::DisableAccount, "users/c").ok());
  const auto names = [&](const v1::ListAccountsRequest& request) {
    const auto page = handlers_.ByAdmin(&AccountsStub::ListAccounts, request);
    EXPECT_TRUE(page.ok()) << page.status();
    std::vector<std::string> found;
    for (const v1::Account& account : page->accounts()) found.push_back(account.name());
    return found;
  };
  v1::ListAccountsRequest request;
  request.set_enabled_only(true);
  EXPECT_THAT(names(request), ElementsAre("users/a", "users/b"));
  request.set_role(access::v1::ROLE_ADMIN);
  EXPECT_THAT(names(request), ElementsAre("users/b"));
  for (const int no_users : {static_cast<int>(access::v1::ROLE_MACHINE), 99}) {
    request.set_role(static_cast<access::v1::Role>(no_users));
    const auto refused = handlers_.ByAdmin(&AccountsStub::ListAccounts, request);
    EXPECT_EQ(refused.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(refused.status().message()), ::testing::HasSubstr("role: "));
  }
}

TEST_F(AccountHandlersTest, AStoreThatFailsComesToTheClient) {
  ASSERT_TRUE(Create("users/jane").ok());
  store_->commits.Fail(absl::UnavailableError("database: away"));
  for (const auto& failed :
       {Create("users/joe"), SetRoles("users/jane", {access::v1::ROLE_ADMIN}),
        SetPassword("users/jane", kAnotherPassword), Ask(&AccountsStub::DisableAccount, "users/jane"),
        Ask(&AccountsStub::EnableAccount, "users/jane"), Ask(&AccountsStub::GetAccount, "users/jane")})
    EXPECT_EQ(failed.status().code(), absl::StatusCode::kUnavailable) << failed.status();
  EXPECT_EQ(handlers_.ByAdmin(&AccountsStub::ListAccounts, v1::ListAccountsRequest()).status().code(),
            absl::StatusCode::kUnavailable);
  store_->commits.Fail(absl::OkStatus());
  EXPECT_THAT(Events(), ElementsAre("users/jane created by users/it"));
}

TEST_F(AccountHandlersTest, NothingIsMadeOrChangedForAClientThatIsGone) {
  ASSERT_TRUE(Create("users/jane").ok());
  v1::Account response;
  {
    const std::unique_ptr<grpc::ClientContext> context = runtime::ContextFor(60);
    store_->commits.BeforeCommit(GoneAtCommit(*context));
    EXPECT_EQ(handlers_.admin().CreateAccount(context.get(), Creation("users/joe"), &response).error_code(),
              grpc::StatusCode::CANCELLED);
    EXPECT_FALSE(store_->Find("users/joe", {})->has_value());
  }
  const std::unique_ptr<grpc::ClientContext> context = runtime::ContextFor(60);
  store_->commits.BeforeCommit(GoneAtCommit(*context));
  v1::DisableAccountRequest disable;
  disable.set_name("users/jane");
  EXPECT_EQ(handlers_.admin().DisableAccount(context.get(), disable, &response).error_code(),
            grpc::StatusCode::CANCELLED);
  EXPECT_FALSE(store_->Find("users/jane", {})->value().disabled);
  EXPECT_THAT(Events(), ElementsAre("users/jane created by users/it"));
}

// A hashing takes some tenths of a second: a connection that is held for it is one that nobody else has.
TEST_F(AccountHandlersTest, NoCallOfTheStoreLastsWhileAPasswordIsHashed) {
  const auto before = testing::ProcessorTime();
  ASSERT_TRUE(identity::HashPassword(kJanesPassword).ok());
  const std::chrono::nanoseconds hashing = testing::ProcessorTime() - before;
  ASSERT_TRUE(Create("users/jane").ok());
  EXPECT_TRUE(Create("users/jane").ok());
  EXPECT_TRUE(SetPassword("users/jane", kAnotherPassword).ok());
  EXPECT_FALSE(SignIn("users/jane", kWrongPassword).ok());
  const std::string token = TokenOf("users/jane", kAnotherPassword);
  EXPECT_TRUE(ChangeOwnPassword(token, kAnotherPassword, kJanesPassword).ok());
  EXPECT_FALSE(SignIn("users/nobody").ok());
  EXPECT_GT(store_->longest_call(), std::chrono::nanoseconds(0));
  EXPECT_LT(store_->longest_call(), hashing / 2);
}

}  // namespace
}  // namespace sixpoint::plant
