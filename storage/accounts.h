// Accounts of people (V0017): each as it stands now, and what was done to it as events that stay. Whoever changes one locks it first.
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>
#include <vector>

#include "storage/database.h"

namespace sixpoint::storage {

struct AccountRow {
  std::string name;            // users/jane
  std::string sign_in_method;  // password, oidc
  std::vector<std::string> roles;
  std::string password_phc;            // empty of oidc
  std::string issuer, issuer_subject;  // empty of password
  bool disabled = false;
  Instant created_at, changed_at;  // set by the database
};

enum class AccountEvent { kCreated, kRolesSet, kPasswordSet, kDisabled, kEnabled, kSignedIn, kSignedOut };
std::string AccountEventText(AccountEvent event);  // signed_in, as it is kept

// None: there is no such account.
absl::StatusOr<std::optional<AccountRow>> FindAccount(Transaction& transaction, const std::string& name);
// The same, and nobody else changes it or signs in by it before this transaction's end.
absl::StatusOr<std::optional<AccountRow>> LockAccount(Transaction& transaction, const std::string& name);
// Whoever the provider knows by that subject.
absl::StatusOr<std::optional<AccountRow>> LockAccountOfSubject(Transaction& transaction, const std::string& issuer,
                                                               const std::string& issuer_subject);

struct AccountFilter {
  std::string role;  // one of its roles; empty: any
  bool enabled_only = false;
};
// By name.
absl::StatusOr<std::vector<AccountRow>> ListAccounts(Transaction& transaction, const AccountFilter& filter,
                                                     const std::string& after_name, int limit);

// False, and nothing done, where the name, or issuer and subject, are taken.
absl::StatusOr<bool> InsertAccount(Transaction& transaction, const AccountRow& account);
// Roles, password and disabled, as the row has them.
absl::Status UpdateAccount(Transaction& transaction, const AccountRow& account);
absl::Status AppendAccountEvent(Transaction& transaction, const AccountRow& account, AccountEvent event,
                                const std::string& requested_by);
// Whether the plant knows a person of that name (users/jane), with an account or without: he asked for something, was cleared for
// something, or was offered a certificate.
absl::StatusOr<bool> IsSomebody(Transaction& transaction, const std::string& name);

}  // namespace sixpoint::storage
