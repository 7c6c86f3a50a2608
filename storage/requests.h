// Safe retries (AIP-155): the response to a request_id is kept in the transaction that did the work.
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>
#include <string_view>

#include "storage/database.h"

namespace sixpoint::storage {

// The kept response, if this request was answered before. ALREADY_EXISTS when the same id came with another request.
// Takes a transaction-long lock on the id, so that two retries at once do the work once. An empty id finds nothing.
absl::StatusOr<std::optional<std::string>> FindAnswer(Transaction& transaction, std::string_view method,
                                                      const std::string& request_id, std::string_view request_bytes);
absl::Status KeepAnswer(Transaction& transaction, std::string_view method, const std::string& request_id,
                        std::string_view request_bytes, std::string_view response_bytes);

// Always the same UUID for the same text (RFC 9562, version 8): the request_id of what follows from another request.
std::string UuidFrom(std::string_view text);

}  // namespace sixpoint::storage
