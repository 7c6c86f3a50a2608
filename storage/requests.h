// Safe retries (AIP-155): what a request recorded is kept under its request_id, in the transaction that recorded it, and given again
// as it then stands.
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "storage/database.h"
#include "storage/record.h"
#include "storage/result_store.h"

namespace sixpoint::storage {

KeptRequest KeptRequestOf(const RecordedRequest& request);

// ALREADY_EXISTS with its reason: the same id came with another request.
absl::Status RequestIdReused(const std::string& request_id);

// The name of what this request recorded before. ALREADY_EXISTS when the same id came with another request. Takes a
// transaction-long lock on the id, so that two retries at once do the work once. Without an id there is nothing.
absl::StatusOr<std::optional<std::string>> FindKept(Transaction& transaction, const RecordedRequest& request);
// Of a request that recorded nothing new: what it gives is of that name. (AppendRecord keeps those that did.)
absl::Status KeepRequest(Transaction& transaction, const std::optional<KeptRequest>& request, const std::string& name);

// The row of what the request recorded; find(transaction, name) gives the one of that name. DATA_LOSS where there is none.
template <typename Row, typename Find>
absl::StatusOr<std::optional<Row>> FindKeptRow(Transaction& transaction, const RecordedRequest& request,
                                               const Find& find) {
  const absl::StatusOr<std::optional<std::string>> name = FindKept(transaction, request);
  if (!name.ok()) return name.status();
  if (!name->has_value()) return std::nullopt;
  absl::StatusOr<std::optional<Row>> row = find(transaction, **name);
  if (row.ok() && !row->has_value())
    return absl::DataLossError("request_id: " + request.request_id + " recorded " + **name + ", which is not stored");
  return row;
}

// The same in a transaction of its own; without an id the database is not asked.
template <typename Row, typename Find>
absl::StatusOr<std::optional<Row>> FindRecorded(Database& database, const RecordedRequest& request, Deadline deadline,
                                                const Find& find) {
  if (request.request_id.empty()) return std::nullopt;
  absl::StatusOr<Transaction> transaction = database.Begin(deadline);
  if (!transaction.ok()) return transaction.status();
  return FindKeptRow<Row>(*transaction, request, find);
}

// Work done once for each request: in one transaction what it recorded is looked for (and given, if there is something), the work
// done, its row given, all committed. A transaction that the database ended on its own account (ABORTED: a deadlock, a
// serialization failure) is tried again from its start, so that the work must change nothing but the database.
template <typename Row, typename Find, typename Work>
absl::StatusOr<Row> RecordOnce(Database& database, const RecordedRequest& request, Deadline deadline, const Find& find,
                               const Work& work) {
  constexpr int kMostAttempts = 3;
  const auto once = [&]() -> absl::StatusOr<Row> {
    absl::StatusOr<Transaction> transaction = database.Begin(deadline);
    if (!transaction.ok()) return transaction.status();
    absl::StatusOr<std::optional<Row>> kept = FindKeptRow<Row>(*transaction, request, find);
    if (!kept.ok()) return kept.status();
    if (kept->has_value()) return **std::move(kept);
    absl::StatusOr<Row> row = work(*transaction);
    if (!row.ok()) return row;
    if (absl::Status committed = transaction->Commit(); !committed.ok()) return committed;
    return row;
  };
  absl::StatusOr<Row> row = once();
  for (int attempt = 1; attempt < kMostAttempts && absl::IsAborted(row.status()); ++attempt) row = once();
  return row;
}

// Always the same UUID for the same text (RFC 9562, version 8): the request_id of what follows from another request.
std::string UuidFrom(std::string_view text);

}  // namespace sixpoint::storage
