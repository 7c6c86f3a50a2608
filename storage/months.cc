#include "storage/months.h"

#include <utility>

#include "refusal/refusal.h"
#include "storage/each_row.h"

namespace sixpoint::storage {
namespace {

constexpr char kMake[] = "SELECT make_partitions($1)";
constexpr char kForgetRequests[] =
    "SELECT drop_requests_before((date_trunc('month', clock_timestamp()) - make_interval(months => $1))::date)";
constexpr char kSelectMonths[] =
    "SELECT replace(right(c.relname, 7), '_', '-'), count(*), sum(greatest(c.reltuples, 0))::bigint, "
    "sum(pg_total_relation_size(c.oid))::bigint FROM pg_inherits i JOIN pg_class c ON c.oid = i.inhrelid "
    "JOIN pg_partitioned_table p ON p.partrelid = i.inhparent GROUP BY 1 ORDER BY 1";

absl::StatusOr<int> Count(Transaction& transaction, const char* sql, int argument) {
  const absl::StatusOr<Rows> rows = transaction.Execute(sql, Params().Int(argument));
  if (!rows.ok()) return rows.status();
  return rows->Checked(static_cast<int>(rows->Int(0, 0)));
}

}  // namespace

absl::StatusOr<int> MakeMonths(Database& database, int months_ahead, Deadline deadline) {
  if (months_ahead < 0 || months_ahead > kMostMonthsAhead)
    return Refuse("months_ahead", std::to_string(months_ahead), "0 to " + std::to_string(kMostMonthsAhead));
  int made = 0;
  for (int month = 0; month <= months_ahead; ++month) {
    absl::StatusOr<Transaction> transaction = database.Begin(deadline);
    if (!transaction.ok()) return transaction.status();
    const absl::StatusOr<int> count = Count(*transaction, kMake, month);
    if (!count.ok()) return count;
    if (absl::Status committed = transaction->Commit(); !committed.ok()) return committed;
    made += *count;
  }
  return made;
}

absl::StatusOr<int> ForgetRequests(Transaction& transaction) {
  return Count(transaction, kForgetRequests, kRequestMonths);
}

absl::StatusOr<std::vector<MonthUse>> ListMonths(Transaction& transaction) {
  return AllRows(transaction, kSelectMonths, Params(), [](const Rows& rows, int row) -> MonthUse {
    return {rows.Text(row, 0), static_cast<int>(rows.Int(row, 1)), rows.Int(row, 2), rows.Int(row, 3)};
  });
}

}  // namespace sixpoint::storage
