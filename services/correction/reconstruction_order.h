// What a reconstruction is asked for, checked and as the kernel takes it.
#pragma once

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "metrology/reconstruction/reconstruct_shape.h"
#include "sixpoint/correction/v1/reconstruction.pb.h"
#include "sixpoint/plant/v1/part.pb.h"
#include "storage/reconstructions.h"

namespace sixpoint::correction {

struct ReconstructionOrder {
  storage::ReconstructionMethodRow method;
  std::vector<v1::TriedLimits> tried;
};

// The limits that the shape has to keep, region by region of the part.
struct AppliedRegions {
  std::vector<storage::ShapeRegionRow> rows;
  std::vector<metrology::ShapeRegion> kernel;
  bool of_part_limits = true;
};

metrology::ShapeRegion KernelOf(const storage::ShapeRegionRow& row);

// INVALID_ARGUMENT with all that is wrong with it.
absl::StatusOr<ReconstructionOrder> OrderOf(const v1::ReconstructRequest& request);

// The part's regions with what is tried instead. INVALID_ARGUMENT: a part without any; limits of a region that the part has not, that its kind does
// not have, or out of range.
absl::StatusOr<AppliedRegions> RegionsOf(const plant::v1::Part& part, const std::vector<v1::TriedLimits>& tried);

// INVALID_ARGUMENT "method.finest_spacing_mm": the lattice about a surface of these corners would take too much memory.
absl::Status CheckLatticeSize(const Eigen::Vector3d& minimum_mm, const Eigen::Vector3d& maximum_mm, double reach_mm,
                              double finest_spacing_mm);

}  // namespace sixpoint::correction
