// Which pose an inspection judges holes at, and what other poses of the same scans say of it: asked of the registration service.
#pragma once

#include <absl/status/statusor.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "metrology/frames/pose.h"
#include "services/clients/blade_peers.h"
#include "services/runtime/call.h"
#include "sixpoint/inspection/v1/inspection.pb.h"
#include "sixpoint/registration/v1/registration.pb.h"

namespace sixpoint::inspection {

// By the method asked for, six-point where none is; whatever its outcome is.
absl::StatusOr<registration::v1::Registration> RegisterAsked(const clients::BladePeers& peers,
                                                             const v1::InspectRequest& request,
                                                             const runtime::Caller& caller);

// Another positioning of the same scans; INVALID_ARGUMENT or SIX_POINTS_MISSING where the part does not allow it.
using OtherPositioning = std::function<absl::StatusOr<registration::v1::Registration>(registration::v1::Method method)>;
// Registered now.
OtherPositioning RegisteredNow(const clients::BladePeers& peers, const v1::InspectRequest& request,
                               const runtime::Caller& caller);
// One of those that were recorded with an inspection; INVALID_ARGUMENT where none is of that method.
OtherPositioning RegisteredThen(const std::vector<registration::v1::Registration>& recorded);

// What other registrations of the same scans say of the one that the verdict rests on.
struct Compared {
  std::optional<registration::v1::Disagreement> disagreement;
  bool disagrees = false;
  std::vector<Eigen::Isometry3d> other_zero_from_part;  // in the uncertainties
  bool covered = false;                                 // all that were to be
  std::vector<std::string> names;
};

// tightest_um: the tightest position tolerance of the holes to be judged.
absl::StatusOr<Compared> Compare(const OtherPositioning& other, const registration::v1::Registration& registration,
                                 double tightest_um);

}  // namespace sixpoint::inspection
