#include "tests/support/newest_denials.h"

#include "storage/each_row.h"

namespace sixpoint::testing {
namespace {

constexpr char kSelectDenials[] =
    "SELECT area, method, name_of(caller), peer_address, reason, sentence, denied_count, first_denied_at, "
    "last_denied_at FROM denials ORDER BY denial_id DESC LIMIT $1";

}  // namespace

absl::StatusOr<std::vector<storage::Denial>> NewestDenials(storage::Transaction& transaction, int limit) {
  return storage::AllRows(transaction, kSelectDenials, storage::Params().Int(limit),
                          [](const storage::Rows& rows, int row) -> storage::Denial {
                            return {rows.Text(row, 0), rows.Text(row, 1), rows.Text(row, 2),
                                    rows.Text(row, 3), rows.Text(row, 4), rows.Text(row, 5),
                                    rows.Int(row, 6),  rows.Time(row, 7), rows.Time(row, 8)};
                          });
}

}  // namespace sixpoint::testing
