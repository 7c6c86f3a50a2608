// Accounts of people, and their sign-in for the gateway.
#pragma once

#include <grpcpp/grpcpp.h>

#include <memory>
#include <string>
#include <utility>

#include "services/plant/session_desk.h"
#include "sixpoint/plant/v1/account.grpc.pb.h"
#include "storage/account_store.h"

namespace sixpoint::plant {

// Thread-safe.
class AccountService final : public v1::AccountService::Service {
 public:
  AccountService(std::shared_ptr<storage::AccountStore> accounts, SessionDeskOptions options)
      : accounts_(std::move(accounts)), desk_(accounts_, std::move(options)) {}

  grpc::Status CreateAccount(grpc::ServerContext* context, const v1::CreateAccountRequest* request,
                             v1::Account* response) override;
  grpc::Status SetAccountRoles(grpc::ServerContext* context, const v1::SetAccountRolesRequest* request,
                               v1::Account* response) override;
  grpc::Status SetPassword(grpc::ServerContext* context, const v1::SetPasswordRequest* request,
                           v1::Account* response) override;
  grpc::Status ChangeOwnPassword(grpc::ServerContext* context, const v1::ChangeOwnPasswordRequest* request,
                                 v1::ChangeOwnPasswordResponse* response) override;
  grpc::Status DisableAccount(grpc::ServerContext* context, const v1::DisableAccountRequest* request,
                              v1::Account* response) override;
  grpc::Status EnableAccount(grpc::ServerContext* context, const v1::EnableAccountRequest* request,
                             v1::Account* response) override;
  grpc::Status GetAccount(grpc::ServerContext* context, const v1::GetAccountRequest* request,
                          v1::Account* response) override;
  grpc::Status ListAccounts(grpc::ServerContext* context, const v1::ListAccountsRequest* request,
                            v1::ListAccountsResponse* response) override;
  grpc::Status SignIn(grpc::ServerContext* context, const v1::SignInRequest* request, v1::Session* response) override;
  grpc::Status SignInWithIdToken(grpc::ServerContext* context, const v1::SignInWithIdTokenRequest* request,
                                 v1::Session* response) override;
  grpc::Status RenewSession(grpc::ServerContext* context, const v1::RenewSessionRequest* request,
                            v1::Session* response) override;
  grpc::Status SignOut(grpc::ServerContext* context, const v1::SignOutRequest* request,
                       v1::SignOutResponse* response) override;

 private:
  absl::StatusOr<v1::Account> Changed(const grpc::ServerContext& context, const std::string& name,
                                      storage::AccountEvent event, bool ends_sessions,
                                      const storage::AccountChange& change);

  const std::shared_ptr<storage::AccountStore> accounts_;
  SessionDesk desk_;
};

}  // namespace sixpoint::plant
