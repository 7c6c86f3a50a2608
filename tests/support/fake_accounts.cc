#include "tests/support/fake_accounts.h"

#include <algorithm>
#include <atomic>
#include <iterator>
#include <utility>

#include "tests/support/processor_time.h"

namespace sixpoint::testing {
namespace {

using std::chrono::minutes;
using std::chrono::seconds;
using storage::AccountRow;
using storage::Instant;

constexpr seconds kFirstWait{30};
constexpr minutes kLongestWait{15}, kQuiet{15}, kForgottenAfter{60};
constexpr int kMostDoublings = 10;

// No moment is told twice: two tries of one microsecond could not be told apart.
Instant AccountsClock() {
  static std::atomic<Instant> newest{Instant()};
  const Instant now = std::chrono::floor<std::chrono::microseconds>(std::chrono::system_clock::now());
  Instant before = newest, next;
  do {
    next = std::max<Instant>(now, before + std::chrono::microseconds(1));
  } while (!newest.compare_exchange_weak(before, next));
  return next;
}

// By kind, for no account is an address.
std::map<std::string, int> FreeCounts(const storage::FailureCounters& counters) {
  std::map<std::string, int> free_counts;
  if (counters.account) free_counts["account " + counters.account->of] = counters.account->free_count;
  if (counters.address) free_counts["address " + counters.address->of] = counters.address->free_count;
  return free_counts;
}

// Each failure after those that are free waits twice as long.
std::chrono::nanoseconds WaitAfter(int failed_count, int free_count) {
  if (failed_count < free_count) return std::chrono::nanoseconds(0);
  return std::min<std::chrono::nanoseconds>(kLongestWait,
                                            kFirstWait * (1 << std::min(failed_count - free_count, kMostDoublings)));
}

absl::StatusOr<AccountRow> LetIn(const storage::SignInOrder& order, const std::optional<AccountRow>& account) {
  if (absl::Status judged = order.judge(account); !judged.ok()) return judged;
  if (!account) return absl::InternalError("accounts: nobody was let in");
  return *account;
}

}  // namespace

FakeAccounts::InCall::InCall(const FakeAccounts& accounts)
    : accounts_(accounts), lock_(accounts.commits.Lock()), begun_at_(ProcessorTime()) {}

FakeAccounts::InCall::~InCall() {
  accounts_.longest_call_ = std::max(accounts_.longest_call_, ProcessorTime() - begun_at_);
}

std::optional<AccountRow> FakeAccounts::Books::Find(const std::string& name) const {
  const auto found = accounts.find(name);
  return found == accounts.end() ? std::nullopt : std::optional(found->second.row);
}

std::optional<AccountRow> FakeAccounts::Books::OfSubject(const AccountRow& person) const {
  for (const auto& [name, kept] : accounts)
    if (kept.row.issuer == person.issuer && kept.row.issuer_subject == person.issuer_subject) return kept.row;
  return std::nullopt;
}

storage::SessionLook FakeAccounts::Books::Look(const std::string& account, Instant since) const {
  const auto ended = ended_before.find(account);
  return {Find(account), ended != ended_before.end() && since <= ended->second, AccountsClock()};
}

// Who is named in an event is known from then on.
void FakeAccounts::Books::Append(const AccountRow& account, storage::AccountEvent event,
                                 const std::string& requested_by) {
  for (const std::string& named : {account.name, requested_by})
    if (named.rfind("users/", 0) == 0) known.insert(named.substr(0, named.find(' ')));
  events.push_back({account.name, event, account.roles, requested_by});
}

void FakeAccounts::Books::Make(const AccountRow& account, const std::string& requested_by) {
  if (Find(account.name) || (!account.issuer.empty() && OfSubject(account))) return;
  KeptAccount& made = accounts[account.name];
  made.row = account;
  made.row.disabled = false;
  made.row.created_at = made.row.changed_at = AccountsClock();
  Append(account, storage::AccountEvent::kCreated, requested_by);
}

void FakeAccounts::Books::Keep(const AccountRow& account, const storage::AccountDeed& deed) {
  AccountRow& row = accounts.at(account.name).row;
  row.roles = account.roles;
  row.password_phc = account.password_phc;
  row.disabled = account.disabled;
  row.changed_at = AccountsClock();
  Append(row, deed.event, deed.requested_by);
  if (deed.ends_sessions) EndSessions(account.name);
}

void FakeAccounts::Books::EndSessions(const std::string& account) {
  Instant& ended = ended_before[account];
  ended = std::max({ended, AccountsClock(), accounts.at(account).newest_session_at});
}

absl::Status FakeAccounts::Books::Begin(const AccountRow& account, const storage::SignInOrder& order) {
  WentWell(order.counted);
  Append(account, storage::AccountEvent::kSignedIn, order.requested_by);
  storage::SessionStart start;
  start.since = start.now = AccountsClock();
  if (const auto ended = ended_before.find(account.name); ended != ended_before.end())
    start.since = std::max<Instant>(start.now, ended->second + std::chrono::microseconds(1));
  Instant& newest = accounts.at(account.name).newest_session_at;
  newest = std::max(newest, start.since);
  return order.begun(account, start);
}

std::optional<Instant> FakeAccounts::Books::WaitsUntil(const storage::FailureCounters& of) const {
  std::optional<Instant> until;
  for (const auto& [key, free_count] : FreeCounts(of)) {
    const auto counter = counters.find(key);
    if (counter == counters.end() || counter->second.blocked_until <= AccountsClock()) continue;
    until = std::max(until.value_or(counter->second.blocked_until), counter->second.blocked_until);
  }
  return until;
}

storage::SignInStart FakeAccounts::Books::Count(const storage::FailureCounters& of) {
  if (const auto until = WaitsUntil(of)) return {until, std::nullopt};
  const Instant now = AccountsClock();
  for (const auto& [key, free_count] : FreeCounts(of)) {
    Counter& counter = counters.try_emplace(key, Counter{0, now, now, now}).first->second;
    const bool was_quiet = std::max(counter.last_failed_at, counter.blocked_until) < now - kQuiet;
    counter.failed_count = was_quiet ? 1 : counter.failed_count + 1;
    if (was_quiet) counter.first_failed_at = now;
    counter.last_failed_at = now;
    counter.blocked_until =
        was_quiet ? now
                  : now + std::chrono::duration_cast<Instant::duration>(WaitAfter(counter.failed_count, free_count));
  }
  return {std::nullopt, now};
}

void FakeAccounts::Books::GiveBack(const storage::FailureCounters& of, Instant counted_at) {
  for (const auto& [key, free_count] : FreeCounts(of)) {
    const auto found = counters.find(key);
    if (found == counters.end() || found->second.first_failed_at > counted_at) continue;
    Counter& counter = found->second;
    // The wait that this one alone brought goes with it.
    if (counter.failed_count <= free_count || counter.last_failed_at == counted_at)
      counter.blocked_until = AccountsClock();
    counter.failed_count = std::max(counter.failed_count - 1, 0);
  }
}

void FakeAccounts::Books::WentWell(const storage::CountedSignIn& counted) {
  for (const auto& [key, free_count] : FreeCounts({counted.counters.account, std::nullopt})) counters.erase(key);
  GiveBack({std::nullopt, counted.counters.address}, counted.counted_at);
}

absl::Status FakeAccounts::Commit(Books changed, const storage::StillWanted& still_wanted) {
  if (absl::Status committed = commits.Commit(still_wanted); !committed.ok()) return committed;
  books_ = std::move(changed);
  return absl::OkStatus();
}

void FakeAccounts::See(const std::string& name) {
  const auto lock = commits.Lock();
  books_.known.insert(name);
}

void FakeAccounts::LetPass(seconds time) {
  const auto lock = commits.Lock();
  for (auto& [key, counter] : books_.counters)
    for (Instant* moment : {&counter.first_failed_at, &counter.last_failed_at, &counter.blocked_until}) *moment -= time;
}

void FakeAccounts::EndAhead(const std::string& account, seconds ahead) {
  const auto lock = commits.Lock();
  books_.ended_before[account] = AccountsClock() + ahead;
}

void FakeAccounts::FailSignIns(absl::Status failure) {
  const auto lock = commits.Lock();
  sign_in_failure_ = std::move(failure);
}

void FakeAccounts::ChangeMeanwhile(const std::string& name, std::function<void(AccountRow*)> change) {
  const auto lock = commits.Lock();
  meanwhile_ = [this, name, change = std::move(change)] { change(&books_.accounts.at(name).row); };
}

void FakeAccounts::PassMeanwhile() {
  if (const auto change = std::exchange(meanwhile_, nullptr)) change();
}

int FakeAccounts::FailedCount() const {
  const auto lock = commits.Lock();
  int count = 0;
  for (const auto& [key, counter] : books_.counters) count += counter.failed_count;
  return count;
}

std::vector<FakeAccountEvent> FakeAccounts::events() const {
  const auto lock = commits.Lock();
  return books_.events;
}

std::chrono::nanoseconds FakeAccounts::longest_call() const {
  const auto lock = commits.Lock();
  return longest_call_;
}

absl::StatusOr<std::optional<AccountRow>> FakeAccounts::Find(const std::string& name, storage::Deadline) const {
  const InCall call(*this);
  if (!commits.failure().ok()) return commits.failure();
  return books_.Find(name);
}

absl::StatusOr<std::vector<AccountRow>> FakeAccounts::List(const storage::AccountFilter& filter,
                                                           const std::string& after_name, int limit,
                                                           storage::Deadline) const {
  const InCall call(*this);
  if (!commits.failure().ok()) return commits.failure();
  std::vector<AccountRow> listed;
  for (auto at = books_.accounts.upper_bound(after_name);
       at != books_.accounts.end() && static_cast<int>(listed.size()) < limit; ++at) {
    const AccountRow& row = at->second.row;
    const bool has_role = filter.role.empty() || std::count(row.roles.begin(), row.roles.end(), filter.role) > 0;
    if (has_role && !(filter.enabled_only && row.disabled)) listed.push_back(row);
  }
  return listed;
}

absl::StatusOr<storage::SignInLook> FakeAccounts::LookAtSignIn(const storage::FailureCounters& counters,
                                                               const std::string& name, storage::Deadline) const {
  const InCall call(*this);
  if (!commits.failure().ok()) return commits.failure();
  return storage::SignInLook{{books_.WaitsUntil(counters), std::nullopt}, books_.Find(name)};
}

absl::StatusOr<storage::SessionLook> FakeAccounts::LookAtSession(const std::string& account, Instant since,
                                                                 storage::Deadline) const {
  const InCall call(*this);
  if (!commits.failure().ok()) return commits.failure();
  return books_.Look(account, since);
}

absl::StatusOr<AccountRow> FakeAccounts::Create(const AccountRow& account, const std::string& requested_by,
                                                const storage::StillWanted& still_wanted, storage::Deadline) {
  const InCall call(*this);
  if (!commits.failure().ok()) return commits.failure();
  Books changed = books_;
  changed.Make(account, requested_by);
  if (absl::Status committed = Commit(std::move(changed), still_wanted); !committed.ok()) return committed;
  return books_.accounts.at(account.name).row;
}

absl::StatusOr<std::optional<AccountRow>> FakeAccounts::Change(const std::string& name,
                                                               const storage::AccountChange& change,
                                                               const storage::AccountDeed& deed,
                                                               const storage::StillWanted& still_wanted,
                                                               storage::Deadline) {
  const InCall call(*this);
  if (!commits.failure().ok()) return commits.failure();
  PassMeanwhile();
  std::optional<AccountRow> account = books_.Find(name);
  if (!account) return std::nullopt;
  const absl::StatusOr<bool> is_new = change(&*account);
  if (!is_new.ok()) return is_new.status();
  Books changed = books_;
  if (*is_new) changed.Keep(*account, deed);
  if (absl::Status committed = Commit(std::move(changed), still_wanted); !committed.ok()) return committed;
  return books_.Find(name);
}

absl::StatusOr<storage::SignInLook> FakeAccounts::BeginSignIn(const storage::FailureCounters& counters,
                                                              const std::string& name,
                                                              const storage::StillWanted& still_wanted,
                                                              storage::Deadline) {
  const InCall call(*this);
  if (!commits.failure().ok()) return commits.failure();
  Books changed = books_;
  const storage::SignInStart start = changed.Count(counters);
  if (absl::Status committed = Commit(std::move(changed), still_wanted); !committed.ok()) return committed;
  return storage::SignInLook{start, books_.Find(name)};
}

absl::Status FakeAccounts::SignInWentWell(const storage::CountedSignIn& counted,
                                          const storage::StillWanted& still_wanted, storage::Deadline) {
  const InCall call(*this);
  if (!commits.failure().ok()) return commits.failure();
  Books changed = books_;
  changed.WentWell(counted);
  return Commit(std::move(changed), still_wanted);
}

absl::Status FakeAccounts::GiveSignInBack(const storage::CountedSignIn& counted, storage::Deadline) {
  const InCall call(*this);
  if (!commits.failure().ok()) return commits.failure();
  books_.GiveBack(counted.counters, counted.counted_at);
  return absl::OkStatus();
}

absl::Status FakeAccounts::ForgetSignInFailures(storage::Deadline) {
  const InCall call(*this);
  if (!commits.failure().ok()) return commits.failure();
  for (auto at = books_.counters.begin(); at != books_.counters.end();)
    at = at->second.last_failed_at < AccountsClock() - kForgottenAfter ? books_.counters.erase(at) : std::next(at);
  return absl::OkStatus();
}

absl::Status FakeAccounts::SignIn(const std::string& account, const storage::SignInOrder& order,
                                  const storage::StillWanted& still_wanted, storage::Deadline) {
  const InCall call(*this);
  if (!commits.failure().ok()) return commits.failure();
  PassMeanwhile();
  Books changed = books_;
  const absl::StatusOr<AccountRow> let_in = LetIn(order, changed.Find(account));
  if (!let_in.ok()) return let_in.status();
  if (!sign_in_failure_.ok()) return sign_in_failure_;
  if (absl::Status begun = changed.Begin(*let_in, order); !begun.ok()) return begun;
  return Commit(std::move(changed), still_wanted);
}

absl::Status FakeAccounts::SignInOfSubject(const storage::VouchedPerson& person, const storage::SignInOrder& order,
                                           const storage::StillWanted& still_wanted, storage::Deadline) {
  const InCall call(*this);
  if (!commits.failure().ok()) return commits.failure();
  Books changed = books_;
  if (!changed.OfSubject(person.account) && (person.is_linked || changed.known.count(person.account.name) == 0))
    changed.Make(person.account, order.requested_by);
  absl::StatusOr<AccountRow> account = LetIn(order, changed.OfSubject(person.account));
  if (!account.ok()) return account.status();
  if (!sign_in_failure_.ok()) return sign_in_failure_;
  if (account->roles != person.account.roles) {
    account->roles = person.account.roles;
    changed.Keep(*account, {storage::AccountEvent::kRolesSet, true, order.requested_by});
  }
  if (absl::Status begun = changed.Begin(*account, order); !begun.ok()) return begun;
  return Commit(std::move(changed), still_wanted);
}

absl::StatusOr<bool> FakeAccounts::SignOut(const std::string& account, Instant since, Instant over_at,
                                           const std::string& requested_by, const storage::StillWanted& still_wanted,
                                           storage::Deadline) {
  const InCall call(*this);
  if (!commits.failure().ok()) return commits.failure();
  Books changed = books_;
  const storage::SessionLook look = changed.Look(account, since);
  const bool ends = look.account && !look.is_ended && over_at > look.now;
  if (ends) {
    changed.EndSessions(account);
    changed.Append(*look.account, storage::AccountEvent::kSignedOut, requested_by);
  }
  if (absl::Status committed = Commit(std::move(changed), still_wanted); !committed.ok()) return committed;
  return ends;
}

}  // namespace sixpoint::testing
