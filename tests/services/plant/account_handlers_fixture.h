// The handlers of accounts on a fake store: no PostgreSQL. Over TLS, for they ask who calls.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "identity/credentials.h"
#include "services/plant/account_service.h"
#include "services/runtime/call.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/credentials.h"
#include "services/runtime/errors.h"
#include "tests/support/becomes.h"
#include "tests/support/fake_accounts.h"
#include "tests/support/in_process_server.h"
#include "tests/support/plant_certificates.h"

namespace sixpoint::plant {

using AccountsStub = v1::AccountService::Stub;

inline constexpr char kJanesPassword[] = "correct horse battery staple",
                      kWrongPassword[] = "wrong horse battery staple";

// The client of that call goes away where the store is about to commit, after so many commits that went well.
inline testing::FakeCommits::Meanwhile GoneAtCommit(grpc::ClientContext& context, int commits_before = 0) {
  return [&context, commits_before](const storage::StillWanted& still_wanted) mutable {
    if (commits_before-- > 0) return;
    context.TryCancel();
    EXPECT_TRUE(testing::Becomes(std::chrono::seconds(30), [&] { return !still_wanted(); }));
  };
}

// Of who serves and who calls.
struct AccountCredentials {
  explicit AccountCredentials(testing::PlantCertificates& certificates)
      : plant(certificates.Service("plant")),
        admin(certificates.User("it", {identity::Role::kAdmin})),
        gateway(certificates.Gateway()),
        revoked_file(certificates.revoked_file()),
        identity_file(plant / identity::kIdentityFile) {}
  std::filesystem::path plant, admin, gateway;  // folders
  std::filesystem::path revoked_file;
  std::filesystem::path identity_file;  // by which sessions are signed: the plant service's own
};

// A server of the handlers, and who calls it.
class AccountHandlers {
 public:
  // provider: null where the plant has none.
  AccountHandlers(const std::shared_ptr<storage::AccountStore>& store, const AccountCredentials& credentials,
                  std::unique_ptr<IdentityProvider> provider)
      : service_(store, Options(credentials, std::move(provider))),
        server_({&service_}, 0, std::chrono::seconds(60), runtime::ServerCredentialsOf(credentials.plant).value()),
        admin_(StubOf(credentials.admin)),
        gateway_(StubOf(credentials.gateway)) {}

  // By users/it, who has a certificate.
  template <typename Request, typename Response>
  absl::StatusOr<Response> ByAdmin(grpc::Status (AccountsStub::*method)(grpc::ClientContext*, const Request&,
                                                                        Response*),
                                   const Request& request) {
    return Ask(*admin_, method, request, *runtime::ContextFor(60));
  }
  // By services/gateway; with a session's token, where there is one, by its person.
  template <typename Request, typename Response>
  absl::StatusOr<Response> OverGateway(grpc::Status (AccountsStub::*method)(grpc::ClientContext*, const Request&,
                                                                            Response*),
                                       const Request& request, const std::string& token = "") {
    const std::unique_ptr<grpc::ClientContext> context = runtime::ContextFor(60);
    if (!token.empty()) context->AddMetadata(runtime::kSession, token);
    return Ask(*gateway_, method, request, *context);
  }
  AccountsStub& admin() { return *admin_; }
  AccountsStub& gateway() { return *gateway_; }
  // What was counted as refused.
  std::vector<runtime::RefusedSignIn> refused() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return refused_;
  }

 private:
  SessionDeskOptions Options(const AccountCredentials& credentials, std::unique_ptr<IdentityProvider> provider) {
    SessionDeskOptions options;
    options.identity_file = credentials.identity_file;
    options.trust =
        std::make_unique<identity::Trust>(credentials.plant / identity::kAuthorityFile, credentials.revoked_file);
    options.provider = std::move(provider);
    options.count_refused = [this](const runtime::RefusedSignIn& one) {
      const std::lock_guard<std::mutex> lock(mutex_);
      refused_.push_back(one);
    };
    return options;
  }
  std::unique_ptr<AccountsStub> StubOf(const std::filesystem::path& folder) const {
    return v1::AccountService::NewStub(
        runtime::ConnectTo(server_.address(), runtime::ChannelCredentialsOf(folder).value()));
  }
  template <typename Request, typename Response>
  static absl::StatusOr<Response> Ask(AccountsStub& stub,
                                      grpc::Status (AccountsStub::*method)(grpc::ClientContext*, const Request&,
                                                                           Response*),
                                      const Request& request, grpc::ClientContext& context) {
    Response response;
    const grpc::Status status = (stub.*method)(&context, request, &response);
    if (!status.ok()) return runtime::FromGrpc(status);
    return response;
  }

  mutable std::mutex mutex_;
  std::vector<runtime::RefusedSignIn> refused_;
  AccountService service_;
  testing::InProcessServer server_;
  const std::unique_ptr<AccountsStub> admin_, gateway_;
};

class AccountHandlersFixture : public ::testing::Test {
 protected:
  static v1::CreateAccountRequest Creation(const std::string& name,
                                           const std::vector<access::v1::Role>& roles = {access::v1::ROLE_ENGINEER},
                                           const std::string& password = kJanesPassword) {
    v1::CreateAccountRequest request;
    request.set_name(name);
    request.set_password(password);
    for (const access::v1::Role role : roles) request.add_roles(role);
    return request;
  }
  absl::StatusOr<v1::Account> Create(const v1::CreateAccountRequest& request) {
    return handlers_.ByAdmin(&AccountsStub::CreateAccount, request);
  }
  absl::StatusOr<v1::Account> Create(const std::string& name) { return Create(Creation(name)); }
  // One of the methods that ask for an account's name alone.
  template <typename Request>
  absl::StatusOr<v1::Account> Ask(grpc::Status (AccountsStub::*method)(grpc::ClientContext*, const Request&,
                                                                       v1::Account*),
                                  const std::string& name) {
    Request request;
    request.set_name(name);
    return handlers_.ByAdmin(method, request);
  }
  absl::StatusOr<v1::Account> SetRoles(const std::string& name, const std::vector<access::v1::Role>& roles) {
    v1::SetAccountRolesRequest request;
    request.set_name(name);
    for (const access::v1::Role role : roles) request.add_roles(role);
    return handlers_.ByAdmin(&AccountsStub::SetAccountRoles, request);
  }
  static v1::SetPasswordRequest Setting(const std::string& name, const std::string& password) {
    v1::SetPasswordRequest request;
    request.set_name(name);
    request.set_password(password);
    return request;
  }
  absl::StatusOr<v1::Account> SetPassword(const std::string& name, const std::string& password) {
    return handlers_.ByAdmin(&AccountsStub::SetPassword, Setting(name, password));
  }
  absl::Status ChangeOwnPassword(const std::string& token, const std::string& before, const std::string& after) {
    v1::ChangeOwnPasswordRequest request;
    request.set_old_password(before);
    request.set_new_password(after);
    return handlers_.OverGateway(&AccountsStub::ChangeOwnPassword, request, token).status();
  }
  static v1::SignInRequest SigningIn(const std::string& name, const std::string& password,
                                     const std::string& address = "192.0.2.1") {
    v1::SignInRequest request;
    request.set_name(name);
    request.set_password(password);
    request.set_client_address(address);
    return request;
  }
  absl::StatusOr<v1::Session> SignIn(const std::string& name, const std::string& password = kJanesPassword,
                                     const std::string& address = "192.0.2.1") {
    return handlers_.OverGateway(&AccountsStub::SignIn, SigningIn(name, password, address));
  }
  std::string TokenOf(const std::string& name, const std::string& password = kJanesPassword) {
    const auto session = SignIn(name, password);
    EXPECT_TRUE(session.ok()) << session.status();
    return session.ok() ? session->token() : "";
  }
  absl::StatusOr<v1::Session> Renew(const std::string& token) {
    v1::RenewSessionRequest request;
    request.set_token(token);
    return handlers_.OverGateway(&AccountsStub::RenewSession, request);
  }
  absl::Status SignOut(const std::string& token) {
    v1::SignOutRequest request;
    request.set_token(token);
    return handlers_.OverGateway(&AccountsStub::SignOut, request).status();
  }
  // users/jane created by users/it
  std::vector<std::string> Events() const {
    std::vector<std::string> told;
    for (const testing::FakeAccountEvent& one : store_->events())
      told.push_back(one.account + " " + storage::AccountEventText(one.event) + " by " + one.requested_by);
    return told;
  }

  testing::PlantCertificates certificates_;
  const std::shared_ptr<testing::FakeAccounts> store_ = std::make_shared<testing::FakeAccounts>();
  const AccountCredentials credentials_{certificates_};
  AccountHandlers handlers_{store_, credentials_, nullptr};
};

}  // namespace sixpoint::plant
