// Pure checks of what clients send.
#pragma once

#include <absl/status/statusor.h>

#include <string>

#include "sixpoint/correction/v1/correction.pb.h"

namespace sixpoint::correction {

inline constexpr int kGreatestTemplate_bytes = 1 << 20;

// The registration's id. Refuses bad names and ids, repeated groups, a template that is too large or not text.
absl::StatusOr<std::string> CheckCorrect(const v1::CorrectRequest& request);

}  // namespace sixpoint::correction
