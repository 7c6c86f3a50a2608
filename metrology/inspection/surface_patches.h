// A part's surface in patches, known before anybody measured: what was not seen can be told only beside what there is.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "metrology/surface/patch_key.h"
#include "metrology/surface/surface.h"

namespace sixpoint::metrology {

struct SurfacePatch {
  PatchKey key = 0;
  double area_mm2 = 0;
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();  // of its area, part frame
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();     // mean over its area, unit, outward
};

// A part of the surface.
struct SurfaceRegion {
  std::optional<Eigen::Vector3d> minimum_mm, maximum_mm;  // corners of a box, part frame; none: not bounded there
  std::optional<Eigen::Vector3d> facing;                  // unit; none: whatever a patch looks to
  double facing_within_rad = 1.0471975511965976;          // of a patch's normal

  bool Has(const Eigen::Vector3d& centre_mm, const Eigen::Vector3d& normal) const;
};

inline constexpr double kLeastPatch_mm = 0.1, kGreatestPatch_mm = 20;

class SurfacePatches {
 public:
  static constexpr std::uint32_t kNone = 0xffffffff;

  // INVALID_ARGUMENT with "patch_mm": not 0.1 to 20, or so small that the surface has more than 100,000, or cannot be sampled.
  static absl::StatusOr<SurfacePatches> Make(const Surface& surface, double patch_mm);

  double patch_mm() const { return patch_mm_; }
  // By growing key.
  const std::vector<SurfacePatch>& patches() const { return patches_; }
  // Of a point of the surface.
  PatchKey KeyOf(const Eigen::Vector3d& on_surface_mm, const Eigen::Vector3d& normal) const {
    return PatchKeyOf(on_surface_mm - centroid_mm_, normal, patch_mm_);
  }
  // The patch of that key; kNone: no sample of the surface fell there.
  std::uint32_t Of(PatchKey key) const;
  // Those whose middle and normal lie in the region, growing.
  std::vector<std::uint32_t> In(const SurfaceRegion& region) const;
  double area_mm2() const { return area_mm2_; }

 private:
  double patch_mm_ = 1, area_mm2_ = 0;
  Eigen::Vector3d centroid_mm_ = Eigen::Vector3d::Zero();
  std::vector<SurfacePatch> patches_;
  std::unordered_map<PatchKey, std::uint32_t> index_;
};

}  // namespace sixpoint::metrology
