// Many blades in one call: `register --batch FILE`, `register --blades A,B,...`.
#pragma once

#include <absl/status/statusor.h>

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "cli/session.h"
#include "sixpoint/registration/v1/registration.pb.h"

namespace sixpoint::cli {

// {registrations: [{blade, scans: [...], method, axis_tables}]}; one line for each thing that is wrong.
absl::StatusOr<registration::v1::RegisterBatchRequest> BatchFromDocument(const nlohmann::json& document);

// Each blade again from the scans of its latest registration, by its method, with axis tables where that had them. A method
// other than METHOD_UNSPECIFIED, or axis_tables, stands for all.
absl::StatusOr<registration::v1::RegisterBatchRequest> BatchOfLatest(Session* session,
                                                                     const std::vector<std::string>& blades,
                                                                     registration::v1::Method method, bool axis_tables);

// In as many calls as it takes, each of the session's deadline at most; a call that broke off is made again and goes on.
// Prints each result: as lines of JSON when it is there, or a table at the end. The request has a request_id.
absl::Status RegisterBatch(Session* session, registration::v1::RegisterBatchRequest request);

}  // namespace sixpoint::cli
