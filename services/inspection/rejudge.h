// Recorded inspections judged anew: which, by what request, and what is another now.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "services/clients/blade_peers.h"
#include "services/runtime/call.h"
#include "sixpoint/inspection/v1/inspection.pb.h"

namespace sixpoint::inspection {

absl::Status CheckRejudge(const v1::RejudgeRequest& request);

// Names of the inspections that are to be judged anew, oldest first. INVALID_ARGUMENT: more than can be in one call.
absl::StatusOr<std::vector<std::string>> InspectionsOf(const clients::BladePeers& peers,
                                                       const v1::RejudgeRequest& request,
                                                       const runtime::Caller& caller);

// The old one asked for again: the same scans, positioned in the same way. Its request_id follows from the call's and the old one's name.
absl::StatusOr<v1::InspectRequest> AskedAgain(const clients::BladePeers& peers, const v1::RejudgeRequest& request,
                                              const v1::Inspection& old, const runtime::Caller& caller);

// Whether a failure is not of one inspection: whoever asked calls again, and goes on.
bool EndsTheCall(const absl::Status& status);
// The old one could not be read.
v1::RejudgeResponse NotRead(const std::string& name, const absl::Status& status);
// What became of it; now: the new inspection, or why there is none.
v1::RejudgeResponse Beside(const v1::Inspection& old, const absl::StatusOr<v1::Inspection>& now);

}  // namespace sixpoint::inspection
