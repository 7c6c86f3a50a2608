// How far a machine's arm swings.
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>

#include "services/clients/calibrations.h"
#include "storage/studies.h"

namespace sixpoint::calibration {

// Of machines/{machine}, by its newest study; none: it was not studied.
absl::StatusOr<std::optional<clients::FetchedArmStudy>> NewestArm(const storage::StudyStore& studies,
                                                                  const std::string& machine,
                                                                  storage::Deadline deadline);

}  // namespace sixpoint::calibration
