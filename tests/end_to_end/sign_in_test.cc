// People on the real processes: an account, a sign-in at the gateway, calls by a session, and its end.
#include <cstdlib>

#include "sixpoint/correction/v1/correction.grpc.pb.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"
#include "sixpoint/ingest/v1/store.grpc.pb.h"
#include "sixpoint/plant/v1/account.grpc.pb.h"
#include "sixpoint/plant/v1/credentials.grpc.pb.h"
#include "sixpoint/plant/v1/record.grpc.pb.h"
#include "tests/end_to_end/door.h"
#include "tests/services/plant/provider_tokens.h"
#include "tests/services/plant/sample_registry.h"
#include "tests/support/some_uuid.h"

namespace sixpoint::testing {
namespace {

using identity::Role;
using plant::v1::AccountService;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::Not;

// One call, by a session where there is one.
template <typename Stub, typename Method, typename Request, typename Response>
grpc::Status Ask(const Stub& stub, Method method, const Request& request, Response* response,
                 const std::string& session = "") {
  grpc::ClientContext context;
  context.set_deadline(Within(20));
  if (!session.empty()) context.AddMetadata("sixpoint-session", session);
  return (stub.get()->*method)(&context, request, response);
}

class SignIn : public Door {
 protected:
  void SetUp() override {
    Door::SetUp();
    const auto gateway = Of(plant_.certificates().Gateway());
    gateway_ = ChannelTo("plant", gateway);
    gateway_to_ingest_ = ChannelTo("ingest", gateway);
    gateway_to_correction_ = ChannelTo("correction", gateway);
    admin_ = AccountService::NewStub(ChannelTo("plant", Of(plant_.certificates().User("it", {Role::kAdmin}))));
    desk_ = AccountService::NewStub(gateway_);
    CreateAccount("jane", access::v1::ROLE_ENGINEER);
  }

  grpc::Status Try(const std::string& name, const std::string& password, plant::v1::Session* session) {
    plant::v1::SignInRequest request;
    request.set_name(name);
    request.set_password(password);
    // Each from an address of its own, so that only the account's failures are counted together.
    request.set_client_address("192.0.2." + std::to_string(++tries_));
    return Ask(desk_, &AccountService::Stub::SignIn, request, session);
  }
  std::string Jane() {
    plant::v1::Session session;
    const grpc::Status signed_in = Try("users/jane", kPassword, &session);
    EXPECT_TRUE(signed_in.ok()) << signed_in.error_message();
    return session.token();
  }
  // GetMachine of one that is not there, over the gateway: NOT_FOUND for who is let in.
  grpc::Status Look(const std::string& session, const std::shared_ptr<grpc::Channel>& channel = nullptr) {
    plant::v1::GetMachineRequest request;
    request.set_name("machines/m1");
    plant::v1::Machine machine;
    return Ask(plant::v1::PlantService::NewStub(channel == nullptr ? gateway_ : channel),
               &plant::v1::PlantService::Stub::GetMachine, request, &machine, session);
  }
  // And serves again.
  void RestartPlant(const std::vector<std::string>& flags = {}) {
    plant_.Kill("plant");
    plant_.Start("plant", flags);
    EXPECT_TRUE(plant_.WaitUntilUp("plant", 30));
    EXPECT_TRUE(
        Becomes(std::chrono::seconds(30), [&] { return Look("").error_code() != grpc::StatusCode::UNAVAILABLE; }));
  }
  // Every service knows it within two seconds; a busy machine is given more.
  std::string ReasonOnceRefused(const std::string& session, const std::shared_ptr<grpc::Channel>& channel = nullptr) {
    for (const auto end = Within(20);; std::this_thread::sleep_for(std::chrono::milliseconds(50))) {
      const grpc::Status looked = Look(session, channel);
      if (looked.error_code() != grpc::StatusCode::NOT_FOUND || std::chrono::system_clock::now() > end)
        return ReasonOf(looked);
    }
  }

  std::shared_ptr<grpc::Channel> gateway_, gateway_to_ingest_, gateway_to_correction_;
  std::unique_ptr<AccountService::Stub> admin_, desk_;
  int tries_ = 0;
};

TEST_F(SignIn, APersonCallsByHisSessionAndTheRecordSaysWho) {
  const std::string jane = Jane();
  EXPECT_EQ(Look(jane).error_code(), grpc::StatusCode::NOT_FOUND);
  const auto plant = plant::v1::PlantService::NewStub(gateway_);
  plant::v1::CreateArtefactRequest create = plant::SampleArtefact();
  create.set_request_id(kSomeUuid);
  plant::v1::Artefact artefact;
  const grpc::Status created = Ask(plant, &plant::v1::PlantService::Stub::CreateArtefact, create, &artefact, jane);
  ASSERT_TRUE(created.ok()) << created.error_message();
  plant::v1::GetRecordEntryRequest of;
  of.set_name(artefact.name() + "@1");
  plant::v1::RecordEntry entry;
  const grpc::Status got = Ask(plant::v1::RecordService::NewStub(gateway_),
                               &plant::v1::RecordService::Stub::GetRecordEntry, of, &entry, jane);
  ASSERT_TRUE(got.ok()) << got.error_message();
  EXPECT_EQ(entry.requested_by(), "users/jane via services/gateway");
  // A call that goes on to another service goes on for her: registration knows none of that name, which it tells who may ask.
  correction::v1::CorrectRequest correct;
  correct.set_request_id(kSomeUuid);
  correct.set_registration("registrations/none");
  correction::v1::Correction correction;
  const grpc::Status passed_on = Ask(correction::v1::CorrectionService::NewStub(gateway_to_correction_),
                                     &correction::v1::CorrectionService::Stub::Correct, correct, &correction, jane);
  EXPECT_EQ(passed_on.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << passed_on.error_message();
  // What an engineer may not, she may not.
  ingest::v1::MakeMonthsRequest months;
  ingest::v1::MakeMonthsResponse made;
  const grpc::Status refused = Ask(ingest::v1::CloudStoreService::NewStub(gateway_to_ingest_),
                                   &ingest::v1::CloudStoreService::Stub::MakeMonths, months, &made, jane);
  EXPECT_EQ(ReasonOf(refused), "ROLE_MISSING") << refused.error_message();
  EXPECT_THAT(refused.error_message(), HasSubstr("users/jane is engineer, want admin"));
  EXPECT_THAT(Denials("ROLE_MISSING"), Contains(Field(&storage::Denial::caller, "users/jane via services/gateway")));
}

TEST_F(SignIn, ASessionIsTheGatewaysToSendAndTheGatewayNobodyWithoutOne) {
  const std::string jane = Jane();
  EXPECT_EQ(ReasonOf(Look("")), "ROLE_MISSING");
  auto& certificates = plant_.certificates();
  for (const auto& folder : {certificates.User("boss", {Role::kEngineer, Role::kAdmin}), certificates.Machine("m1"),
                             certificates.Service("elsewhere")}) {
    const grpc::Status refused = Look(jane, ChannelTo("plant", Of(folder)));
    EXPECT_EQ(refused.error_code(), grpc::StatusCode::PERMISSION_DENIED) << folder;
    EXPECT_THAT(refused.error_message(), HasSubstr("sixpoint-session: with a call of"));
  }
  EXPECT_EQ(ReasonOf(Look(jane, ChannelTo("plant", Of(certificates.Nobody())))), "CERTIFICATE_MISSING");
  for (const std::string& other : {std::string("x"), jane + "A", jane.substr(1), std::string(4000, 'A')}) {
    const grpc::Status refused = Look(other);
    EXPECT_EQ(refused.error_code(), grpc::StatusCode::UNAUTHENTICATED);
    EXPECT_EQ(ReasonOf(refused), "SESSION_NOT_VALID") << refused.error_message();
  }
  EXPECT_THAT(Denials("SESSION_NOT_VALID"), Contains(AllOf(Field(&storage::Denial::reason, "SESSION_NOT_VALID"),
                                                           Field(&storage::Denial::caller, "services/gateway"))));
  // Two at once, and one for somebody else: the gateway says no other way whom it calls for.
  grpc::ClientContext twice, lying;
  plant::v1::GetMachineRequest request;
  request.set_name("machines/m1");
  plant::v1::Machine machine;
  twice.set_deadline(Within(20));
  twice.AddMetadata("sixpoint-session", jane);
  twice.AddMetadata("sixpoint-session", jane);
  const auto plant = plant::v1::PlantService::NewStub(gateway_);
  EXPECT_EQ(plant->GetMachine(&twice, request, &machine).error_code(), grpc::StatusCode::PERMISSION_DENIED);
  lying.set_deadline(Within(20));
  lying.AddMetadata("sixpoint-session", jane);
  lying.AddMetadata("sixpoint-requested-for", "users/boss");
  EXPECT_EQ(plant->GetMachine(&lying, request, &machine).error_code(), grpc::StatusCode::PERMISSION_DENIED);
  // A method that anybody may call judges a session that comes with it all the same.
  plant::v1::TakeCredentialsRequest take;
  plant::v1::TakeCredentialsResponse taken;
  EXPECT_EQ(ReasonOf(Ask(plant::v1::CredentialsService::NewStub(gateway_),
                         &plant::v1::CredentialsService::Stub::TakeCredentials, take, &taken, "x")),
            "SESSION_NOT_VALID");
}

// A sign-out, another role, another password, a disabled account: the next call is refused, and a stream that runs is ended.
TEST_F(SignIn, WhateverEndsASessionEndsItsCallsToo) {
  plant::v1::Account account;
  const auto sign_out = [&](const std::string& token) {
    plant::v1::SignOutRequest request;
    request.set_token(token);
    plant::v1::SignOutResponse response;
    return Ask(desk_, &AccountService::Stub::SignOut, request, &response);
  };
  const auto roles = [&](const std::string&) {
    plant::v1::SetAccountRolesRequest request;
    request.set_name("users/jane");
    request.add_roles(access::v1::ROLE_ENGINEER);
    request.add_roles(access::v1::ROLE_QUALITY);
    return Ask(admin_, &AccountService::Stub::SetAccountRoles, request, &account);
  };
  const auto password = [&](const std::string& token) {
    plant::v1::ChangeOwnPasswordRequest request;
    request.set_old_password(kPassword);
    request.set_new_password("another " + std::string(kPassword));
    plant::v1::ChangeOwnPasswordResponse response;
    const grpc::Status changed = Ask(desk_, &AccountService::Stub::ChangeOwnPassword, request, &response, token);
    plant::v1::SetPasswordRequest back;
    back.set_name("users/jane");
    back.set_password(kPassword);
    const grpc::Status set = Ask(admin_, &AccountService::Stub::SetPassword, back, &account);
    return changed.ok() ? set : changed;
  };
  const auto disable = [&](const std::string&) {
    plant::v1::DisableAccountRequest request;
    request.set_name("users/jane");
    return Ask(admin_, &AccountService::Stub::DisableAccount, request, &account);
  };
  const std::vector<std::pair<std::string, std::function<grpc::Status(const std::string&)>>> ends = {
      {"signed out", sign_out}, {"other roles", roles}, {"another password", password}, {"disabled", disable}};
  const auto owner = storage::Database::Open(database_.conninfo(), 1);
  for (const auto& [how, end] : ends) {
    SCOPED_TRACE(how);
    const std::string jane = Jane();
    EXPECT_EQ(Look(jane).error_code(), grpc::StatusCode::NOT_FOUND);
    // A download that waits for its scan, and would for a minute.
    auto holder = owner->Begin(Soon(60));
    ASSERT_TRUE(holder->Execute("LOCK TABLE scans IN ACCESS EXCLUSIVE MODE").ok());
    grpc::ClientContext context;
    context.set_deadline(Within(60));
    context.AddMetadata("sixpoint-session", jane);
    ingest::v1::DownloadScanRequest request;
    request.set_name("scans/s1");
    const auto stream = ingest::v1::ScanService::NewStub(gateway_to_ingest_)->DownloadScan(&context, request);
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    const grpc::Status ended = end(jane);
    ASSERT_TRUE(ended.ok()) << ended.error_message();
    const auto begin = std::chrono::steady_clock::now();
    ingest::v1::DownloadScanResponse response;
    EXPECT_FALSE(stream->Read(&response));
    const grpc::Status status = stream->Finish();
    std::printf("%s: the stream ended after %.1f s\n", how.c_str(),
                std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    // On a machine so busy that it had not begun it is refused like any other call.
    EXPECT_THAT(status.error_code(), ::testing::AnyOf(grpc::StatusCode::CANCELLED, grpc::StatusCode::UNAUTHENTICATED))
        << status.error_message();
    EXPECT_EQ(ReasonOnceRefused(jane), "SESSION_ENDED");
    plant::v1::RenewSessionRequest renew;
    renew.set_token(jane);
    plant::v1::Session renewed;
    EXPECT_EQ(ReasonOf(Ask(desk_, &AccountService::Stub::RenewSession, renew, &renewed)), "SESSION_ENDED");
  }
  plant::v1::Session none;
  EXPECT_EQ(ReasonOf(Try("users/jane", kPassword, &none)), "SIGN_IN_REFUSED");
  plant::v1::EnableAccountRequest enable;
  enable.set_name("users/jane");
  ASSERT_TRUE(Ask(admin_, &AccountService::Stub::EnableAccount, enable, &account).ok());
  EXPECT_EQ(Look(Jane()).error_code(), grpc::StatusCode::NOT_FOUND);
}

// Whether the account is there shows in nothing; a restart forgets no failure, and no session.
TEST_F(SignIn, WhoGuessesWaitsAlsoAfterARestart) {
  plant::v1::Session session;
  const std::string jane = Jane();
  std::string said;
  for (const char* name : {"users/jane", "users/nobody"}) {
    for (int i = 0; i < 5; ++i) {
      const grpc::Status refused = Try(name, "wrong horse battery staple", &session);
      EXPECT_EQ(ReasonOf(refused), "SIGN_IN_REFUSED") << refused.error_message();
      if (said.empty()) said = refused.error_message();
      EXPECT_EQ(refused.error_message(), said);
    }
    const grpc::Status slowed = Try(name, kPassword, &session);
    EXPECT_EQ(ReasonOf(slowed), "SIGN_IN_SLOWED") << slowed.error_message();
    EXPECT_THAT(slowed.error_message(), Not(HasSubstr(name)));
  }
  const auto kept = Denials("SIGN_IN_SLOWED");
  EXPECT_THAT(kept, Contains(AllOf(Field(&storage::Denial::reason, "SIGN_IN_REFUSED"),
                                   Field(&storage::Denial::caller, "users/jane"))));
  for (const storage::Denial& denial : kept) {
    EXPECT_THAT(denial.caller, Not(HasSubstr("nobody")));
    EXPECT_THAT(denial.sentence, Not(HasSubstr("horse")));
  }
  RestartPlant();
  const grpc::Status after = Try("users/jane", kPassword, &session);
  EXPECT_EQ(ReasonOf(after), "SIGN_IN_SLOWED") << after.error_message();
  EXPECT_EQ(Look(jane).error_code(), grpc::StatusCode::NOT_FOUND) << Look(jane).error_message();
}

// By the plant's identity provider, as its file says it.
TEST_F(SignIn, ThePlantsDirectoryVouchesForPeople) {
  if (!plant::ProviderTokens::MayBeMade()) GTEST_SKIP() << "python3-jwt or python3-cryptography is absent";
  const plant::ProviderTokens files;
  ASSERT_TRUE(files.Make());
  const auto sign_in = [&](const std::string& token, plant::v1::Session* session) {
    plant::v1::SignInWithIdTokenRequest request;
    request.set_id_token(files.Text(token));
    request.set_nonce("n-1");
    request.set_client_address("192.0.2.1");
    return Ask(desk_, &AccountService::Stub::SignInWithIdToken, request, session);
  };
  plant::v1::Session session;
  EXPECT_EQ(ReasonOf(sign_in("good.es256", &session)), "IDENTITY_PROVIDER_MISSING");
  RestartPlant({"--oidc", files.Config("issuer: https://id.plant.example\nclient_id: sixpoint\nkeys_file: " +
                                       (files.folder() / "keys.json").string() +
                                       "\nname_claim: sub\nroles: {turbine-engineers: engineer}\n")});
  const grpc::Status signed_in = sign_in("good.es256", &session);
  ASSERT_TRUE(signed_in.ok()) << signed_in.error_message();
  EXPECT_EQ(session.name(), "users/f3a1");
  EXPECT_EQ(Look(session.token()).error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(ReasonOf(sign_in("bad.hs256_by_public_pem", &session)), "SIGN_IN_REFUSED");
  EXPECT_THAT(Denials("SIGN_IN_REFUSED"), Contains(Field(&storage::Denial::sentence, HasSubstr("algorithm"))));
}

// What the tool says, and that a password is on no command line.
TEST_F(SignIn, AnAdminKeepsAccountsByTheTool) {
  const auto run = [&](const std::string& words, const std::string& input = "") {
    const std::string out = plant_.folder() + "/out";
    const std::string command = "printf '%s\\n' '" + input + "' | " + PlantProcesses::Program("sixpoint") +
                                " --server " + plant_.server() + " accounts " + words + " > " + out + " 2>&1";
    const int code = std::system(command.c_str());
    return std::to_string(code) + "\n" + ReadFile(out);
  };
  EXPECT_THAT(run("create joe --role quality --role mes-reader --password-file -", kPassword),
              AllOf(HasSubstr("0\n"), HasSubstr("who        users/joe"), HasSubstr("quality, mes-reader")));
  EXPECT_THAT(run("list"), AllOf(HasSubstr("users/jane"), HasSubstr("users/joe")));
  EXPECT_THAT(run("show users/joe --json"), HasSubstr("\"SIGN_IN_METHOD_PASSWORD\""));
  EXPECT_THAT(run("create joe --role quality --password-file -", kPassword), HasSubstr("ACCOUNT_EXISTS"));
  EXPECT_THAT(run("password joe --password-file -", "short"),
              AllOf(HasSubstr("password: 5 bytes"), Not(HasSubstr("short,"))));
  EXPECT_THAT(run("disable joe"), HasSubstr("not: disabled"));
  EXPECT_THAT(run("enable joe"), HasSubstr("by password"));
  EXPECT_THAT(run("roles joe --role admin"), HasSubstr("roles      admin"));
  EXPECT_THAT(run("roles joe --role service"), HasSubstr("want"));
  EXPECT_THAT(run("show nobody"), HasSubstr("ACCOUNT_NOT_FOUND"));
  plant::v1::Session session;
  const grpc::Status signed_in = Try("users/joe", kPassword, &session);
  EXPECT_TRUE(signed_in.ok()) << signed_in.error_message();
}

}  // namespace
}  // namespace sixpoint::testing
