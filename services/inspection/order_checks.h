// What orders of deviation maps and of sections are held to alike.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <set>
#include <string>

namespace sixpoint::inspection {

std::string At(const char* field, int index);

// 1 to 200 bytes without control characters, not used before; `before` has it from then on.
absl::Status CheckCalled(const std::string& field, const std::string& called, std::set<std::string>* before);

// As far as the record keeps places.
absl::Status CheckCorner(const std::string& field, const absl::StatusOr<Eigen::Vector3d>& corner_mm);

}  // namespace sixpoint::inspection
