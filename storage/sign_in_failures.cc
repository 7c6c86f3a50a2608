#include "storage/sign_in_failures.h"

#include <algorithm>

#include "storage/blobs.h"

namespace sixpoint::storage {
namespace {

constexpr char kBlocked[] =
    "SELECT max(blocked_until) FROM sign_in_failures WHERE of_sha256 = ANY($1) AND blocked_until > clock_timestamp()";
constexpr char kForget[] =
    "DELETE FROM sign_in_failures WHERE of_sha256 IN (SELECT of_sha256 FROM sign_in_failures "
    "WHERE last_failed_at < clock_timestamp() - interval '1 hour' ORDER BY last_failed_at LIMIT 100 "
    "FOR UPDATE SKIP LOCKED)";
// A row to lock, for whoever comes at the same moment.
constexpr char kMake[] =
    "INSERT INTO sign_in_failures (of_sha256, failed_count, blocked_until) "
    "VALUES ($1, 0, clock_timestamp()) ON CONFLICT DO NOTHING";
constexpr char kLock[] = "SELECT 1 FROM sign_in_failures WHERE of_sha256 = $1 FOR UPDATE";
// Who was quiet for a quarter of an hour, and waited for nothing in it, begins anew.
#define WAS_QUIET "greatest(last_failed_at, blocked_until) < clock_timestamp() - interval '15 minutes'"
constexpr char kCount[] =
    "UPDATE sign_in_failures SET failed_count = CASE WHEN " WAS_QUIET
    " THEN 1 ELSE failed_count + 1 END, "
    "first_failed_at = CASE WHEN " WAS_QUIET
    " THEN clock_timestamp() ELSE first_failed_at END, "
    "last_failed_at = clock_timestamp(), "
    "blocked_until = CASE WHEN " WAS_QUIET
    " OR failed_count + 1 < $2::integer THEN clock_timestamp() "
    "ELSE clock_timestamp() + least(interval '15 minutes', "
    "interval '30 seconds' * power(2, least(failed_count + 1 - $2::integer, 10))) END WHERE of_sha256 = $1";
constexpr char kBeginAnew[] = "DELETE FROM sign_in_failures WHERE of_sha256 = $1";
constexpr char kOneLess[] =
    "UPDATE sign_in_failures SET failed_count = greatest(failed_count - 1, 0), "
    "blocked_until = CASE WHEN failed_count <= $2::integer THEN clock_timestamp() ELSE blocked_until END "
    "WHERE of_sha256 = $1";

std::string DigestOf(const std::string& of) { return Sha256Hex("sign-in of " + of); }

}  // namespace

absl::StatusOr<std::optional<Instant>> SignInsWaitUntil(Transaction& transaction,
                                                        const std::vector<FailureCounter>& counters) {
  std::vector<std::string> digests;
  for (const FailureCounter& counter : counters) digests.push_back(DigestOf(counter.of));
  const absl::StatusOr<Rows> rows = transaction.Execute(kBlocked, Params().Digests(digests));
  if (!rows.ok()) return rows.status();
  if (rows->IsNull(0, 0)) return std::nullopt;
  return rows->Checked(std::optional(rows->Time(0, 0)));
}

absl::StatusOr<std::optional<Instant>> BeginSignIn(Transaction& transaction,
                                                   const std::vector<FailureCounter>& counters) {
  if (const auto forgotten = transaction.Execute(kForget); !forgotten.ok()) return forgotten.status();
  // In one order, whoever asks: two that wait for each other wait for ever.
  std::vector<FailureCounter> in_order = counters;
  std::sort(in_order.begin(), in_order.end(), [](const auto& a, const auto& b) { return a.of < b.of; });
  for (const FailureCounter& counter : in_order) {
    for (const char* sql : {kMake, kLock}) {
      const auto done = transaction.Execute(sql, Params().Digest(DigestOf(counter.of)));
      if (!done.ok()) return done.status();
    }
  }
  const absl::StatusOr<std::optional<Instant>> waits = SignInsWaitUntil(transaction, counters);
  if (!waits.ok() || waits->has_value()) return waits;
  for (const FailureCounter& counter : in_order) {
    const auto counted = transaction.Execute(kCount, Params().Digest(DigestOf(counter.of)).Int(counter.free_count));
    if (!counted.ok()) return counted.status();
  }
  return std::nullopt;
}

absl::Status SignInWentWell(Transaction& transaction, const std::string& account, const FailureCounter& address) {
  // As BeginSignIn locks them.
  const bool account_first = account < address.of;
  for (const bool first : {true, false}) {
    const bool is_account = first == account_first;
    Params params;
    params.Digest(DigestOf(is_account ? account : address.of));
    if (!is_account) params.Int(address.free_count);
    const auto done = transaction.Execute(is_account ? kBeginAnew : kOneLess, params);
    if (!done.ok()) return done.status();
  }
  return absl::OkStatus();
}

}  // namespace sixpoint::storage
