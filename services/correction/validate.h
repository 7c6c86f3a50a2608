// Pure checks of what clients send.
#pragma once

#include <absl/status/status.h>

#include "sixpoint/correction/v1/correction.pb.h"

namespace sixpoint::correction {

// Refuses bad names, repeated groups, and offsets that no control has.
absl::Status CheckCorrect(const v1::CorrectRequest& request);

}  // namespace sixpoint::correction
