// What an assessment judges, fetched and checked: results of one blade, against one revision of its part, and a drawing that is valid for it.
#pragma once

#include <absl/status/statusor.h>

#include "services/inspection/assess.h"
#include "services/inspection/assessment_service.h"
#include "services/runtime/call.h"

namespace sixpoint::inspection {

// INVALID_ARGUMENT with all that is wrong with it.
absl::Status CheckAssess(const v1::AssessBladeRequest& request);

// INVALID_ARGUMENT: a result of another blade or of another revision of the part than the first, a drawing of another part or not valid for
// that revision. NOT_FOUND with its reason: a result or drawing that is not recorded.
absl::StatusOr<AssessmentInputs> FetchAssessed(const v1::AssessBladeRequest& request, const AssessedStores& stores,
                                               const clients::BladePeers& peers, const runtime::Caller& caller);

}  // namespace sixpoint::inspection
