// Which sweeps see a region of a part: the ones that add most, until enough of it is seen.
//
// Frames and units as in plan_scene.h. The same inputs give the same sweeps on any number of threads.
#pragma once

#include <absl/status/statusor.h>

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "metrology/measuring_plan/plan_scene.h"
#include "metrology/measuring_plan/portion.h"
#include "metrology/measuring_plan/surface_samples.h"

namespace sixpoint::metrology {

// What becomes of a piece of the surface; of what is not seen the first that holds.
enum class Seen {
  kSeen,
  kLeftOut,       // some sweep would see it: enough was seen without it, or it would add next to nothing
  kClearance,     // whatever sees it has the housing too near to the part
  kTravel,        // whatever sees it takes a linear axis beyond its limits
  kHidden,        // at no angles that were tried does a beam come to it past the part
  kRotaryLimits,  // only angles beyond the rotary axes' limits turn it towards the scanner
  kTooSteep,      // no angles do
};
inline constexpr int kSeenCount = 7;

struct RegionToSee {
  std::string name;
  SurfaceSamples samples;
  // Towards the scanner: the beam along each of them, the first preferred where they see as much.
  std::vector<Eigen::Vector3d> directions_in_part;
  // Where the field holds all of the region at once, the sweep's middle passes over this place; none: wherever it comes.
  std::optional<Eigen::Vector3d> centre_in_part_mm;
};

struct RegionCoverage {
  std::string name;
  double wanted_mm2 = 0;
  std::array<double, kSeenCount> area_mm2{};  // by Seen; their sum is what is wanted
  double Share() const { return area_mm2[0] / wanted_mm2; }
};

struct RegionSweeps {
  RegionCoverage coverage;
  std::vector<PlannedPortion> portions;  // in the order in which they were found
};

// Strips that are looked at, at most, all pairs of angles together. A part as long as 16 fields and as thick as 5 has not so many.
inline constexpr std::size_t kMostStrips = 60'000;

// INVALID_ARGUMENT: a region with no surface; a part so large for the field that kMostStrips are not enough. CANCELLED where keep_going says no.
// most_portions: of this region.
absl::StatusOr<RegionSweeps> CoverRegion(const PlanScene& scene, const PortionPlacer& placer, const RegionToSee& region,
                                         int most_portions);

}  // namespace sixpoint::metrology
