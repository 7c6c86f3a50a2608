// Checks that reports and first articles share. Each names the field that it refuses.
#pragma once

#include <absl/status/status.h>

#include <optional>
#include <string>

#include "report/report.h"

namespace sixpoint::report {

inline constexpr double kGreatestNumber = 1e9;

absl::Status CheckNumber(const std::string& field, std::optional<double> number);
// At least 0, besides.
absl::Status CheckSize(const std::string& field, std::optional<double> number);
absl::Status CheckUncertainty(const std::string& field, std::optional<double> uncertainty, bool measured);
absl::Status CheckCharacteristic(const std::string& at, const Characteristic& characteristic);

}  // namespace sixpoint::report
