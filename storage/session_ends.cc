#include "storage/session_ends.h"

namespace sixpoint::storage {
namespace {

// Tokens last 15 minutes at most, and clocks of services may be late.
constexpr char kRecent[] =
    "SELECT account, ended_before FROM session_ends WHERE ended_before > clock_timestamp() - interval '30 minutes' "
    "LIMIT 10001";
constexpr char kOfAccount[] = "SELECT ended_before FROM session_ends WHERE account = $1";
constexpr char kEnd[] =
    "INSERT INTO session_ends (account, ended_before) VALUES ($1, clock_timestamp()) "
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

absl::Status EndSessions(Transaction& transaction, const std::string& account) {
  return transaction.Execute(kEnd, Params().Text(account)).status();
}

}  // namespace sixpoint::storage
