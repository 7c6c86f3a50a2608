// The program that leaves: the whole one as it was proven, or what is left of it, proven again.
#pragma once

#include <absl/status/statusor.h>

#include "services/correction/inputs.h"
#include "services/runtime/call.h"
#include "sixpoint/correction/v1/correction.pb.h"
#include "storage/correction_events.h"

namespace sixpoint::correction {

// The correction's, where what it says still stands: CLAMPING_DIFFERS where registrations made since speak against its clamping; as
// FetchInputs where its calibrations are not those in force.
absl::StatusOr<registration::v1::Registration> StandingRegistration(const storage::CorrectionRow& correction,
                                                                    const clients::BladePeers& peers,
                                                                    const runtime::Caller& caller);

// Of a correction that CheckFetchable let pass, and its registration. PROGRAM_NOT_DIVISIBLE where what is left cannot be told from what
// was cut, or would not keep out of the part.
absl::StatusOr<storage::ProgramFetchRow> FetchOf(const v1::FetchProgramRequest& request,
                                                 const storage::CorrectionRow& correction,
                                                 const registration::v1::Registration& registration,
                                                 const clients::BladePeers& peers, const runtime::Caller& caller);

v1::FetchProgramResponse ResponseOf(const storage::ProgramFetchRow& fetch, const storage::CorrectionRow& correction);

}  // namespace sixpoint::correction
