// Recorded registrations as messages.
#pragma once

#include <absl/status/statusor.h>

#include "sixpoint/registration/v1/registration.pb.h"
#include "storage/registrations.h"

namespace sixpoint::registration {

// DATA_LOSS: what was kept as JSON cannot be read.
absl::StatusOr<v1::Registration> ToProto(const storage::RegistrationRow& row);

// What a list's BASIC view has of it.
void LeaveBasic(v1::Registration* registration);

}  // namespace sixpoint::registration
