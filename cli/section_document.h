// A file of planes, as `sixpoint section measure --planes` takes it.
#pragma once

#include <absl/status/status.h>

#include <string>

#include "sixpoint/inspection/v1/section.pb.h"

namespace sixpoint::cli {

// Adds what it says to the request. INVALID_ARGUMENT with all its problems.
absl::Status ReadSectionDocument(const std::string& path, inspection::v1::MeasureSectionsRequest* request);

}  // namespace sixpoint::cli
