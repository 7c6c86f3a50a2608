#include "storage/sign_in_failures.h"

#include <vector>

#include "storage/blobs.h"

namespace sixpoint::storage {
namespace {

constexpr char kBlocked[] =
    "SELECT max(blocked_until), clock_timestamp() FROM sign_in_failures "
    "WHERE of_sha256 = ANY($1) AND blocked_until > clock_timestamp()";
constexpr char kForgetFailures[] =
    "DELETE FROM sign_in_failures WHERE of_sha256 IN (SELECT of_sha256 FROM sign_in_failures "
    "WHERE last_failed_at < clock_timestamp() - interval '1 hour' ORDER BY last_failed_at LIMIT 100 "
    "FOR UPDATE SKIP LOCKED)";
// A row that is locked, whether it was there or not: also where another one's sign-in deletes it at the same moment.
constexpr char kLockFailures[] =
    "INSERT INTO sign_in_failures (of_sha256, failed_count, blocked_until) "
    "VALUES ($1, 0, clock_timestamp()) ON CONFLICT (of_sha256) DO UPDATE SET failed_count = "
    "sign_in_failures.failed_count";
// Who was quiet for a quarter of an hour, and waited for nothing in it, begins anew.
#define WAS_QUIET "greatest(last_failed_at, blocked_until) < clock_timestamp() - interval '15 minutes'"
constexpr char kCountFailure[] =
    "UPDATE sign_in_failures SET failed_count = CASE WHEN " WAS_QUIET
    " THEN 1 ELSE failed_count + 1 END, "
    "first_failed_at = CASE WHEN " WAS_QUIET
    " THEN $3 ELSE first_failed_at END, "
    "last_failed_at = $3, "
    "blocked_until = CASE WHEN " WAS_QUIET
    " OR failed_count + 1 < $2::integer THEN clock_timestamp() "
    "ELSE clock_timestamp() + least(interval '15 minutes', "
    "interval '30 seconds' * power(2, least(failed_count + 1 - $2::integer, 10))) END WHERE of_sha256 = $1";
constexpr char kBeginAnew[] = "DELETE FROM sign_in_failures WHERE of_sha256 = $1";
// The wait that this one alone brought goes with it; one that others failed for since stays.
constexpr char kOneLess[] =
    "UPDATE sign_in_failures SET failed_count = greatest(failed_count - 1, 0), "
    "blocked_until = CASE WHEN failed_count <= $2::integer OR last_failed_at = $3 THEN clock_timestamp() "
    "ELSE blocked_until END WHERE of_sha256 = $1 AND first_failed_at <= $3";

struct Row {
  std::string digest;
  int free_count;
};

// In one order, whoever asks: two that wait for each other wait for ever.
std::vector<Row> RowsOf(const FailureCounters& counters) {
  std::vector<Row> rows;
  if (counters.account)
    rows.push_back({Sha256Hex("sign-in of account " + counters.account->of), counters.account->free_count});
  if (counters.address)
    rows.push_back({Sha256Hex("sign-in of address " + counters.address->of), counters.address->free_count});
  return rows;
}

absl::StatusOr<Rows> Blocked(Transaction& transaction, const FailureCounters& counters) {
  std::vector<std::string> digests;
  for (const Row& row : RowsOf(counters)) digests.push_back(row.digest);
  return transaction.Execute(kBlocked, Params().Digests(digests));
}

absl::Status OneLess(Transaction& transaction, const Row& row, Instant counted_at) {
  return transaction.Execute(kOneLess, Params().Digest(row.digest).Int(row.free_count).Time(counted_at)).status();
}

}  // namespace

absl::StatusOr<std::optional<Instant>> SignInsWaitUntil(Transaction& transaction, const FailureCounters& counters) {
  const absl::StatusOr<Rows> rows = Blocked(transaction, counters);
  if (!rows.ok()) return rows.status();
  if (rows->IsNull(0, 0)) return std::nullopt;
  return rows->Checked(std::optional(rows->Time(0, 0)));
}

absl::StatusOr<SignInStart> BeginSignIn(Transaction& transaction, const FailureCounters& counters) {
  const std::vector<Row> counted = RowsOf(counters);
  for (const Row& row : counted)
    if (const auto locked = transaction.Execute(kLockFailures, Params().Digest(row.digest)); !locked.ok())
      return locked.status();
  const absl::StatusOr<Rows> blocked = Blocked(transaction, counters);
  if (!blocked.ok()) return blocked.status();
  SignInStart start;
  if (!blocked->IsNull(0, 0)) {
    start.waits_until = blocked->Time(0, 0);
    return blocked->Checked(start);
  }
  start.counted_at = blocked->Time(0, 1);
  if (absl::Status read = blocked->status(); !read.ok()) return read;
  for (const Row& row : counted) {
    Params params;
    params.Digest(row.digest).Int(row.free_count).Time(*start.counted_at);
    if (const auto done = transaction.Execute(kCountFailure, params); !done.ok()) return done.status();
  }
  return start;
}

absl::Status SignInWentWell(Transaction& transaction, const FailureCounters& counters, Instant counted_at) {
  for (const Row& row : RowsOf({counters.account, std::nullopt}))
    if (const auto done = transaction.Execute(kBeginAnew, Params().Digest(row.digest)); !done.ok())
      return done.status();
  return GiveSignInBack(transaction, {std::nullopt, counters.address}, counted_at);
}

absl::Status GiveSignInBack(Transaction& transaction, const FailureCounters& counters, Instant counted_at) {
  for (const Row& row : RowsOf(counters))
    if (absl::Status done = OneLess(transaction, row, counted_at); !done.ok()) return done;
  return absl::OkStatus();
}

absl::Status ForgetSignInFailures(Transaction& transaction) { return transaction.Execute(kForgetFailures).status(); }

}  // namespace sixpoint::storage
