// An AccountStore in memory: what handlers are tested on without PostgreSQL. Held to the real one by
// tests/storage/account_store_test.cc.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "storage/account_store.h"
#include "tests/support/fake_commits.h"

namespace sixpoint::testing {

struct FakeAccountEvent {
  std::string account;
  storage::AccountEvent event;
  std::vector<std::string> roles;
  std::string requested_by;
};

class FakeAccounts final : public storage::AccountStore {
 public:
  FakeCommits commits;

  // As where something is recorded of somebody (users/jane) without an account.
  void See(const std::string& name);
  // As if all failed sign-ins were so much older.
  void LetPass(std::chrono::seconds time);
  // As if the account's sessions had been ended by a clock that was so much ahead, and was set back since.
  void EndAhead(const std::string& account, std::chrono::seconds ahead);
  // Every sign-in fails with it from now on once it was judged; what else is asked goes well. OK ends that.
  void FailSignIns(absl::Status failure);
  // Somebody else changes an account so just before the next call that changes it or signs in by its name.
  void ChangeMeanwhile(const std::string& name, std::function<void(storage::AccountRow*)> change);
  // Failed sign-ins of all counters.
  int FailedCount() const;
  std::vector<FakeAccountEvent> events() const;
  // Processor time that a call took at most so far, with what it was told to ask.
  std::chrono::nanoseconds longest_call() const;

  absl::StatusOr<std::optional<storage::AccountRow>> Find(const std::string& name, storage::Deadline) const override;
  absl::StatusOr<std::vector<storage::AccountRow>> List(const storage::AccountFilter& filter,
                                                        const std::string& after_name, int limit,
                                                        storage::Deadline) const override;
  absl::StatusOr<storage::SignInLook> LookAtSignIn(const storage::FailureCounters& counters, const std::string& name,
                                                   storage::Deadline) const override;
  absl::StatusOr<storage::SessionLook> LookAtSession(const std::string& account, storage::Instant since,
                                                     storage::Deadline) const override;
  absl::StatusOr<storage::AccountRow> Create(const storage::AccountRow& account, const std::string& requested_by,
                                             const storage::StillWanted& still_wanted, storage::Deadline) override;
  absl::StatusOr<std::optional<storage::AccountRow>> Change(const std::string& name,
                                                            const storage::AccountChange& change,
                                                            const storage::AccountDeed& deed,
                                                            const storage::StillWanted& still_wanted,
                                                            storage::Deadline) override;
  absl::StatusOr<storage::SignInLook> BeginSignIn(const storage::FailureCounters& counters, const std::string& name,
                                                  const storage::StillWanted& still_wanted, storage::Deadline) override;
  absl::Status SignInWentWell(const storage::CountedSignIn& counted, const storage::StillWanted& still_wanted,
                              storage::Deadline) override;
  absl::Status GiveSignInBack(const storage::CountedSignIn& counted, storage::Deadline) override;
  absl::Status ForgetSignInFailures(storage::Deadline) override;
  absl::Status SignIn(const std::string& account, const storage::SignInOrder& order,
                      const storage::StillWanted& still_wanted, storage::Deadline) override;
  absl::Status SignInOfSubject(const storage::VouchedPerson& person, const storage::SignInOrder& order,
                               const storage::StillWanted& still_wanted, storage::Deadline) override;
  absl::StatusOr<bool> SignOut(const std::string& account, storage::Instant since, storage::Instant over_at,
                               const std::string& requested_by, const storage::StillWanted& still_wanted,
                               storage::Deadline) override;

 private:
  // A call of the store while it lasts: nobody else's runs.
  class InCall {
   public:
    explicit InCall(const FakeAccounts& accounts);
    ~InCall();

   private:
    const FakeAccounts& accounts_;
    const std::unique_lock<std::mutex> lock_;
    const std::chrono::nanoseconds begun_at_;
  };
  struct KeptAccount {
    storage::AccountRow row;
    storage::Instant newest_session_at;  // the epoch: none yet
  };
  struct Counter {
    int failed_count = 0;
    storage::Instant first_failed_at, last_failed_at, blocked_until;
  };
  // All that is kept. A call changes a copy, which counts from its commit on.
  struct Books {
    std::map<std::string, KeptAccount> accounts;           // by name
    std::map<std::string, storage::Instant> ended_before;  // by account
    std::map<std::string, Counter> counters;               // by kind, then account or address
    std::set<std::string> known;                           // users/jane, by whatever was recorded
    std::vector<FakeAccountEvent> events;

    std::optional<storage::AccountRow> Find(const std::string& name) const;
    std::optional<storage::AccountRow> OfSubject(const storage::AccountRow& person) const;
    storage::SessionLook Look(const std::string& account, storage::Instant since) const;
    void Append(const storage::AccountRow& account, storage::AccountEvent event, const std::string& requested_by);
    void Make(const storage::AccountRow& account, const std::string& requested_by);
    void Keep(const storage::AccountRow& account, const storage::AccountDeed& deed);
    void EndSessions(const std::string& account);
    absl::Status Begin(const storage::AccountRow& account, const storage::SignInOrder& order);

    std::optional<storage::Instant> WaitsUntil(const storage::FailureCounters& counters) const;
    storage::SignInStart Count(const storage::FailureCounters& counters);
    void GiveBack(const storage::FailureCounters& counters, storage::Instant counted_at);
    void WentWell(const storage::CountedSignIn& counted);
  };
  void PassMeanwhile();
  absl::Status Commit(Books changed, const storage::StillWanted& still_wanted);

  Books books_;
  absl::Status sign_in_failure_;
  std::function<void()> meanwhile_;  // null: nothing
  mutable std::chrono::nanoseconds longest_call_{0};
};

}  // namespace sixpoint::testing
