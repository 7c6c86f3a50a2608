// Pure checks of what clients send.
#pragma once

#include <absl/status/status.h>

#include <string>

#include "sixpoint/correction/v1/correction.pb.h"

namespace sixpoint::correction {

// Refuses bad names, repeated groups, and offsets and tools that no control has.
absl::Status CheckCorrect(const v1::CorrectRequest& request);
// What is asked of registration it checks itself.
absl::Status CheckCorrectScans(const v1::CorrectScansRequest& request);
// A person's: why is wanted.
absl::Status CheckDecision(const std::string& name, const std::string& reason);
absl::Status CheckFetch(const v1::FetchProgramRequest& request);
absl::Status CheckReport(const v1::ReportCutRequest& request);

}  // namespace sixpoint::correction
