// `register --blades A,B,...` and `--part P --since T`: blades that were registered before, again from the same scans.
#pragma once

#include <absl/status/statusor.h>
#include <google/protobuf/timestamp.pb.h>

#include <string>
#include <vector>

#include "cli/session.h"
#include "sixpoint/registration/v1/registration.pb.h"

namespace sixpoint::cli {

struct Again {
  registration::v1::RegisterBatchRequest request;
  std::vector<registration::v1::Registration> before;  // by the request's index
};

// Each blade's latest registration again, by its method, with axis tables where that had them. A method other than
// METHOD_UNSPECIFIED, or axis_tables, stands for all.
absl::StatusOr<Again> BatchOfLatest(Session* session, const std::vector<std::string>& blades,
                                    registration::v1::Method method, bool axis_tables);

// Of those registrations, but of none that an inspection made for its verdict, the latest of each blade.
absl::StatusOr<Again> BatchOfPart(Session* session, registration::v1::ListRegistrationsRequest which,
                                  registration::v1::Method method, bool axis_tables);

}  // namespace sixpoint::cli
