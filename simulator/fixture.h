// Several places for parts of one kind in one fixture, and what stands at the others while one is scanned.
#pragma once

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "simulator/blade.h"
#include "simulator/machine.h"

namespace sixpoint::simulator {

// Two stations: "left", where the part stands as it is drawn, and "right", farther out along the span and turned about it.
inline constexpr char kLeftStation[] = "left", kRightStation[] = "right";
std::vector<DesignedStation> UsualStations(const DesignedPart& part);

// The part as it is drawn to stand there. INVALID_ARGUMENT for a station that it does not have, and for none where it has some.
absl::StatusOr<DesignedPart> AtStation(const DesignedPart& part, const std::string& station);

// zero_from_part of the blades at its other stations, each clamped a little wrong.
std::vector<Eigen::Isometry3d> NeighboursByHand(const DesignedPart& part, const std::string& station, double shift_mm,
                                                double turn_deg, std::uint64_t seed);

// A strip over one part that goes on over the ends of those beside it.
ScanPlan OverNeighbours(const ScanPlan& strip);

}  // namespace sixpoint::simulator
