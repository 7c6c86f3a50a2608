#include "services/plant/account_service.h"

#include <optional>
#include <vector>

#include "identity/password.h"
#include "services/plant/still_wanted.h"
#include "services/runtime/call.h"
#include "services/runtime/caller_identity.h"
#include "services/runtime/errors.h"
#include "services/runtime/log.h"
#include "services/runtime/pages.h"
#include "services/runtime/stored_enum.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::plant {
namespace {

using identity::Role;
using runtime::Failure;
using runtime::ToGrpc;
using storage::AccountEvent;
using storage::AccountRow;

constexpr std::string_view kUsers = "users/";

absl::Status CheckName(const std::string& name) {
  if (identity::IsUser(name)) return absl::OkStatus();
  return runtime::Refuse("name", name, "users/ and 1 to 64 of A-Z, a-z, 0-9, '.', '_', '-', the first not '.'");
}

absl::StatusOr<Role> UsersRoleOf(const char* field, int number) {
  for (const Role role : {Role::kEngineer, Role::kQuality, Role::kMesReader, Role::kAdmin})
    if (RoleToProto(role) == number) return role;
  return runtime::Refuse(field, std::to_string(number), "ROLE_ENGINEER, ROLE_QUALITY, ROLE_MES_READER or ROLE_ADMIN");
}

absl::StatusOr<std::vector<std::string>> RolesOf(const google::protobuf::RepeatedField<int>& wanted) {
  std::vector<Role> roles;
  for (const int number : wanted) {
    const absl::StatusOr<Role> role = UsersRoleOf("roles", number);
    if (!role.ok()) return role.status();
    roles.push_back(*role);
  }
  const auto person = identity::IdentityOf("users/any", roles);  // at least one, each once, in their order
  if (!person.ok()) return person.status();
  return WordsOf(person->roles);
}

absl::StatusOr<v1::Account> AccountOf(const AccountRow& row) {
  const absl::StatusOr<std::vector<Role>> roles = RolesOfWords(row.roles);
  if (!roles.ok()) return roles.status();
  v1::Account account;
  account.set_name(row.name);
  for (const Role role : *roles) account.add_roles(RoleToProto(role));
  runtime::StoredWords words(row.name);
  account.set_sign_in_method(words.Value<v1::SignInMethod>(row.sign_in_method));
  account.set_disabled(row.disabled);
  runtime::ToProto(row.created_at, account.mutable_created_at());
  runtime::ToProto(row.changed_at, account.mutable_changed_at());
  return words.Checked(std::move(account));
}

absl::Status NotFound(const std::string& name) {
  return Failure(errors::v1::ACCOUNT_NOT_FOUND, "account: " + name + " is not known", {{"resource", name}});
}

// Of a person whom the identity provider vouches for it says the roles, and it keeps the password.
absl::Status CheckHasPassword(const AccountRow& account, const std::string& field) {
  if (!account.password_phc.empty()) return absl::OkStatus();
  return runtime::Refuse(field, account.name + " (signs in by the identity provider)", "an account with a password");
}

}  // namespace

absl::StatusOr<v1::Account> AccountService::Changed(const grpc::ServerContext& context, const std::string& name,
                                                    AccountEvent event, bool ends_sessions,
                                                    const storage::AccountChange& change) {
  if (absl::Status status = CheckName(name); !status.ok()) return status;
  // What cannot be told is not changed either.
  const auto told = [&](AccountRow* row) -> absl::StatusOr<bool> {
    if (absl::Status known = AccountOf(*row).status(); !known.ok()) return known;
    return change(row);
  };
  const absl::StatusOr<std::optional<AccountRow>> account =
      accounts_->Change(name, told, {event, ends_sessions, runtime::RequestedBy(context)}, StillWantedBy(context),
                        runtime::DeadlineOf(context));
  if (!account.ok()) return account.status();
  return account->has_value() ? AccountOf(**account) : NotFound(name);
}

grpc::Status AccountService::CreateAccount(grpc::ServerContext* context, const v1::CreateAccountRequest* request,
                                           v1::Account* response) {
  const absl::StatusOr<std::vector<std::string>> roles = RolesOf(request->roles());
  const absl::Status valid = runtime::Refusals()
                                 .Add(CheckName(request->name()))
                                 .Add(roles.status())
                                 .Add(identity::CheckNewPassword("password", request->password()))
                                 .status();
  if (!valid.ok()) return ToGrpc(valid);
  const absl::StatusOr<std::string> phc = desk_.Hash(*context, request->password());
  if (!phc.ok()) return ToGrpc(phc.status());
  AccountRow made;
  made.name = request->name();
  made.sign_in_method = "password";
  made.roles = *roles;
  made.password_phc = *phc;
  const absl::StatusOr<AccountRow> account =
      accounts_->Create(made, runtime::RequestedBy(*context), StillWantedBy(*context), runtime::DeadlineOf(*context));
  if (!account.ok()) return ToGrpc(account.status());
  // Another one's hash: it was there. A call that is repeated finds its own.
  if (account->password_phc != made.password_phc) {
    const bool is_alike = account->sign_in_method == made.sign_in_method && account->roles == made.roles;
    const absl::StatusOr<bool> same =
        is_alike ? desk_.Matches(*context, account->password_phc, request->password()) : false;
    if (!same.ok()) return ToGrpc(same.status());
    if (!*same)
      return ToGrpc(Failure(errors::v1::ACCOUNT_EXISTS,
                            "account: " + made.name + " is there with other roles or another password",
                            {{"resource", made.name}}));
  }
  return runtime::Answer(AccountOf(*account), response);
}

grpc::Status AccountService::SetAccountRoles(grpc::ServerContext* context, const v1::SetAccountRolesRequest* request,
                                             v1::Account* response) {
  const absl::StatusOr<std::vector<std::string>> roles = RolesOf(request->roles());
  if (!roles.ok()) return ToGrpc(roles.status());
  const auto change = [&](AccountRow* account) -> absl::StatusOr<bool> {
    if (absl::Status status = CheckHasPassword(*account, "name"); !status.ok()) return status;
    if (account->roles == *roles) return false;
    account->roles = *roles;
    return true;
  };
  return runtime::Answer(Changed(*context, request->name(), AccountEvent::kRolesSet, true, change), response);
}

grpc::Status AccountService::SetPassword(grpc::ServerContext* context, const v1::SetPasswordRequest* request,
                                         v1::Account* response) {
  if (absl::Status status = identity::CheckNewPassword("password", request->password()); !status.ok())
    return ToGrpc(status);
  // Who only found an open browser does not make himself its owner.
  const auto caller = runtime::CallingIdentity(*context);
  if (runtime::SessionOf(*context) && caller->Text() == request->name())
    return ToGrpc(Failure(errors::v1::ROLE_MISSING,
                          "SetPassword: " + request->name() + " is the caller's own, want ChangeOwnPassword",
                          {{"resource", request->name()}}));
  const absl::StatusOr<std::string> phc = desk_.Hash(*context, request->password());
  if (!phc.ok()) return ToGrpc(phc.status());
  const auto change = [&](AccountRow* account) -> absl::StatusOr<bool> {
    if (absl::Status status = CheckHasPassword(*account, "name"); !status.ok()) return status;
    account->password_phc = *phc;
    return true;
  };
  return runtime::Answer(Changed(*context, request->name(), AccountEvent::kPasswordSet, true, change), response);
}

grpc::Status AccountService::ChangeOwnPassword(grpc::ServerContext* context,
                                               const v1::ChangeOwnPasswordRequest* request,
                                               v1::ChangeOwnPasswordResponse*) {
  if (absl::Status status = identity::CheckNewPassword("new_password", request->new_password()); !status.ok())
    return ToGrpc(status);
  const std::optional<identity::Session> session = runtime::SessionOf(*context);
  if (!session || session->signed_in_by != identity::SignedInBy::kPassword)
    return ToGrpc(
        Failure(errors::v1::ROLE_MISSING, "ChangeOwnPassword: " + runtime::RequestedBy(*context) +
                                              ", want a person who signed in with a password over the gateway"));
  const std::string name = session->person.Text();
  const absl::StatusOr<AccountRow> before = desk_.CheckOwnPassword(*context, name, request->old_password());
  if (!before.ok()) return ToGrpc(before.status());
  const absl::StatusOr<std::string> phc = desk_.Hash(*context, request->new_password());
  if (!phc.ok()) return ToGrpc(phc.status());
  const auto change = [&](AccountRow* account) -> absl::StatusOr<bool> {
    if (account->password_phc != before->password_phc)
      return absl::AbortedError("account: changed meanwhile, want the call once more");
    account->password_phc = *phc;
    return true;
  };
  return ToGrpc(Changed(*context, name, AccountEvent::kPasswordSet, true, change).status());
}

grpc::Status AccountService::DisableAccount(grpc::ServerContext* context, const v1::DisableAccountRequest* request,
                                            v1::Account* response) {
  const auto change = [](AccountRow* account) -> absl::StatusOr<bool> {
    return !std::exchange(account->disabled, true);
  };
  return runtime::Answer(Changed(*context, request->name(), AccountEvent::kDisabled, true, change), response);
}

grpc::Status AccountService::EnableAccount(grpc::ServerContext* context, const v1::EnableAccountRequest* request,
                                           v1::Account* response) {
  const auto change = [](AccountRow* account) -> absl::StatusOr<bool> {
    return std::exchange(account->disabled, false);
  };
  return runtime::Answer(Changed(*context, request->name(), AccountEvent::kEnabled, false, change), response);
}

grpc::Status AccountService::GetAccount(grpc::ServerContext* context, const v1::GetAccountRequest* request,
                                        v1::Account* response) {
  if (absl::Status status = CheckName(request->name()); !status.ok()) return ToGrpc(status);
  const absl::StatusOr<std::optional<AccountRow>> account =
      accounts_->Find(request->name(), runtime::DeadlineOf(*context));
  if (!account.ok()) return ToGrpc(account.status());
  return account->has_value() ? runtime::Answer(AccountOf(**account), response) : ToGrpc(NotFound(request->name()));
}

grpc::Status AccountService::ListAccounts(grpc::ServerContext* context, const v1::ListAccountsRequest* request,
                                          v1::ListAccountsResponse* response) {
  const std::string filters = runtime::FiltersOf(*request);
  const absl::StatusOr<runtime::IdPage> page = runtime::IdPageOf(filters, request->page_size(), request->page_token());
  if (!page.ok()) return ToGrpc(page.status());
  storage::AccountFilter filter;
  filter.enabled_only = request->enabled_only();
  if (request->role() != access::v1::ROLE_UNSPECIFIED) {
    const absl::StatusOr<Role> role = UsersRoleOf("role", request->role());
    if (!role.ok()) return ToGrpc(role.status());
    filter.role = identity::RoleText(*role);
  }
  const absl::StatusOr<std::vector<AccountRow>> rows =
      accounts_->List(filter, std::string(kUsers) + page->after_id, page->size + 1, runtime::DeadlineOf(*context));
  if (!rows.ok()) return ToGrpc(rows.status());
  const absl::StatusOr<const AccountRow*> last =
      runtime::AddPage(*rows, page->size, AccountOf, response->mutable_accounts());
  if (!last.ok()) return ToGrpc(last.status());
  if (*last != nullptr)
    response->set_next_page_token(runtime::TokenAfterId(filters, (*last)->name.substr(kUsers.size())));
  return grpc::Status::OK;
}

grpc::Status AccountService::SignIn(grpc::ServerContext* context, const v1::SignInRequest* request,
                                    v1::Session* response) {
  return runtime::Answer(desk_.SignIn(*context, *request), response);
}

grpc::Status AccountService::SignInWithIdToken(grpc::ServerContext* context,
                                               const v1::SignInWithIdTokenRequest* request, v1::Session* response) {
  return runtime::Answer(desk_.SignInWithIdToken(*context, *request), response);
}

grpc::Status AccountService::RenewSession(grpc::ServerContext* context, const v1::RenewSessionRequest* request,
                                          v1::Session* response) {
  return runtime::Answer(desk_.Renew(*context, request->token()), response);
}

grpc::Status AccountService::SignOut(grpc::ServerContext* context, const v1::SignOutRequest* request,
                                     v1::SignOutResponse*) {
  return ToGrpc(desk_.SignOut(*context, request->token()));
}

}  // namespace sixpoint::plant
