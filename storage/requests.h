// Safe retries (AIP-155): the response to a request_id is kept in the transaction that did the work.
#pragma once

#include <absl/status/statusor.h>

#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "storage/database.h"
#include "storage/result_store.h"

namespace sixpoint::storage {

// The kept response, if this request was answered before. ALREADY_EXISTS when the same id came with another request.
// Takes a transaction-long lock on the id, so that two retries at once do the work once. An empty id finds nothing.
absl::StatusOr<std::optional<std::string>> FindAnswer(Transaction& transaction, std::string_view method,
                                                      const std::string& request_id, std::string_view request_bytes);
absl::Status KeepAnswer(Transaction& transaction, std::string_view method, const std::string& request_id,
                        std::string_view request_bytes, std::string_view response_bytes);

// The kept answer in a transaction of its own; without a request_id nothing is asked.
absl::StatusOr<std::optional<std::string>> FindAnswer(Database& database, const RecordedRequest& request,
                                                      Deadline deadline);

// Work done once for each request: in one transaction the answer is looked for (and given, if there is one), the work done, its
// answer kept, all committed. A transaction that the database ended on its own account (ABORTED: a deadlock, a serialization
// failure) is tried again from its start, so that the work must change nothing but the database.
absl::StatusOr<std::string> RecordOnce(Database& database, const RecordedRequest& request, Deadline deadline,
                                       const std::function<absl::StatusOr<std::string>(Transaction&)>& work);

// Always the same UUID for the same text (RFC 9562, version 8): the request_id of what follows from another request.
std::string UuidFrom(std::string_view text);

}  // namespace sixpoint::storage
