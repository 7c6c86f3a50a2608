// Pure checks of what clients send.
#pragma once

#include <absl/status/status.h>

#include <cstddef>

#include "sixpoint/correction/v1/correction.pb.h"

namespace sixpoint::correction {

inline constexpr std::size_t kGreatestTemplate_bytes = 1 << 20;

// Refuses bad names and ids, repeated groups, a template that is too large or not text.
absl::Status CheckCorrect(const v1::CorrectRequest& request);

}  // namespace sixpoint::correction
