// What a deviation map is asked for, checked and as the kernel takes it.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <string>
#include <vector>

#include "metrology/inspection/profile.h"
#include "metrology/inspection/surface_patches.h"
#include "sixpoint/inspection/v1/deviation.pb.h"
#include "storage/decision_rules.h"

namespace sixpoint::inspection {

struct DeviationOrder {
  struct Region {
    std::string name;
    metrology::SurfaceRegion region;
  };
  struct Profile {
    std::string characteristic;
    std::size_t region = 0;  // 0: the whole surface, else 1 and the place in `regions`
    metrology::ProfileTolerance tolerance;
    storage::DecisionRuleRow rule;  // empty: none was asked for
  };
  double patch_mm = 1;
  std::vector<Region> regions;
  std::vector<Profile> profiles;
  bool without_cloud = false;
};

// INVALID_ARGUMENT with all that is wrong with it, under `field`.
absl::StatusOr<DeviationOrder::Region> KernelRegionOf(const std::string& field, const v1::SurfaceRegion& in);

// INVALID_ARGUMENT with all that is wrong with it.
absl::StatusOr<DeviationOrder> OrderOf(const v1::MapDeviationRequest& request);

// The patches of the whole surface, then of each region. INVALID_ARGUMENT: a region without any.
absl::StatusOr<std::vector<std::vector<std::uint32_t>>> PatchesOf(const DeviationOrder& order,
                                                                  const metrology::SurfacePatches& patches);

}  // namespace sixpoint::inspection
