// A kept reconstruction's shape as kernels take it.
#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <vector>

#include "metrology/reconstruction/blank_patch.h"
#include "metrology/reconstruction/design_places.h"
#include "metrology/reconstruction/free_form_deformation.h"
#include "metrology/reconstruction/machined_pass.h"
#include "metrology/reconstruction/shape_regions.h"
#include "services/runtime/call.h"
#include "storage/reconstructions.h"

namespace sixpoint::correction {

struct Shape {
  metrology::DesignPlaces design;
  std::vector<metrology::ShapeRegion> regions;
  metrology::FreeFormDeformation deformation;
  storage::ReconstructionMethodRow method;
};

// NOT_FOUND, DATA_LOSS. row: of one that found a shape.
absl::StatusOr<Shape> ShapeOf(const storage::ReconstructionStore& reconstructions,
                              const storage::ReconstructionRow& row, std::shared_ptr<const metrology::Surface> surface,
                              int threads, const runtime::Caller& caller);

// Kept patches as they were measured.
std::vector<metrology::BlankPatch> PatchesOf(const storage::BlankPatchesRow& row);

// What stands above the shape, patch by patch; those whose wall it does not have are left out. index: of the patches, of each.
std::vector<metrology::PassPatch> AboveShape(const Shape& shape, const std::vector<metrology::BlankPatch>& patches,
                                             int threads, std::vector<std::size_t>* index = nullptr);

}  // namespace sixpoint::correction
