// `sixpoint accounts`: people who sign in at the gateway, what they may do, and until when.
#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "cli/commands.h"
#include "cli/output.h"
#include "cli/secret_input.h"
#include "cli/table.h"
#include "identity/identity.h"
#include "sixpoint/plant/v1/account.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using plant::v1::Account;
using plant::v1::AccountService;
using AccountStub = AccountService::Stub;

struct AccountsArguments {
  std::string name, password_file;
  std::vector<std::string> roles;
};

std::string RolesText(const Account& account) {
  std::string text;
  for (const int role : account.roles())
    text += (text.empty() ? "" : ", ") + EnumText(access::v1::Role_Name(static_cast<access::v1::Role>(role)), "ROLE_");
  return text;
}

std::string SignInMethodText(const Account& account) {
  return EnumText(plant::v1::SignInMethod_Name(account.sign_in_method()), "SIGN_IN_METHOD_");
}

std::string AccountText(const Account& account) {
  return "who        " + account.name() + "\nroles      " + RolesText(account) + "\nsigns in   " +
         (account.disabled() ? "not: disabled" : "by " + SignInMethodText(account)) + "\nmade       " +
         TimeText(account.created_at()) + "\nchanged    " + TimeText(account.changed_at()) + "\n";
}

// The contract's role of that word. That identity knows one which the contract lacks is our own fault, and grants nothing.
absl::StatusOr<access::v1::Role> ContractRoleOf(const std::string& word) {
  const google::protobuf::EnumDescriptor& roles = *access::v1::Role_descriptor();
  const std::vector<std::string> words = WordsOf(roles);
  if (std::find(words.begin(), words.end(), word) == words.end())
    return absl::InternalError("--role: " + word + ", which is no role of the contract (sixpoint/access/v1)");
  return static_cast<access::v1::Role>(ValueOf(roles, word));
}

// As the contract has them; what a user's roles are the plant says.
template <typename Request>
absl::Status SetRoles(const std::vector<std::string>& words, Request* request) {
  for (const std::string& word : words) {
    const absl::StatusOr<identity::Role> known = identity::RoleOf("--role", word);
    if (!known.ok()) return known.status();
    const absl::StatusOr<access::v1::Role> role = ContractRoleOf(identity::RoleText(*known));
    if (!role.ok()) return role.status();
    request->add_roles(*role);
  }
  return absl::OkStatus();
}

template <typename Request>
absl::Status Change(Session* session,
                    grpc::Status (AccountStub::*method)(grpc::ClientContext*, const Request&, Account*),
                    Request request, const AccountsArguments& arguments) {
  request.set_name(NameText("users", arguments.name));
  return CallAndPrint<AccountService>(session, "plant", method, request, AccountText).status();
}

absl::Status Create(Session* session, const AccountsArguments& arguments) {
  plant::v1::CreateAccountRequest request;
  if (absl::Status status = SetRoles(arguments.roles, &request); !status.ok()) return status;
  const absl::StatusOr<std::string> password =
      ReadSecret("password of " + NameText("users", arguments.name), arguments.password_file, /*twice=*/true);
  if (!password.ok()) return password.status();
  request.set_password(*password);
  return Change(session, &AccountStub::CreateAccount, std::move(request), arguments);
}

absl::Status ShowAccount(Session* session, const AccountsArguments& arguments) {
  return Change(session, &AccountStub::GetAccount, plant::v1::GetAccountRequest(), arguments);
}

absl::Status Roles(Session* session, const AccountsArguments& arguments) {
  plant::v1::SetAccountRolesRequest request;
  if (absl::Status status = SetRoles(arguments.roles, &request); !status.ok()) return status;
  return Change(session, &AccountStub::SetAccountRoles, std::move(request), arguments);
}

absl::Status Password(Session* session, const AccountsArguments& arguments) {
  plant::v1::SetPasswordRequest request;
  const absl::StatusOr<std::string> password =
      ReadSecret("new password of " + NameText("users", arguments.name), arguments.password_file, /*twice=*/true);
  if (!password.ok()) return password.status();
  request.set_password(*password);
  return Change(session, &AccountStub::SetPassword, std::move(request), arguments);
}

absl::Status Disable(Session* session, const AccountsArguments& arguments) {
  return Change(session, &AccountStub::DisableAccount, plant::v1::DisableAccountRequest(), arguments);
}

absl::Status Enable(Session* session, const AccountsArguments& arguments) {
  return Change(session, &AccountStub::EnableAccount, plant::v1::EnableAccountRequest(), arguments);
}

}  // namespace

void AddAccountsCommands(Command* app, Session* session) {
  Command* accounts = app->AddCommand("accounts", "People who sign in at the gateway, and what they may do");
  accounts->RequireCommand();
  const auto arguments = std::make_shared<AccountsArguments>();
  const auto add = [&](const char* name, const char* help, absl::Status (*action)(Session*, const AccountsArguments&)) {
    Command* const command = accounts->AddCommand(name, help);
    session->OnCommand(command, [session, arguments, action] { return action(session, *arguments); });
    command->AddOption("NAME", &arguments->name, "users/NAME, or NAME alone")->Required();
    return command;
  };
  Command* create = add("create", "An account with a password, which is asked for at the terminal", Create);
  AddListCommand<AccountService>(accounts, session, "Who may sign in", "plant", &AccountStub::ListAccounts,
                                 plant::v1::ListAccountsRequest(), Table({"who", "roles", "signs in", "changed"}),
                                 &plant::v1::ListAccountsResponse::accounts, [](const Account& account) {
                                   return Cells{account.name(), RolesText(account),
                                                account.disabled() ? "disabled" : "by " + SignInMethodText(account),
                                                TimeText(account.changed_at())};
                                 });
  add("show", "One account", ShowAccount);
  Command* roles = add("roles", "Its roles from now on; its sessions end", Roles);
  Command* password = add("password", "Another password; its sessions end", Password);
  add("disable", "Nobody signs in by it any more; its sessions end", Disable);
  add("enable", "The opposite", Enable);
  for (Command* command : {create, roles})
    command->AddOption("--role", &arguments->roles, "engineer, quality, mes-reader or admin; repeatable")
        ->Repeat()
        ->Required();
  for (Command* command : {create, password})
    command->AddOption("--password-file", &arguments->password_file,
                       "A file whose first line it is, - for standard input, fd:N for an open descriptor; without it "
                       "the terminal asks");
}

}  // namespace sixpoint::cli
