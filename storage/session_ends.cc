#include "storage/session_ends.h"

namespace sixpoint::storage {
namespace {

// Tokens last 15 minutes at most, and clocks of services may be late.
constexpr char kRecent[] =
    "SELECT account, ended_before FROM session_ends WHERE ended_before > clock_timestamp() - interval '30 minutes' "
    "LIMIT 10001";
constexpr char kOfAccount[] = "SELECT ended_before FROM session_ends WHERE account = $1";
constexpr char kStart[] =
    "SELECT greatest(clock.now, e.ended_before + interval '1 microsecond'), clock.now "
    "FROM (SELECT clock_timestamp() AS now) clock LEFT JOIN session_ends e ON e.account = $1";
constexpr char kKeepStart[] = "UPDATE accounts SET newest_session_at = greatest(newest_session_at, $2) WHERE name = $1";
constexpr char kEndSessions[] =
    "INSERT INTO session_ends (account, ended_before) "
    "VALUES ($1, greatest(clock_timestamp(), (SELECT newest_session_at FROM accounts WHERE name = $1))) "
    "ON CONFLICT (account) DO UPDATE SET ended_before = greatest(session_ends.ended_before, excluded.ended_before)";
constexpr int kMost = 10000;

}  // namespace

absl::StatusOr<std::map<std::string, Instant>> RecentSessionEnds(Transaction& transaction) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kRecent);
  if (!rows.ok()) return rows.status();
  if (rows->count() > kMost)
    return absl::ResourceExhaustedError("session_ends: more than " + std::to_string(kMost) + " within half an hour");
  std::map<std::string, Instant> ends;
  for (int row = 0; row < rows->count(); ++row) ends.emplace(rows->Text(row, 0), rows->Time(row, 1));
  return rows->Checked(std::move(ends));
}

absl::StatusOr<std::optional<Instant>> SessionsEndedBefore(Transaction& transaction, const std::string& account) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kOfAccount, Params().Text(account));
  if (!rows.ok()) return rows.status();
  if (rows->count() == 0) return std::nullopt;
  return rows->Checked(std::optional(rows->Time(0, 0)));
}

absl::StatusOr<SessionStart> BeginSession(Transaction& transaction, const std::string& account) {
  const absl::StatusOr<Rows> rows = transaction.Execute(kStart, Params().Text(account));
  if (!rows.ok()) return rows.status();
  const SessionStart start{rows->Time(0, 0), rows->Time(0, 1)};
  if (absl::Status read = rows->status(); !read.ok()) return read;
  const absl::StatusOr<Rows> kept = transaction.Execute(kKeepStart, Params().Text(account).Time(start.since));
  if (!kept.ok()) return kept.status();
  if (kept->affected() != 1) return absl::InternalError("accounts: a row that was there is not");
  return start;
}

absl::Status EndSessions(Transaction& transaction, const std::string& account) {
  return transaction.Execute(kEndSessions, Params().Text(account)).status();
}

}  // namespace sixpoint::storage
