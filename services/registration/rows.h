// A registration that was computed as it is recorded: its row and its journal entry.
#pragma once

#include <absl/status/statusor.h>

#include <string>

#include "metrology/registration/register.h"
#include "services/registration/inputs.h"
#include "services/runtime/recorded_call.h"
#include "sixpoint/registration/v1/registration.pb.h"
#include "storage/registrations.h"

namespace sixpoint::registration {

// With a new id. seconds: of computing. The journal names all that it rests on: machine and part with their revisions, blade, calibrations, scans.
absl::StatusOr<runtime::Made<storage::RegistrationRow>> RecordOf(const v1::RegisterRequest& request,
                                                                 const Inputs& inputs,
                                                                 const metrology::Registered& registered,
                                                                 double seconds);

}  // namespace sixpoint::registration
