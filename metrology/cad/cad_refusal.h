// How what is wrong with a CAD file is refused.
#pragma once

#include <absl/status/status.h>

#include <string>

#include "refusal/refusal.h"

namespace sixpoint::metrology {

inline absl::Status RefuseCad(const std::string& field, const std::string& value, const std::string& wanted) {
  return Refuse("cad." + field, value, wanted);
}

}  // namespace sixpoint::metrology
