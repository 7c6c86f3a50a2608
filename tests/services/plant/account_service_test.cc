// Accounts and sign-ins over real gRPC on a real PostgreSQL; roles and sessions at the door are tests/end_to_end/sign_in_test.cc's.
#include "services/plant/account_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "identity/credentials.h"
#include "services/runtime/errors.h"
#include "services/runtime/time_proto.h"
#include "tests/services/plant/provider_tokens.h"
#include "tests/support/in_process_server.h"
#include "tests/support/plant_certificates.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::plant {
namespace {

using AccountStub = v1::AccountService::Stub;
using ::testing::AnyOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr char kPassword[] = "correct horse battery staple";

// Over a server of its own.
class Desk {
 public:
  Desk(storage::Database* database, testing::PlantCertificates& certificates,
       std::unique_ptr<IdentityProvider> provider)
      : service_(storage::AccountsIn(database), Options(certificates, std::move(provider))),
        server_({&service_}),
        stub_(v1::AccountService::NewStub(server_.Connect())) {}

  // Its reason, or its code's name where it has none.
  template <typename Method, typename Request, typename Response>
  std::string Ask(Method method, const Request& request, Response* response) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + patience);
    SetRunning(&context);
    last_ = runtime::FromGrpc((stub_.get()->*method)(&context, request, response));
    SetRunning(nullptr);
    const std::string reason = runtime::ReasonOf(last_);
    return reason.empty() ? absl::StatusCodeToString(last_.code()) : reason;
  }
  std::string SignIn(const std::string& name, const std::string& password, v1::Session* session,
                     const std::string& address = "192.0.2.1") {
    v1::SignInRequest request;
    request.set_name(name);
    request.set_password(password);
    request.set_client_address(address);
    return Ask(&AccountStub::SignIn, request, session);
  }
  std::string SignInWithIdToken(const std::string& id_token, v1::Session* session, const std::string& nonce = "n-1") {
    v1::SignInWithIdTokenRequest request;
    request.set_id_token(id_token);
    request.set_nonce(nonce);
    request.set_client_address("192.0.2.1");
    return Ask(&AccountStub::SignInWithIdToken, request, session);
  }
  // What is asked now by another thread.
  void Cancel() {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (running_ != nullptr) running_->TryCancel();
  }
  const absl::Status& last() const { return last_; }
  std::vector<runtime::RefusedSignIn> refused;
  std::chrono::milliseconds patience{60000};

 private:
  SessionDeskOptions Options(testing::PlantCertificates& certificates, std::unique_ptr<IdentityProvider> provider) {
    SessionDeskOptions options;
    const auto folder = certificates.Service("plant");
    options.identity_file = folder / identity::kIdentityFile;
    options.trust = std::make_unique<identity::Trust>(folder / identity::kAuthorityFile, certificates.revoked_file());
    options.provider = std::move(provider);
    options.count_refused = [this](const runtime::RefusedSignIn& one) {
      const std::lock_guard<std::mutex> lock(mutex_);
      refused.push_back(one);
    };
    return options;
  }

  void SetRunning(grpc::ClientContext* context) {
    const std::lock_guard<std::mutex> lock(mutex_);
    running_ = context;
  }

  std::mutex mutex_;
  grpc::ClientContext* running_ = nullptr;
  AccountService service_;
  testing::InProcessServer server_;
  const std::unique_ptr<AccountStub> stub_;
  absl::Status last_;
};

class AccountServiceTest : public ::testing::Test {
 protected:
  std::string Create(const std::string& name, const std::vector<access::v1::Role>& roles = {access::v1::ROLE_ENGINEER},
                     const std::string& password = kPassword) {
    v1::CreateAccountRequest request;
    request.set_name(name);
    request.set_password(password);
    for (const access::v1::Role role : roles) request.add_roles(role);
    return desk_.Ask(&AccountStub::CreateAccount, request, &account_);
  }
  template <typename Request>
  std::string Change(grpc::Status (AccountStub::*method)(grpc::ClientContext*, const Request&, v1::Account*),
                     const std::string& name, Request request = Request()) {
    request.set_name(name);
    return desk_.Ask(method, request, &account_);
  }
  // Of one column, as the owner, committed.
  std::vector<std::string> Texts(const std::string& sql) {
    auto transaction = database_.database()->Begin(testing::Soon());
    const auto rows = transaction->Execute(sql);
    EXPECT_TRUE(rows.ok()) << rows.status();
    EXPECT_TRUE(transaction->Commit().ok());
    std::vector<std::string> texts;
    for (int row = 0; rows.ok() && row < rows->count(); ++row) texts.push_back(rows->Text(row, 0));
    return texts;
  }
  std::vector<std::string> Events() {
    return Texts("SELECT name_of(subject) || ' ' || event FROM account_events ORDER BY event_id");
  }
  // On all counters; what is given back is so soon after its answer.
  std::string FailedOnceSettled(const std::string& wanted) {
    const std::string sql = "SELECT coalesce(sum(failed_count), 0)::text FROM sign_in_failures";
    for (const auto end = testing::Soon(60);; std::this_thread::sleep_for(std::chrono::milliseconds(50))) {
      const std::string failed = Texts(sql).at(0);
      if (failed == wanted || std::chrono::steady_clock::now() > end) return failed;
    }
  }

  testing::ThrowawayDatabase database_;
  const std::unique_ptr<storage::Database> as_plant_ =
      storage::Database::Open(testing::AsRole(database_.conninfo(), "plant"), 8);
  testing::PlantCertificates certificates_;
  Desk desk_{as_plant_.get(), certificates_, nullptr};
  v1::Account account_;
  v1::Session session_;
};

TEST_F(AccountServiceTest, AnAccountIsMadeOnceAndChanged) {
  EXPECT_EQ(Create("users/jane"), "OK") << desk_.last();
  EXPECT_EQ(account_.name(), "users/jane");
  EXPECT_THAT(account_.roles(), ElementsAre(access::v1::ROLE_ENGINEER));
  EXPECT_EQ(account_.sign_in_method(), v1::SIGN_IN_METHOD_PASSWORD);
  EXPECT_EQ(Create("users/jane"), "OK");  // again
  EXPECT_EQ(Create("users/jane", {access::v1::ROLE_ADMIN}), "ACCOUNT_EXISTS");
  EXPECT_EQ(Create("users/jane", {access::v1::ROLE_ENGINEER}, "another password"), "ACCOUNT_EXISTS");
  v1::SetAccountRolesRequest roles;
  roles.add_roles(access::v1::ROLE_ADMIN);
  roles.add_roles(access::v1::ROLE_QUALITY);
  roles.add_roles(access::v1::ROLE_ADMIN);
  EXPECT_EQ(Change(&AccountStub::SetAccountRoles, "users/jane", roles), "OK");
  EXPECT_EQ(Change(&AccountStub::SetAccountRoles, "users/jane", roles), "OK");  // as it is: nothing is done
  EXPECT_THAT(account_.roles(), ElementsAre(access::v1::ROLE_QUALITY, access::v1::ROLE_ADMIN));
  EXPECT_EQ(Change(&AccountStub::DisableAccount, "users/jane"), "OK");
  EXPECT_EQ(Change(&AccountStub::DisableAccount, "users/jane"), "OK");
  EXPECT_TRUE(account_.disabled());
  EXPECT_EQ(Change(&AccountStub::EnableAccount, "users/jane"), "OK");
  v1::SetPasswordRequest password;
  password.set_password("something else that is long");
  EXPECT_EQ(Change(&AccountStub::SetPassword, "users/jane", password), "OK");
  EXPECT_EQ(Change(&AccountStub::GetAccount, "users/jane"), "OK");
  EXPECT_FALSE(account_.disabled());
  EXPECT_THAT(Events(), ElementsAre("users/jane created", "users/jane roles_set", "users/jane disabled",
                                    "users/jane enabled", "users/jane password_set"));
  EXPECT_EQ(desk_.SignIn("users/jane", kPassword, &session_), "SIGN_IN_REFUSED");
  EXPECT_EQ(desk_.SignIn("users/jane", "something else that is long", &session_), "OK") << desk_.last();
  EXPECT_EQ(Change(&AccountStub::GetAccount, "users/nobody"), "ACCOUNT_NOT_FOUND");
  EXPECT_EQ(Change(&AccountStub::DisableAccount, "users/nobody"), "ACCOUNT_NOT_FOUND");
}

TEST_F(AccountServiceTest, WhatIsNoAccountIsRefusedByField) {
  for (const char* name : {"", "jane", "machines/m1", "services/gateway", "users/", "users/../x", "users/a b"}) {
    EXPECT_EQ(Create(name), "INVALID_ARGUMENT") << name;
    EXPECT_THAT(std::string(desk_.last().message()), HasSubstr("name: ")) << name;
  }
  for (const access::v1::Role role : {access::v1::ROLE_UNSPECIFIED, access::v1::ROLE_MACHINE, access::v1::ROLE_SERVICE,
                                      access::v1::ROLE_GATEWAY, static_cast<access::v1::Role>(77)}) {
    EXPECT_EQ(Create("users/jane", {role}), "INVALID_ARGUMENT") << role;
    EXPECT_THAT(std::string(desk_.last().message()), HasSubstr("roles: ")) << role;
  }
  EXPECT_EQ(Create("users/jane", {}), "INVALID_ARGUMENT");
  EXPECT_EQ(Create("users/jane", {access::v1::ROLE_ADMIN}, "shortsecret"), "INVALID_ARGUMENT");
  EXPECT_THAT(std::string(desk_.last().message()), HasSubstr("password: 11 bytes, want 12 to 128"));
  EXPECT_THAT(std::string(desk_.last().message()), Not(HasSubstr("secret")));
}

TEST_F(AccountServiceTest, ListsEveryPage) {
  for (const char* name : {"users/c", "users/a", "users/b"}) ASSERT_EQ(Create(name), "OK");
  v1::ListAccountsRequest request;
  request.set_page_size(2);
  v1::ListAccountsResponse page;
  ASSERT_EQ(desk_.Ask(&AccountStub::ListAccounts, request, &page), "OK");
  ASSERT_EQ(page.accounts_size(), 2);
  EXPECT_EQ(page.accounts(1).name(), "users/b");
  request.set_page_token(page.next_page_token());
  ASSERT_EQ(desk_.Ask(&AccountStub::ListAccounts, request, &page), "OK");
  ASSERT_EQ(page.accounts_size(), 1);
  EXPECT_EQ(page.accounts(0).name(), "users/c");
  EXPECT_EQ(page.next_page_token(), "");
}

TEST_F(AccountServiceTest, ASessionSaysWhoAndIsRenewedUntilItEnds) {
  ASSERT_EQ(Create("users/jane", {access::v1::ROLE_QUALITY, access::v1::ROLE_ENGINEER}), "OK");
  ASSERT_EQ(desk_.SignIn("users/jane", kPassword, &session_), "OK") << desk_.last();
  EXPECT_EQ(session_.name(), "users/jane");
  EXPECT_THAT(session_.roles(), ElementsAre(access::v1::ROLE_ENGINEER, access::v1::ROLE_QUALITY));
  EXPECT_EQ(session_.expires_at().seconds() - session_.signed_in_at().seconds(), 15 * 60);
  EXPECT_EQ(session_.renewable_until().seconds() - session_.signed_in_at().seconds(), 12 * 3600);
  const auto read = identity::ReadSession(session_.token());
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(read->person.Text(), "users/jane");
  v1::RenewSessionRequest renew;
  renew.set_token(session_.token());
  v1::Session renewed;
  ASSERT_EQ(desk_.Ask(&AccountStub::RenewSession, renew, &renewed), "OK") << desk_.last();
  EXPECT_NE(renewed.token(), session_.token());
  EXPECT_EQ(renewed.signed_in_at().nanos(), session_.signed_in_at().nanos());
  EXPECT_GE(renewed.expires_at().seconds(), session_.expires_at().seconds());
  v1::SignOutRequest out;
  v1::SignOutResponse done;
  out.set_token(renewed.token());
  EXPECT_EQ(desk_.Ask(&AccountStub::SignOut, out, &done), "OK");
  EXPECT_EQ(desk_.Ask(&AccountStub::SignOut, out, &done), "OK");  // again changes nothing
  EXPECT_EQ(desk_.Ask(&AccountStub::RenewSession, renew, &renewed), "SESSION_ENDED");
  EXPECT_THAT(Events(), ElementsAre("users/jane created", "users/jane signed_in", "users/jane signed_out"));
  for (const std::string token : {"", "x", "s1.a.b.c"}) {
    renew.set_token(token);
    out.set_token(token);
    const std::string wanted = token.empty() ? "INVALID_ARGUMENT" : "SESSION_NOT_VALID";
    EXPECT_EQ(desk_.Ask(&AccountStub::RenewSession, renew, &renewed), wanted);
    EXPECT_EQ(desk_.Ask(&AccountStub::SignOut, out, &done), wanted);
  }
}

// Whether the name or the password was wrong, or the account is disabled: one answer, and the denials say more to the plant's people.
TEST_F(AccountServiceTest, ARefusalSaysTheSameWhateverWasWrong) {
  ASSERT_EQ(Create("users/jane"), "OK");
  ASSERT_EQ(Create("users/gone"), "OK");
  ASSERT_EQ(Change(&AccountStub::DisableAccount, "users/gone"), "OK");
  std::set<std::string> said;
  for (const auto& [name, password] :
       std::vector<std::pair<std::string, std::string>>{{"users/jane", "wrong horse battery staple"},
                                                        {"users/jane", ""},
                                                        {"users/nobody", kPassword},
                                                        {"jane", kPassword},
                                                        {"", ""},
                                                        {"users/gone", kPassword},
                                                        {"users/jane' OR '1'='1", kPassword},
                                                        {"machines/m1", kPassword}}) {
    EXPECT_EQ(desk_.SignIn(name, password, &session_), "SIGN_IN_REFUSED") << name;
    said.insert(std::string(desk_.last().message()));
  }
  EXPECT_EQ(said.size(), 1u) << ::testing::PrintToString(said);
  ASSERT_EQ(desk_.refused.size(), 8u);
  for (const auto& one : desk_.refused) {
    EXPECT_THAT(one.account, AnyOf("", "users/jane", "users/gone"));
    EXPECT_EQ(one.peer_address, "192.0.2.1");
    EXPECT_EQ(one.method, "sixpoint.plant.v1.AccountService/SignIn");
    EXPECT_THAT(one.sentence, Not(HasSubstr("horse")));
  }
  for (const char* address : {"", "localhost", "192.0.2.300", "::g"})
    EXPECT_EQ(desk_.SignIn("users/jane", kPassword, &session_, address), "INVALID_ARGUMENT") << address;
  v1::ChangeOwnPasswordRequest change;
  change.set_old_password(kPassword);
  change.set_new_password("another long password");
  v1::ChangeOwnPasswordResponse changed;
  EXPECT_EQ(desk_.Ask(&AccountStub::ChangeOwnPassword, change, &changed), "ROLE_MISSING");  // no session
}

// An address may guess no longer at many accounts than at one; people of one network are one address.
TEST_F(AccountServiceTest, WhoTriesManyAccountsFromOneNetworkWaitsToo) {
  ASSERT_EQ(Create("users/jane"), "OK");
  // As eighteen that failed before, without the work of judging them.
  const std::string network("\x20\x01\x0d\xb8\0\0\0\0", 8);
  for (int i = 0; i < 18; ++i) {
    auto transaction = as_plant_->Begin(testing::Soon());
    const auto start = storage::BeginSignIn(*transaction, {{}, storage::FailureCounter{network, 20}});
    ASSERT_TRUE(start.ok() && start->counted_at) << i << start.status();
    ASSERT_TRUE(transaction->Commit().ok());
  }
  EXPECT_EQ(desk_.SignIn("users/a", "wrong horse battery", &session_, "2001:db8::1"), "SIGN_IN_REFUSED");
  EXPECT_EQ(desk_.SignIn("users/jane", kPassword, &session_, "2001:db8::2"), "OK") << desk_.last();  // is given back
  EXPECT_EQ(desk_.SignIn("users/b", "wrong horse battery", &session_, "2001:db8::3"), "SIGN_IN_REFUSED");
  EXPECT_EQ(desk_.SignIn("users/jane", kPassword, &session_, "2001:db8::ffff"), "SIGN_IN_SLOWED");
  EXPECT_GE(std::stoi(runtime::MetadataOf(desk_.last()).at("wait_s")), 1);
  EXPECT_EQ(desk_.SignIn("users/jane", kPassword, &session_, "2001:db8:0:1::1"), "OK") << desk_.last();
}

// What is typed as an account's name is no address.
TEST_F(AccountServiceTest, NobodyTypesAnAddressIntoWaiting) {
  ASSERT_EQ(Create("users/jane"), "OK");
  for (int i = 0; i < 5; ++i)
    EXPECT_EQ(desk_.SignIn("address c0000202", "wrong horse battery", &session_, "198.51.100.1"), "SIGN_IN_REFUSED");
  EXPECT_EQ(desk_.SignIn("address c0000202", "wrong horse battery", &session_, "198.51.100.1"), "SIGN_IN_SLOWED");
  EXPECT_EQ(desk_.SignIn("users/jane", kPassword, &session_, "192.0.2.2"), "OK") << desk_.last();
}

// Right or wrong it was not: a database that does not answer after the password was judged, a client that is gone.
TEST_F(AccountServiceTest, WhatIsNotRefusedIsNotCounted) {
  ASSERT_EQ(Create("users/jane"), "OK");
  {
    auto holder = database_.database()->Begin(testing::Soon(60));
    ASSERT_TRUE(holder->Execute("SELECT 1 FROM accounts FOR UPDATE").ok());
    desk_.patience = std::chrono::seconds(4);
    EXPECT_THAT(desk_.SignIn("users/jane", kPassword, &session_), AnyOf("DEADLINE_EXCEEDED", "CANCELLED"));
    EXPECT_EQ(FailedOnceSettled("0"), "0");
    desk_.patience = std::chrono::seconds(60);
    std::thread gone([&] { EXPECT_EQ(desk_.SignIn("users/jane", kPassword, &session_), "CANCELLED"); });
    EXPECT_EQ(FailedOnceSettled("2"), "2");  // of the account, and of the address, while it is judged
    desk_.Cancel();
    gone.join();
    std::this_thread::sleep_for(std::chrono::milliseconds(300));  // for the server to hear of it
  }
  EXPECT_EQ(FailedOnceSettled("0"), "0");
  EXPECT_THAT(Events(), ElementsAre("users/jane created"));
  EXPECT_EQ(desk_.SignIn("users/jane", "wrong horse battery staple", &session_), "SIGN_IN_REFUSED");
  EXPECT_EQ(FailedOnceSettled("2"), "2");
  EXPECT_EQ(desk_.SignIn("users/jane", kPassword, &session_), "OK") << desk_.last();
  EXPECT_EQ(FailedOnceSettled("1"), "1");
}

// A token that is over ends the account's sessions too, as long as one that was renewed from it may live.
TEST_F(AccountServiceTest, ASignOutByATokenThatIsOverEndsWhatWasRenewed) {
  ASSERT_EQ(Create("users/jane"), "OK");
  ASSERT_EQ(desk_.SignIn("users/jane", kPassword, &session_), "OK");
  const auto over = [&](std::chrono::minutes ago) {
    identity::Session session = identity::ReadSession(session_.token()).value();
    session.since -= ago;
    session.until = session.since + identity::kLongestToken;
    return identity::SignSession(session, certificates_.Service("plant") / identity::kIdentityFile).value();
  };
  v1::SignOutRequest out;
  v1::SignOutResponse done;
  v1::RenewSessionRequest renew;
  v1::Session renewed;
  renew.set_token(session_.token());
  out.set_token(over(std::chrono::minutes(12 * 60 + 1)));
  EXPECT_EQ(desk_.Ask(&AccountStub::SignOut, out, &done), "OK") << desk_.last();
  EXPECT_EQ(desk_.Ask(&AccountStub::RenewSession, renew, &renewed), "OK") << desk_.last();
  out.set_token(over(std::chrono::minutes(16)));
  EXPECT_EQ(desk_.Ask(&AccountStub::SignOut, out, &done), "OK") << desk_.last();
  EXPECT_EQ(desk_.Ask(&AccountStub::RenewSession, renew, &renewed), "SESSION_ENDED");
  EXPECT_THAT(Events(), ElementsAre("users/jane created", "users/jane signed_in", "users/jane signed_out"));
}

// An end that the database's clock has not reached, for it was set back: what begins then begins after it, or is told why not.
TEST_F(AccountServiceTest, AClockThatWasSetBackIsToldOrMadeUpFor) {
  ASSERT_EQ(Create("users/jane"), "OK");
  ASSERT_EQ(desk_.SignIn("users/jane", kPassword, &session_), "OK");
  v1::SignOutRequest out;
  v1::SignOutResponse done;
  out.set_token(session_.token());
  ASSERT_EQ(desk_.Ask(&AccountStub::SignOut, out, &done), "OK");
  const auto end_in = [&](const std::string& ahead) {
    Texts("UPDATE session_ends SET ended_before = clock_timestamp() + interval '" + ahead + "'");
  };
  end_in("40 seconds");
  ASSERT_EQ(desk_.SignIn("users/jane", kPassword, &session_), "OK") << desk_.last();
  v1::RenewSessionRequest renew;
  renew.set_token(session_.token());
  EXPECT_EQ(desk_.Ask(&AccountStub::RenewSession, renew, &session_), "OK") << desk_.last();
  out.set_token(session_.token());
  ASSERT_EQ(desk_.Ask(&AccountStub::SignOut, out, &done), "OK");
  EXPECT_EQ(desk_.Ask(&AccountStub::RenewSession, renew, &session_), "SESSION_ENDED");
  end_in("1 hour");
  EXPECT_EQ(desk_.SignIn("users/jane", kPassword, &session_), "SERVICE_NOT_READY");
  EXPECT_THAT(std::string(desk_.last().message()), HasSubstr("set back"));
  EXPECT_EQ(FailedOnceSettled("0"), "0");
}

// Sixteen at once, of which two are judged at a time: none gets a try more than one after the other would.
TEST_F(AccountServiceTest, ManyAtOnceGetNoMoreTries) {
  ASSERT_EQ(Create("users/jane"), "OK");
  std::atomic<int> refused{0}, slowed{0}, others{0};
  std::vector<std::thread> threads;
  for (int i = 0; i < 16; ++i)
    threads.emplace_back([&, i] {
      Desk desk(as_plant_.get(), certificates_, nullptr);
      v1::Session session;
      const std::string said =
          desk.SignIn("users/jane", "wrong horse battery staple", &session, "192.0.2." + std::to_string(i));
      ++(said == "SIGN_IN_REFUSED" ? refused : said == "SIGN_IN_SLOWED" ? slowed : others);
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(refused, 5);
  EXPECT_EQ(slowed, 11);
  EXPECT_EQ(others, 0);
}

class OidcTest : public AccountServiceTest {
 protected:
  void SetUp() override {
    if (!ProviderTokens::MayBeMade()) GTEST_SKIP() << "python3-jwt or python3-cryptography is absent";
    ASSERT_TRUE(files_.Make());
  }
  std::unique_ptr<IdentityProvider> Provider(identity::Role role,
                                             const std::map<std::string, std::string>& persons = {}) const {
    IdentityProviderConfig config;
    config.policy.issuer = "https://id.plant.example";
    config.policy.client_id = "sixpoint";
    config.policy.roles = {{"turbine-engineers", role}};
    config.keys_file = (files_.folder() / "keys.json").string();
    config.persons = persons;
    return std::make_unique<IdentityProvider>(config);
  }
  const ProviderTokens files_;
};

TEST_F(OidcTest, WhomTheProviderVouchesForHasAnAccount) {
  Desk desk(as_plant_.get(), certificates_, Provider(identity::Role::kEngineer));
  ASSERT_EQ(desk.SignInWithIdToken(files_.Text("good.rs256"), &session_), "OK") << desk.last();
  EXPECT_EQ(session_.name(), "users/jane");
  EXPECT_EQ(session_.sign_in_method(), v1::SIGN_IN_METHOD_OIDC);
  const v1::Session first = session_;
  ASSERT_EQ(desk.SignInWithIdToken(files_.Text("good.es256"), &session_), "OK");
  EXPECT_THAT(Events(), ElementsAre("users/jane created", "users/jane signed_in", "users/jane signed_in"));
  EXPECT_EQ(desk.SignInWithIdToken(files_.Text("good.rs256"), &session_, "n-2"), "SIGN_IN_REFUSED");
  EXPECT_EQ(desk.SignInWithIdToken(files_.Text("bad.alg_none"), &session_), "SIGN_IN_REFUSED");
  EXPECT_THAT(std::string(desk.last().message()), Not(HasSubstr("alg")));
  EXPECT_THAT(desk.refused.back().sentence, HasSubstr("algorithm"));
  // It has no password, and its roles are the provider's to say.
  EXPECT_EQ(desk.SignIn("users/jane", "", &session_), "SIGN_IN_REFUSED");
  v1::SetPasswordRequest password;
  password.set_password(kPassword);
  EXPECT_EQ(Change(&AccountStub::SetPassword, "users/jane", password), "INVALID_ARGUMENT");
  // Other roles by the directory: what she had before ends.
  Desk later(as_plant_.get(), certificates_, Provider(identity::Role::kQuality));
  ASSERT_EQ(later.SignInWithIdToken(files_.Text("good.ps256"), &session_), "OK") << later.last();
  EXPECT_THAT(session_.roles(), ElementsAre(access::v1::ROLE_QUALITY));
  v1::RenewSessionRequest renew;
  renew.set_token(first.token());
  EXPECT_EQ(later.Ask(&AccountStub::RenewSession, renew, &session_), "SESSION_ENDED");
  EXPECT_EQ(Change(&AccountStub::DisableAccount, "users/jane"), "OK");
  EXPECT_EQ(later.SignInWithIdToken(files_.Text("good.rs256"), &session_), "SIGN_IN_REFUSED");
}

// A directory that gives a name which the plant gave somebody else gives nobody his account.
TEST_F(OidcTest, ANameOfAnotherOneIsNotTaken) {
  ASSERT_EQ(Create("users/jane", {access::v1::ROLE_ADMIN}), "OK");
  Desk desk(as_plant_.get(), certificates_, Provider(identity::Role::kEngineer));
  EXPECT_EQ(desk.SignInWithIdToken(files_.Text("good.rs256"), &session_), "SIGN_IN_REFUSED");
  EXPECT_THAT(desk.refused.back().sentence, HasSubstr("another one's"));
  EXPECT_EQ(desk_.SignInWithIdToken(files_.Text("good.rs256"), &session_), "IDENTITY_PROVIDER_MISSING");
}

// Whoever may choose what a directory calls him becomes nobody whom the plant knows without an account: who asked with a
// certificate, who was cleared in advance, whom a certificate waits for.
TEST_F(OidcTest, ANameThatThePlantKnowsIsNotTaken) {
  Desk desk(as_plant_.get(), certificates_, Provider(identity::Role::kEngineer));
  for (const auto& [known_by, again] : std::vector<std::pair<std::string, std::string>>{
           {"SELECT pseudonym_of('users/jane')", "SELECT forget_person('jane')"},
           {"INSERT INTO clearance_events (event_id, holder, scope, granted, requested_by, request_id, took_effect) "
            "VALUES (gen_random_uuid(), 'users/jane', 'customers/acme', true, 'users/it', gen_random_uuid(), true)",
            "SELECT forget_person('jane')"},
           {"INSERT INTO credential_offers (pickup_sha256, sealed, identity, offered_by, expires_at) VALUES "
            "(sha256('x'), 'x', 'users/jane', 'users/it', clock_timestamp() + interval '1 hour')",
            "DELETE FROM credential_offers"}}) {
    Texts(known_by);
    EXPECT_EQ(desk.SignInWithIdToken(files_.Text("good.rs256"), &session_), "SIGN_IN_REFUSED") << known_by;
    EXPECT_EQ(desk.refused.back().account, "users/jane");
    EXPECT_THAT(desk.refused.back().sentence, HasSubstr("another one's"));
    EXPECT_THAT(Events(), ElementsAre()) << known_by;
    Texts(again);
  }
  // Nor does a refusal make anybody known: now nobody is, and she has her account.
  EXPECT_EQ(desk.SignInWithIdToken(files_.Text("good.rs256"), &session_), "OK") << desk.last();
  EXPECT_EQ(desk.SignInWithIdToken(files_.Text("good.es256"), &session_), "OK") << desk.last();
}

// Who starts the plant says which subject is whom.
TEST_F(OidcTest, WhoSaysWhoASubjectIsLinksThem) {
  Texts("SELECT pseudonym_of('users/jane')");
  Texts("SELECT pseudonym_of('users/j.doe')");
  Desk other(as_plant_.get(), certificates_, Provider(identity::Role::kEngineer, {{"e2b0", "users/jane"}}));
  EXPECT_EQ(other.SignInWithIdToken(files_.Text("good.rs256"), &session_), "SIGN_IN_REFUSED");
  Desk desk(as_plant_.get(), certificates_, Provider(identity::Role::kEngineer, {{"f3a1", "users/j.doe"}}));
  EXPECT_EQ(desk.SignInWithIdToken(files_.Text("good.rs256"), &session_), "OK") << desk.last();
  EXPECT_EQ(session_.name(), "users/j.doe");
  // It stays hers, whatever the file says later; and an account that another one has is not given by it.
  EXPECT_EQ(other.SignInWithIdToken(files_.Text("good.rs256"), &session_), "OK") << other.last();
  EXPECT_EQ(session_.name(), "users/j.doe");
}

TEST_F(OidcTest, AnAccountIsNotGivenAwayByTheFile) {
  ASSERT_EQ(Create("users/joe"), "OK");
  Desk desk(as_plant_.get(), certificates_, Provider(identity::Role::kEngineer, {{"f3a1", "users/joe"}}));
  EXPECT_EQ(desk.SignInWithIdToken(files_.Text("good.rs256"), &session_), "SIGN_IN_REFUSED");
}

TEST_F(OidcTest, OfAProviderThatIsAwayNothingIsCounted) {
  Desk desk(as_plant_.get(), certificates_, Provider(identity::Role::kEngineer));
  std::filesystem::rename(files_.folder() / "keys.json", files_.folder() / "away.json");
  for (int i = 0; i < 25; ++i)
    ASSERT_EQ(desk.SignInWithIdToken(files_.Text("good.rs256"), &session_), "IDENTITY_PROVIDER_AWAY") << i;
  EXPECT_EQ(FailedOnceSettled("0"), "0");
  EXPECT_TRUE(desk.refused.empty());
}

}  // namespace
}  // namespace sixpoint::plant
