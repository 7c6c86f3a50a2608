#include "storage/accounts.h"

#include "storage/each_row.h"

namespace sixpoint::storage {
namespace {

#define ACCOUNT_COLUMNS \
  "name, sign_in_method, roles, password_phc, issuer, issuer_subject, disabled, created_at, changed_at"

constexpr char kFind[] = "SELECT " ACCOUNT_COLUMNS " FROM accounts WHERE name = $1";
constexpr char kLockAccount[] = "SELECT " ACCOUNT_COLUMNS " FROM accounts WHERE name = $1 FOR UPDATE";
constexpr char kLockOfSubject[] =
    "SELECT " ACCOUNT_COLUMNS " FROM accounts WHERE issuer = $1 AND issuer_subject = $2 FOR UPDATE";
constexpr char kListAccounts[] =
    "SELECT " ACCOUNT_COLUMNS
    " FROM accounts WHERE name > $1 AND ($3 = '' OR $3 = ANY (roles)) AND NOT ($4::boolean AND disabled) "
    "ORDER BY name LIMIT $2";
constexpr char kInsertAccount[] =
    "INSERT INTO accounts (name, sign_in_method, roles, password_phc, issuer, issuer_subject) "
    "VALUES ($1, $2, $3, $4, $5, $6) ON CONFLICT DO NOTHING";
constexpr char kUpdate[] =
    "UPDATE accounts SET roles = $2, password_phc = $3, disabled = $4, changed_at = clock_timestamp() WHERE name = $1";
constexpr char kAppendEvent[] =
    "INSERT INTO account_events (event_id, subject, event, roles, requested_by) VALUES ($1, $2, $3, $4, $5)";
constexpr char kKnown[] =
    "SELECT EXISTS (SELECT 1 FROM persons WHERE user_name = substr($1::text, 7)) "
    "OR EXISTS (SELECT 1 FROM credential_offers WHERE identity = $1) "
    "OR EXISTS (SELECT 1 FROM certificate_renewals WHERE identity = $1)";

std::string TextOrEmpty(const Rows& rows, int row, int column) {
  return rows.IsNull(row, column) ? "" : rows.Text(row, column);
}

AccountRow RowOf(const Rows& rows, int row) {
  return {rows.Text(row, 0),         rows.Text(row, 1),         rows.Texts(row, 2),
          TextOrEmpty(rows, row, 3), TextOrEmpty(rows, row, 4), TextOrEmpty(rows, row, 5),
          rows.Bool(row, 6),         rows.Time(row, 7),         rows.Time(row, 8)};
}

absl::StatusOr<std::optional<AccountRow>> One(const absl::StatusOr<Rows>& rows) {
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return std::nullopt;
  AccountRow account = RowOf(*rows, 0);
  return rows->Checked(std::optional(std::move(account)));
}

}  // namespace

std::string AccountEventText(AccountEvent event) {
  switch (event) {
    case AccountEvent::kCreated:
      return "created";
    case AccountEvent::kRolesSet:
      return "roles_set";
    case AccountEvent::kPasswordSet:
      return "password_set";
    case AccountEvent::kDisabled:
      return "disabled";
    case AccountEvent::kEnabled:
      return "enabled";
    case AccountEvent::kSignedIn:
      return "signed_in";
    case AccountEvent::kSignedOut:
      return "signed_out";
  }
  return "";
}

absl::StatusOr<std::optional<AccountRow>> FindAccount(Transaction& transaction, const std::string& name) {
  return One(transaction.Execute(kFind, Params().Text(name)));
}

absl::StatusOr<std::optional<AccountRow>> LockAccount(Transaction& transaction, const std::string& name) {
  return One(transaction.Execute(kLockAccount, Params().Text(name)));
}

absl::StatusOr<std::optional<AccountRow>> LockAccountOfSubject(Transaction& transaction, const std::string& issuer,
                                                               const std::string& issuer_subject) {
  return One(transaction.Execute(kLockOfSubject, Params().Text(issuer).Text(issuer_subject)));
}

absl::StatusOr<std::vector<AccountRow>> ListAccounts(Transaction& transaction, const AccountFilter& filter,
                                                     const std::string& after_name, int limit) {
  const Params params = Params().Text(after_name).Int(limit).Text(filter.role).Bool(filter.enabled_only);
  return AllRows(transaction, kListAccounts, params, RowOf);
}

absl::StatusOr<bool> InsertAccount(Transaction& transaction, const AccountRow& account) {
  Params params;
  params.Text(account.name).Text(account.sign_in_method).Texts(account.roles);
  params.OptionalText(account.password_phc).OptionalText(account.issuer).OptionalText(account.issuer_subject);
  const absl::StatusOr<Rows> inserted = transaction.Execute(kInsertAccount, params);
  if (!inserted.ok()) return inserted.status();
  return inserted->affected() == 1;
}

absl::Status UpdateAccount(Transaction& transaction, const AccountRow& account) {
  Params params;
  params.Text(account.name).Texts(account.roles).OptionalText(account.password_phc).Bool(account.disabled);
  const absl::StatusOr<Rows> updated = transaction.Execute(kUpdate, params);
  if (!updated.ok()) return updated.status();
  return updated->affected() == 1 ? absl::OkStatus() : absl::InternalError("accounts: a row that was there is not");
}

absl::Status AppendAccountEvent(Transaction& transaction, const AccountRow& account, AccountEvent event,
                                const std::string& requested_by) {
  Params params;
  params.Uuid(NewUuid()).Text(account.name).Text(AccountEventText(event)).Texts(account.roles).Text(requested_by);
  return transaction.Execute(kAppendEvent, params).status();
}

absl::StatusOr<bool> IsSomebody(Transaction& transaction, const std::string& name) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kKnown, Params().Text(name));
  if (!rows.ok()) return rows.status();
  return rows->Checked(rows->Bool(0, 0));
}

}  // namespace sixpoint::storage
