#include "storage/account_store.h"

#include <utility>

#include "storage/one_read.h"

namespace sixpoint::storage {
namespace {

// As InsertAccount, with its event.
absl::Status MakeAccount(Transaction& t, const AccountRow& account, const std::string& requested_by) {
  const absl::StatusOr<bool> inserted = InsertAccount(t, account);
  if (!inserted.ok()) return inserted.status();
  return *inserted ? AppendAccountEvent(t, account, AccountEvent::kCreated, requested_by) : absl::OkStatus();
}

absl::Status KeepChange(Transaction& t, const AccountRow& account, const AccountDeed& deed) {
  absl::Status done = UpdateAccount(t, account);
  if (done.ok()) done = AppendAccountEvent(t, account, deed.event, deed.requested_by);
  if (done.ok() && deed.ends_sessions) done = EndSessions(t, account.name);
  return done;
}

absl::StatusOr<AccountRow> Made(Transaction& t, const AccountRow& account, const std::string& requested_by) {
  if (absl::Status made = MakeAccount(t, account, requested_by); !made.ok()) return made;
  absl::StatusOr<std::optional<AccountRow>> found = FindAccount(t, account.name);
  if (!found.ok()) return found.status();
  if (!found->has_value()) return absl::InternalError("account: made and not there");
  return **std::move(found);
}

absl::StatusOr<std::optional<AccountRow>> Changed(Transaction& t, const std::string& name, const AccountChange& change,
                                                  const AccountDeed& deed) {
  absl::StatusOr<std::optional<AccountRow>> account = LockAccount(t, name);
  if (!account.ok() || !account->has_value()) return account;
  const absl::StatusOr<bool> changed = change(&**account);
  if (!changed.ok()) return changed.status();
  if (!*changed) return account;
  if (absl::Status kept = KeepChange(t, **account, deed); !kept.ok()) return kept;
  return FindAccount(t, name);
}

absl::StatusOr<SignInLook> LookAt(Transaction& t, const FailureCounters& counters, const std::string& name) {
  SignInLook look;
  const auto until = SignInsWaitUntil(t, counters);
  if (!until.ok()) return until.status();
  look.start.waits_until = *until;
  absl::StatusOr<std::optional<AccountRow>> account = FindAccount(t, name);
  if (!account.ok()) return account.status();
  look.account = *std::move(account);
  return look;
}

absl::StatusOr<SignInLook> BegunOn(Transaction& t, const FailureCounters& counters, const std::string& name) {
  const absl::StatusOr<SignInStart> start = storage::BeginSignIn(t, counters);
  if (!start.ok()) return start.status();
  absl::StatusOr<std::optional<AccountRow>> account = FindAccount(t, name);
  if (!account.ok()) return account.status();
  return SignInLook{*start, *std::move(account)};
}

absl::StatusOr<SessionLook> LookAt(Transaction& t, const std::string& name, Instant since) {
  absl::StatusOr<std::optional<AccountRow>> account = LockAccount(t, name);
  if (!account.ok()) return account.status();
  const absl::StatusOr<std::optional<Instant>> ended = SessionsEndedBefore(t, name);
  if (!ended.ok()) return ended.status();
  const absl::StatusOr<Instant> now = NowOf(t);
  if (!now.ok()) return now.status();
  return SessionLook{*std::move(account), ended->has_value() && since <= **ended, *now};
}

absl::StatusOr<AccountRow> JudgedBy(const SignInOrder& order, std::optional<AccountRow> account) {
  if (absl::Status judged = order.judge(account); !judged.ok()) return judged;
  if (!account) return absl::InternalError("accounts: nobody was let in");
  return *std::move(account);
}

absl::Status BegunBy(Transaction& t, const AccountRow& account, const SignInOrder& order) {
  absl::Status done = storage::SignInWentWell(t, order.counted.counters, order.counted.counted_at);
  if (done.ok()) done = AppendAccountEvent(t, account, AccountEvent::kSignedIn, order.requested_by);
  if (!done.ok()) return done;
  const absl::StatusOr<SessionStart> start = BeginSession(t, account.name);
  return start.ok() ? order.begun(account, *start) : start.status();
}

absl::Status SignedIn(Transaction& t, const std::string& name, const SignInOrder& order) {
  absl::StatusOr<std::optional<AccountRow>> found = LockAccount(t, name);
  if (!found.ok()) return found.status();
  const absl::StatusOr<AccountRow> account = JudgedBy(order, *std::move(found));
  return account.ok() ? BegunBy(t, *account, order) : account.status();
}

// Locked. None: the name is another one's.
absl::StatusOr<std::optional<AccountRow>> FoundOrMade(Transaction& t, const VouchedPerson& person,
                                                      const std::string& requested_by) {
  const AccountRow& made = person.account;
  // Asked before the account is: where his own first sign-in at the same moment makes him known, it has made the account, too.
  const absl::StatusOr<bool> is_somebody = IsSomebody(t, made.name);
  if (!is_somebody.ok()) return is_somebody.status();
  absl::StatusOr<std::optional<AccountRow>> found = LockAccountOfSubject(t, made.issuer, made.issuer_subject);
  if (!found.ok() || found->has_value()) return found;
  if (*is_somebody && !person.is_linked) return std::nullopt;
  if (absl::Status inserted = MakeAccount(t, made, requested_by); !inserted.ok()) return inserted;
  return LockAccountOfSubject(t, made.issuer, made.issuer_subject);  // another one's sign-in may have been first
}

absl::Status SignedInBySubject(Transaction& t, const VouchedPerson& person, const SignInOrder& order) {
  absl::StatusOr<std::optional<AccountRow>> found = FoundOrMade(t, person, order.requested_by);
  if (!found.ok()) return found.status();
  absl::StatusOr<AccountRow> account = JudgedBy(order, *std::move(found));
  if (!account.ok()) return account.status();
  if (account->roles != person.account.roles) {
    account->roles = person.account.roles;
    const AccountDeed deed{AccountEvent::kRolesSet, true, order.requested_by};
    if (absl::Status kept = KeepChange(t, *account, deed); !kept.ok()) return kept;
  }
  return BegunBy(t, *account, order);
}

absl::StatusOr<bool> SignedOut(Transaction& t, const std::string& name, Instant since, Instant over_at,
                               const std::string& requested_by) {
  const absl::StatusOr<SessionLook> look = LookAt(t, name, since);
  if (!look.ok()) return look.status();
  if (!look->account || look->is_ended || over_at <= look->now) return false;
  absl::Status done = EndSessions(t, name);
  if (done.ok()) done = AppendAccountEvent(t, *look->account, AccountEvent::kSignedOut, requested_by);
  if (!done.ok()) return done;
  return true;
}

class PostgresAccounts final : public AccountStore {
 public:
  explicit PostgresAccounts(Database* database) : database_(database) {}

  absl::StatusOr<std::optional<AccountRow>> Find(const std::string& name, Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) { return FindAccount(t, name); });
  }
  absl::StatusOr<std::vector<AccountRow>> List(const AccountFilter& filter, const std::string& after_name, int limit,
                                               Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) { return ListAccounts(t, filter, after_name, limit); });
  }
  absl::StatusOr<SignInLook> LookAtSignIn(const FailureCounters& counters, const std::string& name,
                                          Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) { return LookAt(t, counters, name); });
  }
  absl::StatusOr<SessionLook> LookAtSession(const std::string& account, Instant since,
                                            Deadline deadline) const override {
    return OneRead(*database_, deadline, [&](Transaction& t) { return LookAt(t, account, since); });
  }

  absl::StatusOr<AccountRow> Create(const AccountRow& account, const std::string& requested_by,
                                    const StillWanted& still_wanted, Deadline deadline) override {
    return OneWrite(*database_, deadline, still_wanted, [&](Transaction& t) { return Made(t, account, requested_by); });
  }
  absl::StatusOr<std::optional<AccountRow>> Change(const std::string& name, const AccountChange& change,
                                                   const AccountDeed& deed, const StillWanted& still_wanted,
                                                   Deadline deadline) override {
    return OneWrite(*database_, deadline, still_wanted, [&](Transaction& t) { return Changed(t, name, change, deed); });
  }
  absl::StatusOr<SignInLook> BeginSignIn(const FailureCounters& counters, const std::string& name,
                                         const StillWanted& still_wanted, Deadline deadline) override {
    return OneWrite(*database_, deadline, still_wanted, [&](Transaction& t) { return BegunOn(t, counters, name); });
  }
  absl::Status SignInWentWell(const CountedSignIn& counted, const StillWanted& still_wanted,
                              Deadline deadline) override {
    return OneWrite(*database_, deadline, still_wanted,
                    [&](Transaction& t) { return storage::SignInWentWell(t, counted.counters, counted.counted_at); });
  }
  absl::Status GiveSignInBack(const CountedSignIn& counted, Deadline deadline) override {
    return OneWrite(*database_, deadline,
                    [&](Transaction& t) { return storage::GiveSignInBack(t, counted.counters, counted.counted_at); });
  }
  absl::Status ForgetSignInFailures(Deadline deadline) override {
    return OneWrite(*database_, deadline, storage::ForgetSignInFailures);
  }
  absl::Status SignIn(const std::string& account, const SignInOrder& order, const StillWanted& still_wanted,
                      Deadline deadline) override {
    return OneWrite(*database_, deadline, still_wanted, [&](Transaction& t) { return SignedIn(t, account, order); });
  }
  absl::Status SignInOfSubject(const VouchedPerson& person, const SignInOrder& order, const StillWanted& still_wanted,
                               Deadline deadline) override {
    return OneWrite(*database_, deadline, still_wanted,
                    [&](Transaction& t) { return SignedInBySubject(t, person, order); });
  }
  absl::StatusOr<bool> SignOut(const std::string& account, Instant since, Instant over_at,
                               const std::string& requested_by, const StillWanted& still_wanted,
                               Deadline deadline) override {
    return OneWrite(*database_, deadline, still_wanted,
                    [&](Transaction& t) { return SignedOut(t, account, since, over_at, requested_by); });
  }

 private:
  Database* const database_;
};

}  // namespace

std::shared_ptr<AccountStore> AccountsIn(Database* database) { return std::make_shared<PostgresAccounts>(database); }

}  // namespace sixpoint::storage
