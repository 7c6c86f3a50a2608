#include "services/correction/shape.h"

#include <algorithm>
#include <utility>

#include "metrology/reconstruction/blank_stock.h"
#include "services/correction/lattice_bytes.h"
#include "services/correction/reconstruct.h"
#include "services/correction/reconstruction_order.h"
#include "services/correction/reconstruction_rows.h"
#include "services/runtime/units.h"

namespace sixpoint::correction {

absl::StatusOr<Shape> ShapeOf(const storage::ReconstructionStore& reconstructions,
                              const storage::ReconstructionRow& row, std::shared_ptr<const metrology::Surface> surface,
                              int threads, const runtime::Caller& caller) {
  const auto bytes = reconstructions.Lattice(row.lattice_sha256, caller.deadline);
  if (!bytes.ok()) return bytes.status();
  auto deformation = DeformationOf(*bytes);
  if (!deformation.ok()) return deformation.status();
  auto design = metrology::SampleDesign(std::move(surface), kPlacesOfPatch * row.applied.patch_mm, threads);
  if (!design.ok()) return design.status();
  std::vector<metrology::ShapeRegion> regions;
  for (const storage::ReconstructionRegionRow& region : row.regions) regions.push_back(KernelOf(region.applied));
  return Shape{*std::move(design), std::move(regions), *std::move(deformation), row.applied};
}

std::vector<metrology::BlankPatch> PatchesOf(const storage::BlankPatchesRow& row) {
  std::vector<metrology::BlankPatch> patches(row.stock_um.size());
  for (std::size_t i = 0; i < patches.size(); ++i) {
    patches[i].point_mm = Eigen::Vector3d(row.points_in_part_mm.data() + 3 * i);
    patches[i].normal = Eigen::Vector3d(row.normals_in_part.data() + 3 * i);
    patches[i].standard_uncertainty_mm = runtime::kMmPerUm * row.expanded_uncertainties_um[i] / kPatchCoverage;
  }
  return patches;
}

std::vector<metrology::PassPatch> AboveShape(const Shape& shape, const std::vector<metrology::BlankPatch>& patches,
                                             int threads, std::vector<std::size_t>* index) {
  const auto feet = metrology::FeetOfBlank(*shape.design.surface, &shape.deformation, patches,
                                           FarthestStock_mm(shape.method, shape.regions), threads);
  std::vector<metrology::PassPatch> above;
  for (std::size_t i = 0; i < feet.size(); ++i) {
    if (!feet[i]) continue;
    metrology::PassPatch& patch = above.emplace_back();
    patch.place_mm = feet[i]->place_mm;
    patch.normal = feet[i]->design_normal;
    patch.region = metrology::RegionAt(shape.regions, patch.place_mm, patch.normal);
    patch.rest_mm = feet[i]->distance_mm;
    patch.moved_mm = feet[i]->displacement_mm.dot(patch.normal);
    patch.standard_uncertainty_mm = patches[i].standard_uncertainty_mm;
    if (index != nullptr) index->push_back(i);
  }
  return above;
}

}  // namespace sixpoint::correction
