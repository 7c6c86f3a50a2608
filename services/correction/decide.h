// What may be done with a correction that was made: asked of it as it is then. requested_by: runtime/caller_identity.h.
#pragma once

#include <absl/status/statusor.h>

#include <string>

#include "sixpoint/correction/v1/correction.pb.h"
#include "storage/correction_events.h"

namespace sixpoint::correction {

// CORRECTION_NOT_FOUND.
absl::Status NotRecorded(const std::string& name);

// Of requests that CheckDecision let pass. Only a draft is released; what was refused stays so (CORRECTION_DECIDED).
absl::StatusOr<storage::CorrectionDecision> Decide(const v1::ReleaseCorrectionRequest& request,
                                                   const std::string& requested_by);
absl::StatusOr<storage::CorrectionDecision> Decide(const v1::RefuseCorrectionRequest& request,
                                                   const std::string& requested_by);

// Of requests that CheckReport let pass. PROGRAM_NOT_RELEASED: its program never left. HOLE_CUT_BEFORE. INVALID_ARGUMENT: a hole that
// the correction has not. What was cut is recorded also where the correction was refused or expired since: it is a fact.
absl::StatusOr<storage::CutReport> ReportOf(const v1::ReportCutRequest& request, const std::string& requested_by);

// PROGRAM_NOT_RELEASED, PROGRAM_MISSING; CLAMPING_DIFFERS where machine, blade or clamping are not those of the correction.
absl::Status CheckFetchable(const storage::CorrectionRow& row, const v1::FetchProgramRequest& request);

}  // namespace sixpoint::correction
