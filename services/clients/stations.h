// Where a blade stands that shares its fixture with others of its part (plant.v1 Part.stations).
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "metrology/frames/pose.h"
#include "sixpoint/plant/v1/part.pb.h"

namespace sixpoint::clients {

// INVALID_ARGUMENT unless it is a station of the part, or empty where the part has none. field: where it is named.
absl::Status CheckStation(const std::string& field, const std::string& station, const plant::v1::Part& part);

// zero_from_part of the nominal part: there, or where the part has no stations as its record has it. INVALID_ARGUMENT as above.
absl::StatusOr<Eigen::Isometry3d> NominalPoseAt(const std::string& field, const std::string& station,
                                                const plant::v1::Part& part);

// zero_from_part of the nominal parts at the others.
absl::StatusOr<std::vector<Eigen::Isometry3d>> NeighboursOf(const std::string& station, const plant::v1::Part& part);

}  // namespace sixpoint::clients
