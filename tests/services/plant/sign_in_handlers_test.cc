// The handlers of sign-ins and sessions on a fake store. Those with an ID token by a provider's keys in a file: no provider is asked.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <set>

#include "identity/certificate_token.h"
#include "identity/session.h"
#include "services/runtime/time_proto.h"
#include "tests/services/plant/account_handlers_fixture.h"
#include "tests/services/plant/provider_tokens.h"

namespace sixpoint::plant {
namespace {

using std::chrono::hours;
using std::chrono::minutes;
using std::chrono::seconds;
using ::testing::AnyOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

storage::Instant WholeMicroseconds() {
  return std::chrono::floor<std::chrono::microseconds>(std::chrono::system_clock::now());
}

class SignInHandlersTest : public AccountHandlersFixture {
 protected:
  SignInHandlersTest() { EXPECT_TRUE(Create("users/jane").ok()); }

  // As if the plant had given it then.
  std::string TokenFrom(storage::Instant since, std::chrono::minutes lasts) const {
    identity::Session session;
    session.person = identity::IdentityOf("users/jane", {identity::Role::kEngineer}).value();
    session.since = since;
    session.until = since + lasts;
    return identity::SignSession(session, credentials_.identity_file).value();
  }
  // As so many sign-ins that failed on these counters, without the work of judging them.
  void Fail(const storage::FailureCounters& counters, int count) {
    for (int i = 0; i < count; ++i) {
      const auto begun = store_->BeginSignIn(counters, "", [] { return true; }, {});
      ASSERT_TRUE(begun.ok() && begun->start.counted_at) << begun.status();
    }
  }
  // Jane's account, as five that failed before.
  void FailJane() { Fail({storage::FailureCounter{"users/jane", 5}, std::nullopt}, 5); }
};

TEST_F(SignInHandlersTest, ASessionSaysWhoAndIsRenewedUntilItIsEnded) {
  const auto session = SignIn("users/jane");
  ASSERT_TRUE(session.ok()) << session.status();
  EXPECT_EQ(session->name(), "users/jane");
  EXPECT_THAT(session->roles(), ElementsAre(access::v1::ROLE_ENGINEER));
  EXPECT_EQ(session->sign_in_method(), v1::SIGN_IN_METHOD_PASSWORD);
  const storage::Instant since = runtime::MomentOf(session->signed_in_at());
  EXPECT_EQ(runtime::MomentOf(session->expires_at()), since + minutes(15));
  EXPECT_EQ(runtime::MomentOf(session->renewable_until()), since + hours(12));
  EXPECT_EQ(identity::ReadSession(session->token())->person.Text(), "users/jane");
  const auto renewed = Renew(session->token());
  ASSERT_TRUE(renewed.ok()) << renewed.status();
  EXPECT_NE(renewed->token(), session->token());
  EXPECT_EQ(runtime::MomentOf(renewed->signed_in_at()), since);
  EXPECT_GE(runtime::MomentOf(renewed->expires_at()), since + minutes(15));
  EXPECT_EQ(runtime::MomentOf(renewed->renewable_until()), since + hours(12));
  for (int i = 0; i < 2; ++i) EXPECT_TRUE(SignOut(renewed->token()).ok());  // again changes nothing
  const absl::Status ended = Renew(session->token()).status();
  EXPECT_EQ(runtime::ReasonOf(ended), "SESSION_ENDED");
  EXPECT_EQ(runtime::MetadataOf(ended)["resource"], "users/jane");
  EXPECT_THAT(Events(), ElementsAre("users/jane created by users/it", "users/jane signed_in by services/gateway",
                                    "users/jane signed_out by users/jane via services/gateway"));
}

TEST_F(SignInHandlersTest, NoSessionIsRenewedBeyondTwelveHours) {
  const storage::Instant since = WholeMicroseconds() - hours(12) + minutes(5);
  const auto renewed = Renew(TokenFrom(since, hours(12)));
  ASSERT_TRUE(renewed.ok()) << renewed.status();
  EXPECT_EQ(runtime::MomentOf(renewed->expires_at()), since + hours(12));
  EXPECT_EQ(runtime::MomentOf(renewed->renewable_until()), since + hours(12));
}

// Of a token that is over there may be one that was renewed from it.
TEST_F(SignInHandlersTest, ATokenThatIsOverIsNotRenewedAndSignsOutWhatMayLive) {
  const std::string token = TokenOf("users/jane");
  const storage::Instant now = WholeMicroseconds();
  const std::string long_over = TokenFrom(now - hours(12) - minutes(1), minutes(15)),
                    over = TokenFrom(now - minutes(16), minutes(15));
  EXPECT_EQ(runtime::ReasonOf(Renew(over).status()), "SESSION_ENDED");
  EXPECT_TRUE(SignOut(long_over).ok());
  EXPECT_TRUE(Renew(token).ok());
  EXPECT_TRUE(SignOut(over).ok());
  EXPECT_EQ(runtime::ReasonOf(Renew(token).status()), "SESSION_ENDED");
  EXPECT_EQ(Events().size(), 3u);
}

TEST_F(SignInHandlersTest, WhatNoSignInGaveIsNoSession) {
  const storage::Instant now = std::chrono::floor<seconds>(std::chrono::system_clock::now());
  const std::string own =
      identity::SignCertificateToken(certificates_.User("jim", {identity::Role::kEngineer}) / identity::kIdentityFile,
                                     now, now + minutes(5))
          .value();
  for (const std::string& token : {std::string("x"), std::string("s1.a.b.c"), own}) {
    EXPECT_EQ(runtime::ReasonOf(Renew(token).status()), "SESSION_NOT_VALID");
    EXPECT_EQ(runtime::ReasonOf(SignOut(token)), "SESSION_NOT_VALID");
  }
  EXPECT_THAT(ViolationsOf(Renew("").status()), ElementsAre(Violation{"token", "empty", "a session's"}));
  EXPECT_THAT(ViolationsOf(SignOut("")), ElementsAre(Violation{"token", "empty", "a session's"}));
  EXPECT_EQ(Events().size(), 1u);
}

// Whether the name or the password was wrong, or the account is disabled: one answer, and the denials say more to the plant's people.
TEST_F(SignInHandlersTest, ARefusalSaysTheSameWhateverWasWrong) {
  ASSERT_TRUE(Create("users/gone").ok());
  ASSERT_TRUE(Ask(&AccountsStub::DisableAccount, "users/gone").ok());
  std::set<std::string> said;
  for (const auto& [name, password] :
       std::vector<std::pair<std::string, std::string>>{{"users/jane", kWrongPassword},
                                                        {"users/nobody", kJanesPassword},
                                                        {"", ""},
                                                        {"users/gone", kJanesPassword}}) {
    const absl::Status refused = SignIn(name, password).status();
    EXPECT_EQ(runtime::ReasonOf(refused), "SIGN_IN_REFUSED") << name;
    said.insert(std::string(refused.message()));
  }
  EXPECT_EQ(said.size(), 1u) << ::testing::PrintToString(said);
  const std::vector<runtime::RefusedSignIn> counted = handlers_.refused();
  ASSERT_EQ(counted.size(), 4u);
  for (const runtime::RefusedSignIn& one : counted) {
    EXPECT_THAT(one.account, AnyOf("", "users/jane", "users/gone"));
    EXPECT_EQ(one.peer_address, "192.0.2.1");
    EXPECT_EQ(one.method, "sixpoint.plant.v1.AccountService/SignIn");
    EXPECT_EQ(one.reason, "SIGN_IN_REFUSED");
    EXPECT_THAT(one.sentence, Not(HasSubstr("horse")));
  }
  EXPECT_EQ(counted[0].sentence, "another password");
  EXPECT_EQ(counted[1].sentence, "no such account");
  EXPECT_THAT(counted[3].sentence, HasSubstr("disabled"));
  EXPECT_EQ(store_->FailedCount(), 7);  // of the address four, of each name one but of none
  for (const char* address : {"", "localhost", "192.0.2.300", "::g"})
    EXPECT_EQ(ViolationsOf(SignIn("users/jane", kJanesPassword, address).status()).at(0).field, "client_address");
  EXPECT_EQ(Events().size(), 3u);
}

TEST_F(SignInHandlersTest, WhoFailedTooOftenWaitsWhateverHeSays) {
  FailJane();
  const absl::Status slowed = SignIn("users/jane").status();
  EXPECT_EQ(runtime::ReasonOf(slowed), "SIGN_IN_SLOWED");
  EXPECT_THAT(std::stoi(runtime::MetadataOf(slowed).at("wait_s")),
              ::testing::AllOf(::testing::Ge(1), ::testing::Le(30)));
  ASSERT_EQ(handlers_.refused().size(), 1u);
  EXPECT_EQ(handlers_.refused()[0].account, "users/jane");
  EXPECT_EQ(handlers_.refused()[0].reason, "SIGN_IN_SLOWED");
  EXPECT_EQ(handlers_.refused()[0].sentence, "before its time");
  EXPECT_EQ(store_->FailedCount(), 5);
  store_->LetPass(seconds(31));
  EXPECT_TRUE(SignIn("users/jane").ok());
  EXPECT_EQ(store_->FailedCount(), 0);
}

// Whoever sits at her browser guesses no longer than whoever does not.
TEST_F(SignInHandlersTest, WhoSaysHisOwnPasswordOnceMoreWaitsToo) {
  const std::string token = TokenOf("users/jane");
  FailJane();
  EXPECT_EQ(runtime::ReasonOf(ChangeOwnPassword(token, kJanesPassword, "another long password")), "SIGN_IN_SLOWED");
  store_->LetPass(seconds(31));
  EXPECT_TRUE(ChangeOwnPassword(token, kJanesPassword, "another long password").ok());
}

// People of one network are one address.
TEST_F(SignInHandlersTest, WhoTriesManyAccountsFromOneNetworkWaitsToo) {
  const std::string network("\x20\x01\x0d\xb8\0\0\0\0", 8);
  Fail({std::nullopt, storage::FailureCounter{network, 20}}, 19);
  EXPECT_TRUE(SignIn("users/jane", kJanesPassword, "2001:db8::2").ok());  // is given back
  EXPECT_EQ(runtime::ReasonOf(SignIn("users/a", kWrongPassword, "2001:db8::1").status()), "SIGN_IN_REFUSED");
  EXPECT_EQ(runtime::ReasonOf(SignIn("users/jane", kJanesPassword, "2001:db8::ffff").status()), "SIGN_IN_SLOWED");
  EXPECT_TRUE(SignIn("users/jane", kJanesPassword, "2001:db8:0:1::1").ok());
}

TEST_F(SignInHandlersTest, AnAccountThatChangesWhileItsPasswordIsJudgedIsRefused) {
  const std::vector<std::function<void(storage::AccountRow*)>> changes = {
      [](storage::AccountRow* account) { account->password_phc = "another"; },
      [](storage::AccountRow* account) { account->disabled = true; }};
  for (const auto& change : changes) {
    store_->ChangeMeanwhile("users/jane", change);
    EXPECT_EQ(runtime::ReasonOf(SignIn("users/jane").status()), "SIGN_IN_REFUSED");
    EXPECT_EQ(handlers_.refused().back().account, "users/jane");
    EXPECT_THAT(handlers_.refused().back().sentence, HasSubstr("changed meanwhile"));
    ASSERT_TRUE(SetPassword("users/jane", kJanesPassword).ok());
  }
  EXPECT_THAT(Events(), Not(::testing::Contains(HasSubstr("signed_in"))));
}

// Right or wrong it was not: a database that is away, or does not answer any more once the password was judged.
TEST_F(SignInHandlersTest, WhatIsNotRefusedIsNotCounted) {
  store_->commits.Fail(absl::UnavailableError("database: away"));
  EXPECT_EQ(SignIn("users/jane").status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(Renew(TokenFrom(WholeMicroseconds(), minutes(15))).status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(SignOut(TokenFrom(WholeMicroseconds(), minutes(15))).code(), absl::StatusCode::kUnavailable);
  store_->commits.Fail(absl::OkStatus());
  EXPECT_EQ(store_->FailedCount(), 0);
  store_->FailSignIns(absl::DeadlineExceededError("database: did not answer in time"));
  EXPECT_EQ(SignIn("users/jane").status().code(), absl::StatusCode::kDeadlineExceeded);
  EXPECT_EQ(store_->FailedCount(), 0);
  store_->FailSignIns(absl::OkStatus());
  EXPECT_THAT(handlers_.refused(), IsEmpty());
  EXPECT_THAT(Events(), ElementsAre("users/jane created by users/it"));
  EXPECT_TRUE(SignIn("users/jane").ok());
}

// Whoever gets no session is not signed in.
TEST_F(SignInHandlersTest, ASessionThatCannotBeSignedIsNotBegun) {
  AccountCredentials credentials = credentials_;
  credentials.identity_file = "/nowhere";
  AccountHandlers handlers(store_, credentials, nullptr);
  const absl::Status unsigned_one =
      handlers.OverGateway(&AccountsStub::SignIn, SigningIn("users/jane", kJanesPassword)).status();
  EXPECT_EQ(unsigned_one.code(), absl::StatusCode::kInternal);
  EXPECT_THAT(std::string(unsigned_one.message()), HasSubstr("internal error"));
  EXPECT_EQ(store_->FailedCount(), 0);
  EXPECT_THAT(Events(), ElementsAre("users/jane created by users/it"));
}

// An end that the database's clock has not reached, for it was set back: what begins then begins after it, or is told why not.
TEST_F(SignInHandlersTest, AClockThatWasSetBackIsToldOrMadeUpFor) {
  ASSERT_TRUE(SignOut(TokenOf("users/jane")).ok());
  store_->EndAhead("users/jane", seconds(40));
  const std::string token = TokenOf("users/jane");
  EXPECT_TRUE(Renew(token).ok());
  EXPECT_TRUE(SignOut(token).ok());
  EXPECT_EQ(runtime::ReasonOf(Renew(token).status()), "SESSION_ENDED");
  const std::size_t before = Events().size();
  store_->EndAhead("users/jane", hours(1));
  const absl::Status ahead = SignIn("users/jane").status();
  EXPECT_EQ(runtime::ReasonOf(ahead), "SERVICE_NOT_READY");
  EXPECT_THAT(std::string(ahead.message()), HasSubstr("set back"));
  EXPECT_EQ(store_->FailedCount(), 0);
  EXPECT_EQ(Events().size(), before);
}

TEST_F(SignInHandlersTest, WhoIsGoneIsNotSignedInAndNothingIsCounted) {
  // Before it was counted, and once it was judged.
  for (const int commits_before : {0, 1}) {
    const std::unique_ptr<grpc::ClientContext> context = runtime::ContextFor(60);
    store_->commits.BeforeCommit(GoneAtCommit(*context, commits_before));
    v1::Session session;
    EXPECT_EQ(handlers_.gateway().SignIn(context.get(), SigningIn("users/jane", kJanesPassword), &session).error_code(),
              grpc::StatusCode::CANCELLED);
    EXPECT_TRUE(testing::Becomes(seconds(30), [&] { return store_->FailedCount() == 0; })) << commits_before;
  }
  store_->commits.BeforeCommit(nullptr);
  EXPECT_THAT(Events(), ElementsAre("users/jane created by users/it"));
  const std::string token = TokenOf("users/jane");
  const std::unique_ptr<grpc::ClientContext> context = runtime::ContextFor(60);
  store_->commits.BeforeCommit(GoneAtCommit(*context));
  v1::SignOutRequest out;
  v1::SignOutResponse done;
  out.set_token(token);
  EXPECT_EQ(handlers_.gateway().SignOut(context.get(), out, &done).error_code(), grpc::StatusCode::CANCELLED);
  EXPECT_FALSE(store_->LookAtSession("users/jane", identity::ReadSession(token)->since, {})->is_ended);
  store_->commits.BeforeCommit(nullptr);
  EXPECT_TRUE(Renew(token).ok());
}

class IdTokenHandlersTest : public AccountHandlersFixture {
 protected:
  // A provider whose keys lie in a file, which is read when a token is judged.
  std::unique_ptr<AccountHandlers> Handlers(identity::Role role = identity::Role::kEngineer,
                                            const std::map<std::string, std::string>& persons = {}) {
    IdentityProviderConfig config;
    config.policy.issuer = "https://id.plant.example";
    config.policy.client_id = "sixpoint";
    config.policy.roles = {{"turbine-engineers", role}};
    config.keys_file = (files_.folder() / "keys.json").string();
    config.persons = persons;
    return std::make_unique<AccountHandlers>(store_, credentials_, std::make_unique<IdentityProvider>(config));
  }
  absl::StatusOr<v1::Session> SignInWith(AccountHandlers& handlers, const std::string& id_token,
                                         const std::string& nonce = "n-1") {
    v1::SignInWithIdTokenRequest request;
    request.set_id_token(id_token);
    request.set_nonce(nonce);
    request.set_client_address("192.0.2.1");
    return handlers.OverGateway(&AccountsStub::SignInWithIdToken, request);
  }
  const ProviderTokens files_;
};

TEST_F(IdTokenHandlersTest, WithoutAProviderOrItsKeysNobodyIsJudgedAndNothingCounted) {
  EXPECT_EQ(runtime::ReasonOf(SignInWith(handlers_, "x").status()), "IDENTITY_PROVIDER_MISSING");
  const auto handlers = Handlers();
  EXPECT_EQ(runtime::ReasonOf(SignInWith(*handlers, "x").status()), "IDENTITY_PROVIDER_AWAY");
  EXPECT_EQ(store_->FailedCount(), 0);
  EXPECT_THAT(handlers->refused(), IsEmpty());
  EXPECT_THAT(Events(), IsEmpty());
}

TEST_F(IdTokenHandlersTest, WhomTheProviderVouchesForHasAnAccountWithTheRolesOfNow) {
  if (!ProviderTokens::MayBeMade()) GTEST_SKIP() << "python3-jwt or python3-cryptography is absent";
  ASSERT_TRUE(files_.Make());
  const auto handlers = Handlers();
  const auto first = SignInWith(*handlers, files_.Text("good.rs256"));
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_EQ(first->name(), "users/jane");
  EXPECT_EQ(first->sign_in_method(), v1::SIGN_IN_METHOD_OIDC);
  EXPECT_EQ(store_->FailedCount(), 0);
  for (const auto& refused :
       {SignInWith(*handlers, files_.Text("good.rs256"), "n-2"), SignInWith(*handlers, files_.Text("bad.alg_none"))})
    EXPECT_EQ(runtime::ReasonOf(refused.status()), "SIGN_IN_REFUSED");
  EXPECT_EQ(handlers->refused().back().account, "");
  EXPECT_THAT(handlers->refused().back().sentence, HasSubstr("algorithm"));
  EXPECT_EQ(store_->FailedCount(), 2);
  // Other roles by the directory: what she had before ends.
  const auto later = Handlers(identity::Role::kQuality);
  const auto second = SignInWith(*later, files_.Text("good.es256"));
  ASSERT_TRUE(second.ok()) << second.status();
  EXPECT_THAT(second->roles(), ElementsAre(access::v1::ROLE_QUALITY));
  EXPECT_EQ(runtime::ReasonOf(Renew(first->token()).status()), "SESSION_ENDED");
  // A password is none of hers, and whoever is disabled stays outside.
  EXPECT_EQ(runtime::ReasonOf(SignIn("users/jane", "").status()), "SIGN_IN_REFUSED");
  EXPECT_EQ(runtime::ReasonOf(ChangeOwnPassword(second->token(), "", "another long password")), "ROLE_MISSING");
  ASSERT_TRUE(Ask(&AccountsStub::DisableAccount, "users/jane").ok());
  EXPECT_EQ(runtime::ReasonOf(SignInWith(*later, files_.Text("good.rs256")).status()), "SIGN_IN_REFUSED");
  EXPECT_EQ(later->refused().back().account, "users/jane");
  EXPECT_THAT(later->refused().back().sentence, HasSubstr("disabled"));
  EXPECT_THAT(Events(),
              ElementsAre("users/jane created by services/gateway", "users/jane signed_in by services/gateway",
                          "users/jane roles_set by services/gateway", "users/jane signed_in by services/gateway",
                          "users/jane disabled by users/it"));
}

// Whoever may choose what a directory calls him becomes nobody whom the plant knows; who starts the plant says which subject is whom.
TEST_F(IdTokenHandlersTest, ANameThatThePlantKnowsIsTakenByALinkAlone) {
  if (!ProviderTokens::MayBeMade()) GTEST_SKIP() << "python3-jwt or python3-cryptography is absent";
  ASSERT_TRUE(files_.Make());
  store_->See("users/jane");
  const auto handlers = Handlers(), linked = Handlers(identity::Role::kEngineer, {{"f3a1", "users/j.doe"}});
  EXPECT_EQ(runtime::ReasonOf(SignInWith(*handlers, files_.Text("good.rs256")).status()), "SIGN_IN_REFUSED");
  EXPECT_EQ(handlers->refused().back().account, "users/jane");
  EXPECT_THAT(handlers->refused().back().sentence, HasSubstr("another one's"));
  EXPECT_THAT(Events(), IsEmpty());
  // An account of somebody is not given away by it.
  ASSERT_TRUE(Create("users/joe").ok());
  const auto by_mistake = Handlers(identity::Role::kEngineer, {{"f3a1", "users/joe"}});
  EXPECT_EQ(runtime::ReasonOf(SignInWith(*by_mistake, files_.Text("good.rs256")).status()), "SIGN_IN_REFUSED");
  store_->See("users/j.doe");
  const auto session = SignInWith(*linked, files_.Text("good.rs256"));
  ASSERT_TRUE(session.ok()) << session.status();
  EXPECT_EQ(session->name(), "users/j.doe");
  // It stays hers, whatever the file says later.
  EXPECT_EQ(SignInWith(*handlers, files_.Text("good.es256"))->name(), "users/j.doe");
}

TEST_F(IdTokenHandlersTest, AStoreThatFailsOnceATokenWasJudgedIsNotCounted) {
  if (!ProviderTokens::MayBeMade()) GTEST_SKIP() << "python3-jwt or python3-cryptography is absent";
  ASSERT_TRUE(files_.Make());
  const auto handlers = Handlers();
  store_->FailSignIns(absl::DeadlineExceededError("database: did not answer in time"));
  EXPECT_EQ(SignInWith(*handlers, files_.Text("good.rs256")).status().code(), absl::StatusCode::kDeadlineExceeded);
  EXPECT_EQ(store_->FailedCount(), 0);
  EXPECT_THAT(Events(), IsEmpty());
  EXPECT_THAT(handlers->refused(), IsEmpty());
}

}  // namespace
}  // namespace sixpoint::plant
