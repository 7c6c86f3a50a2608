// Answers kept for safe retries (storage/requests.h), as messages.
#pragma once

#include <optional>

#include "storage/requests.h"

namespace sixpoint::calibration {

// The answer kept for this request_id, if it was answered before.
template <typename Answer, typename Request>
absl::StatusOr<std::optional<Answer>> FindKept(storage::Transaction& transaction, const char* call,
                                               const Request& request) {
  const auto kept = storage::FindAnswer(transaction, call, request.request_id(), request.SerializeAsString());
  if (!kept.ok()) return kept.status();
  if (!kept->has_value()) return std::nullopt;
  Answer answer;
  if (!answer.ParseFromString(**kept)) return absl::DataLossError("the kept answer cannot be read");
  return answer;
}

template <typename Answer, typename Request>
absl::Status Keep(storage::Transaction& transaction, const char* call, const Request& request, const Answer& answer) {
  return storage::KeepAnswer(transaction, call, request.request_id(), request.SerializeAsString(),
                             answer.SerializeAsString());
}

}  // namespace sixpoint::calibration
