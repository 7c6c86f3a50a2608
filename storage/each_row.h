// A statement's rows one by one.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include "storage/database.h"

namespace sixpoint::storage {

// take(rows, row) for each row of the answer.
template <typename Take>
absl::Status EachRow(Transaction& transaction, const char* sql, const Params& params, const Take& take) {
  const absl::StatusOr<Rows> rows = transaction.Execute(sql, params);
  if (!rows.ok()) return rows.status();
  for (int row = 0; row < rows->count(); ++row) take(*rows, row);
  return rows->status();
}

}  // namespace sixpoint::storage
