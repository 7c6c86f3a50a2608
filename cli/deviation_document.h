// A file of regions and profile tolerances, as `sixpoint deviation map --tolerances` takes it.
#pragma once

#include <absl/status/status.h>

#include <string>

#include "sixpoint/inspection/v1/deviation.pb.h"

namespace sixpoint::cli {

// Adds what it says to the request. INVALID_ARGUMENT with all its problems.
absl::Status ReadDeviationDocument(const std::string& path, inspection::v1::MapDeviationRequest* request);

}  // namespace sixpoint::cli
