// Kinds of scans as people write them.
#pragma once

#include <absl/status/statusor.h>

#include <string>

#include "sixpoint/ingest/v1/ingest.pb.h"

namespace sixpoint::cli {

// For the help of an option that takes one.
inline constexpr char kScanKinds[] = "artefact, arm, airfoil, local or pins";

// "airfoil" and so on.
std::string ScanKindText(ingest::v1::ScanKind kind);
// INVALID_ARGUMENT names the option.
absl::StatusOr<ingest::v1::ScanKind> ScanKindOf(const std::string& option, const std::string& text);

}  // namespace sixpoint::cli
