#include "metrology/kinematics/beyond_reach.h"

#include <absl/strings/cord.h>

namespace sixpoint::metrology {

absl::Status BeyondReach(const std::vector<Violation>& violations) {
  const absl::Status refusal = Refuse(violations);
  absl::Status status = absl::OutOfRangeError(refusal.message());
  refusal.ForEachPayload([&](auto url, const absl::Cord& payload) { status.SetPayload(url, payload); });
  return status;
}

absl::Status UnderField(const std::string& prefix, const absl::Status& refusal) {
  const absl::Status under = Under(prefix, refusal);
  return absl::IsOutOfRange(refusal) ? BeyondReach(ViolationsOf(under)) : under;
}

}  // namespace sixpoint::metrology
