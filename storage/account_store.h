// Accounts of people with their sign-ins and sessions, apart from where they are kept. PostgreSQL's and the tests' fake pass the same
// suite (tests/storage/account_store_test.cc). Thread-safe. No call holds a connection after it returned.
//
// A function that a call is given is asked within it, before its commit, while the account is locked: it asks no store and waits for
// nobody, and where it fails its status is the call's, and nothing is done.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "storage/accounts.h"
#include "storage/one_write.h"
#include "storage/session_ends.h"
#include "storage/sign_in_failures.h"

namespace sixpoint::storage {

// How a sign-in stands before it is judged.
struct SignInLook {
  SignInStart start;                  // not counted where it was only looked at
  std::optional<AccountRow> account;  // of the name that was typed; none: there is none
};

// How one session of an account stands.
struct SessionLook {
  std::optional<AccountRow> account;  // none: there is none any more
  bool is_ended = false;              // by a sign-out, or a change of the account
  Instant now;                        // by the clock that sessions are dated by
};

class AccountReader {
 public:
  virtual ~AccountReader() = default;
  // As FindAccount.
  virtual absl::StatusOr<std::optional<AccountRow>> Find(const std::string& name, Deadline deadline) const = 0;
  // As ListAccounts.
  virtual absl::StatusOr<std::vector<AccountRow>> List(const AccountFilter& filter, const std::string& after_name,
                                                       int limit, Deadline deadline) const = 0;
  // Whether a sign-in has to wait. Counts nothing.
  virtual absl::StatusOr<SignInLook> LookAtSignIn(const FailureCounters& counters, const std::string& name,
                                                  Deadline deadline) const = 0;
  // Of a session that began at that moment, once whoever changes the account now has done so.
  virtual absl::StatusOr<SessionLook> LookAtSession(const std::string& account, Instant since,
                                                    Deadline deadline) const = 0;
};

// Of the row as it stands: false where it is so already, and nothing is done.
using AccountChange = std::function<absl::StatusOr<bool>(AccountRow* account)>;

struct AccountDeed {
  AccountEvent event = AccountEvent::kCreated;
  bool ends_sessions = false;  // all of the account
  std::string requested_by;
};

// A try that counts as failed until it went well or is given back.
struct CountedSignIn {
  FailureCounters counters;
  Instant counted_at;
};

// How one goes on who showed what was right.
struct SignInOrder {
  CountedSignIn counted;
  std::string requested_by;
  // Whether it is this account's; of none it refuses.
  std::function<absl::Status(const std::optional<AccountRow>& account)> judge;
  // What is made of the new session.
  std::function<absl::Status(const AccountRow& account, const SessionStart& start)> begun;
};

// Whom an identity provider vouches for.
struct VouchedPerson {
  AccountRow account;      // issuer and subject, and the name and roles that are to be theirs
  bool is_linked = false;  // the plant's people say that the subject is whom they know by that name
};

class AccountStore : public AccountReader {
 public:
  // One with a password. The account of that name: this one, with its event; or the one that was there, and nothing is done.
  virtual absl::StatusOr<AccountRow> Create(const AccountRow& account, const std::string& requested_by,
                                            const StillWanted& still_wanted, Deadline deadline) = 0;
  // Roles, password and disabled, with their event. The account as it stands then; none: there is none.
  virtual absl::StatusOr<std::optional<AccountRow>> Change(const std::string& name, const AccountChange& change,
                                                           const AccountDeed& deed, const StillWanted& still_wanted,
                                                           Deadline deadline) = 0;

  // As storage/sign_in_failures.h: counted before it is judged.
  virtual absl::StatusOr<SignInLook> BeginSignIn(const FailureCounters& counters, const std::string& name,
                                                 const StillWanted& still_wanted, Deadline deadline) = 0;
  virtual absl::Status SignInWentWell(const CountedSignIn& counted, const StillWanted& still_wanted,
                                      Deadline deadline) = 0;
  // Also for who is gone.
  virtual absl::Status GiveSignInBack(const CountedSignIn& counted, Deadline deadline) = 0;
  virtual absl::Status ForgetSignInFailures(Deadline deadline) = 0;

  // All or nothing: judged, gone well, its event, a session's start. `judge` gets none where there is no such account.
  virtual absl::Status SignIn(const std::string& account, const SignInOrder& order, const StillWanted& still_wanted,
                              Deadline deadline) = 0;
  // The same by the account of that issuer and subject, which is made where there is none; its roles are then the person's, and where
  // they were others its older sessions end. `judge` gets none where the name is another one's: of somebody whom the plant knows
  // without an account (IsSomebody) unless it is linked, and of every account.
  virtual absl::Status SignInOfSubject(const VouchedPerson& person, const SignInOrder& order,
                                       const StillWanted& still_wanted, Deadline deadline) = 0;
  // Ends all sessions of the account, with its event, by one that began at `since` and is over at `over_at` at the latest. False, and
  // nothing is done: that one is over or was ended, or the account is not there.
  virtual absl::StatusOr<bool> SignOut(const std::string& account, Instant since, Instant over_at,
                                       const std::string& requested_by, const StillWanted& still_wanted,
                                       Deadline deadline) = 0;
};

// In PostgreSQL; the database lives longer.
std::shared_ptr<AccountStore> AccountsIn(Database* database);

}  // namespace sixpoint::storage
