// A statement's rows one by one.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "storage/database.h"

namespace sixpoint::storage {

// take(rows, row) for each row of the answer.
template <typename Take>
absl::Status EachRow(Transaction& transaction, std::string_view sql, const Params& params, const Take& take) {
  const absl::StatusOr<Rows> rows = transaction.Execute(sql, params);
  if (!rows.ok()) return rows.status();
  for (int row = 0; row < rows->count(); ++row) take(*rows, row);
  return rows->status();
}

// What read(rows, row) makes of each.
template <typename Read>
auto AllRows(Transaction& transaction, std::string_view sql, const Params& params, const Read& read)
    -> absl::StatusOr<std::vector<decltype(read(std::declval<const Rows&>(), 0))>> {
  const absl::StatusOr<Rows> rows = transaction.Execute(sql, params);
  if (!rows.ok()) return rows.status();
  std::vector<decltype(read(*rows, 0))> all;
  all.reserve(static_cast<std::size_t>(rows->count()));
  for (int row = 0; row < rows->count(); ++row) all.push_back(read(*rows, row));
  return rows->Checked(std::move(all));
}

// The one that a key finds, or none.
template <typename Row>
absl::StatusOr<std::optional<Row>> FirstOf(absl::StatusOr<std::vector<Row>> rows) {
  if (!rows.ok()) return rows.status();
  if (rows->empty()) return std::nullopt;
  return std::move(rows->front());
}

}  // namespace sixpoint::storage
