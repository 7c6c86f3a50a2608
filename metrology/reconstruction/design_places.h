// Places of a design's surface, near enough to each other that what is asked of each holds between them too. Made once for a part.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "metrology/surface/surface.h"

namespace sixpoint::metrology {

struct DesignPlace {
  Eigen::Vector3d point_mm = Eigen::Vector3d::Zero();  // on the surface, part frame
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();   // outward, unit
  double area_mm2 = 0;
  std::uint32_t triangle = Surface::kNoTriangle;
};

struct DesignPlaces {
  std::shared_ptr<const Surface> surface;
  double spacing_mm = 0;
  std::vector<DesignPlace> places;
};

// One in each cell of this width, for each side that its normals look to. INVALID_ARGUMENT "spacing_mm" as SurfacePatches' patch_mm.
absl::StatusOr<DesignPlaces> SampleDesign(std::shared_ptr<const Surface> surface, double spacing_mm, int threads);

}  // namespace sixpoint::metrology
