// When a calibration may be used.
#pragma once

#include <absl/status/statusor.h>
#include <google/protobuf/timestamp.pb.h>

#include <chrono>
#include <string>

#include "storage/database.h"

namespace sixpoint::calibration {

struct Validity {
  storage::Instant from, until;
};
inline constexpr std::chrono::hours kUsualValidity{30 * 24};
inline constexpr std::chrono::hours kUsualAxisValidity{365 * 24};  // encoder runs are a matter of years
// Unset: from now, for `usual`.
absl::StatusOr<Validity> ValidityOf(const google::protobuf::Timestamp* from, const google::protobuf::Timestamp* until,
                                    storage::Instant now, std::chrono::hours usual = kUsualValidity);
absl::StatusOr<storage::Instant> InstantOf(const std::string& field, const google::protobuf::Timestamp& time);

// As a request asks for it; `now` is the database's.
template <typename Request>
absl::StatusOr<Validity> ValidityIn(const Request& request, const absl::StatusOr<storage::Instant>& now,
                                    std::chrono::hours usual = kUsualValidity) {
  if (!now.ok()) return now.status();
  return ValidityOf(request.has_valid_from() ? &request.valid_from() : nullptr,
                    request.has_valid_until() ? &request.valid_until() : nullptr, *now, usual);
}

}  // namespace sixpoint::calibration
