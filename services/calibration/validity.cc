#include "services/calibration/validity.h"

#include "services/runtime/errors.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::calibration {
namespace {

using runtime::Refuse;

constexpr std::chrono::hours kLongestValidity{10 * 366 * 24};

}  // namespace

absl::StatusOr<storage::Instant> InstantOf(const std::string& field, const google::protobuf::Timestamp& time) {
  if (absl::Status status = runtime::CheckMoment(field, time); !status.ok()) return status;
  return runtime::MomentOf(time);
}

absl::StatusOr<Validity> ValidityOf(const google::protobuf::Timestamp* from, const google::protobuf::Timestamp* until,
                                    storage::Instant now, std::chrono::hours usual) {
  Validity validity{now, now};
  if (from != nullptr) {
    const absl::StatusOr<storage::Instant> start = InstantOf("valid_from", *from);
    if (!start.ok()) return start.status();
    validity.from = *start;
  }
  validity.until = validity.from + usual;
  if (until != nullptr) {
    const absl::StatusOr<storage::Instant> end = InstantOf("valid_until", *until);
    if (!end.ok()) return end.status();
    validity.until = *end;
  }
  if (validity.until <= validity.from || validity.until - validity.from > kLongestValidity)
    return Refuse("valid_until", std::to_string(until == nullptr ? 0 : until->seconds()) + " s",
                  "later than valid_from, by at most 10 years");
  return validity;
}

}  // namespace sixpoint::calibration
