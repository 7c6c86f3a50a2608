// `register` with its progress: one blade, or many in one batch.
#pragma once

#include <absl/status/statusor.h>

#include <vector>

#include "cli/session.h"
#include "sixpoint/registration/v1/registration.pb.h"

namespace sixpoint::cli {

// In as many calls as it takes, each of the session's deadline at most; a call that broke off is made again and goes on.
// Prints each result: as lines of JSON when it is there, or a table at the end; and what each moved from `before`, if that was
// given. The request has a request_id.
absl::Status RegisterBatch(Session* session, registration::v1::RegisterBatchRequest request,
                           const std::vector<registration::v1::Registration>& before = {});

// One alone. Refusals are as Register's. The request has a request_id.
absl::StatusOr<registration::v1::Registration> RegisterWatched(Session* session,
                                                               registration::v1::RegisterRequest request);

}  // namespace sixpoint::cli
