// What a part's record says of its surface for a reconstruction: which of it is machined, which follows the blank, which stands.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <string>
#include <vector>

#include "metrology/inspection/surface_patches.h"
#include "metrology/reconstruction/design_places.h"

namespace sixpoint::metrology {

enum class RegionKind : std::uint8_t {
  kMachined,  // is cut: the blank must stand outside
  kFixed,     // stays as the blank is
  kDatum,     // does not move
};

struct ShapeRegion {
  std::string name;
  SurfaceRegion where;
  bool rest = false;  // instead: whatever no other region has
  RegionKind kind = RegionKind::kMachined;
  double allowance_mm = 0;                 // of a machined one: stock that is wanted outside the shape
  double lower_mm = -0.1, upper_mm = 0.1;  // profile tolerance, of the shape beside the design; a datum's is not read
};

// How far a region's limits may be from 0.
inline constexpr double kGreatestBand_mm = 5;

// INVALID_ARGUMENT, by name: "regions" none, more than 255, two with the rest, or none machined; "regions[i].lower_mm" above the upper or out of
// range; "regions[i].allowance_mm"; what is not finite.
absl::Status CheckRegions(const std::vector<ShapeRegion>& regions);

// The region of each place. INVALID_ARGUMENT "regions[i]": it overlaps another of a different kind or with other limits; "regions": places that are in none.
absl::StatusOr<std::vector<std::uint8_t>> AssignRegions(const DesignPlaces& design,
                                                        const std::vector<ShapeRegion>& regions);
// Of a place of the surface, of regions that AssignRegions took: the first that has it, or the rest; regions.size() where none has.
std::size_t RegionAt(const std::vector<ShapeRegion>& regions, const Eigen::Vector3d& place_mm,
                     const Eigen::Vector3d& normal);

}  // namespace sixpoint::metrology
