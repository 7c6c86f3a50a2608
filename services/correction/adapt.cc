#include "services/correction/adapt.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "metrology/milling/removal_difference.h"
#include "metrology/reconstruction/adapt_path.h"
#include "metrology/reconstruction/deformed_surface.h"
#include "services/correction/lattice_bytes.h"
#include "services/correction/reconstruct.h"
#include "services/correction/reconstruction_order.h"
#include "services/runtime/errors.h"
#include "services/runtime/recorded_results.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::correction {
namespace {

using Eigen::Vector3d;

// Of the dexels: stock above the surface in which a path is looked at, how far below it, and what counts as cutting to it.
constexpr double kStock_mm = 1, kDepth_mm = 2, kTouch_mm = 0.1;

struct Shape {
  metrology::DesignPlaces design;
  std::vector<metrology::ShapeRegion> regions;
  metrology::FreeFormDeformation deformation;
  double strip_mm = 0;
};

absl::Status CheckRow(const storage::ReconstructionRow& row, const Inputs& inputs) {
  const std::string& name = inputs.asked.reconstruction();
  if (row.outcome != "RECONSTRUCTED")
    return runtime::Refuse("reconstruction", name + " is " + row.outcome, "one that found a shape");
  if (!row.of_part_limits)
    return runtime::Refuse("reconstruction", name + " is of other limits than the part's", "one of the part's limits");
  if (row.registration_id != runtime::LastSegment(inputs.registration.name()))
    return runtime::Refuse("reconstruction", name + " is of " + runtime::NameOf("registrations", row.registration_id),
                           "one of " + inputs.registration.name());
  return absl::OkStatus();
}

absl::Status CheckPaths(const Inputs& inputs) {
  const std::string& model = inputs.asked.machining_model();
  if (inputs.paths.empty())
    return runtime::Refuse("machining_model", model + " has no paths, or not all are asked for",
                           "a model whose paths go with the shape");
  if (!inputs.groups.empty())
    return runtime::Refuse("machining_model", model + " drills straight holes",
                           "paths alone: straight holes stand by the drawing, not by the shape");
  return absl::OkStatus();
}

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
  return Shape{*std::move(design), std::move(regions), *std::move(deformation), row.applied.blend_mm};
}

std::vector<metrology::ToolPlace> PlacesOf(const std::vector<metrology::ToolPose>& poses) {
  std::vector<metrology::ToolPlace> places;
  for (const metrology::ToolPose& pose : poses) {
    metrology::ToolPlace& place = places.emplace_back();
    place.centre_mm = pose.tip_in_part_mm;
    place.axis = pose.axis_in_part;
  }
  return places;
}

// Dexels of the design and of the shape that the template's tool could come upon.
absl::StatusOr<std::array<metrology::CutBeside, 2>> CutsOf(const Shape& shape, const ModelPath& path,
                                                           const std::vector<metrology::ToolPose>& adapted) {
  std::array<metrology::CutBeside, 2> cuts;
  cuts[0].places = PlacesOf(path.nominal.poses);
  cuts[1].places = PlacesOf(adapted);
  Eigen::AlignedBox3d near;
  for (const metrology::CutBeside& cut : cuts)
    for (const metrology::ToolPlace& place : cut.places)
      near.extend(place.centre_mm).extend(place.centre_mm + path.tool.length_mm * place.axis);
  const Vector3d reach = Vector3d::Constant(path.tool.diameter_mm / 2 + kStock_mm);
  const Eigen::AlignedBox3d reached(near.min() - reach, near.max() + reach);
  for (const metrology::DesignPlace& place : shape.design.places) {
    if (!reached.contains(place.point_mm)) continue;
    const auto local = shape.deformation.At("part.cad", place.point_mm);
    if (!local.ok()) return local.status();
    cuts[0].dexels.push_back({place.point_mm, place.normal, kStock_mm});
    cuts[1].dexels.push_back({place.point_mm + local->displacement_mm,
                              metrology::DeformedNormal(local->Jacobian(), place.normal), kStock_mm});
  }
  return cuts;
}

absl::Status AdaptOne(const Shape& shape, int threads, ModelPath* path) {
  std::vector<metrology::ToolPoint> tools;
  for (const metrology::ToolPose& pose : path->nominal.poses) tools.push_back({pose.tip_in_part_mm, pose.axis_in_part});
  const auto moved = metrology::AdaptPath(shape.design, shape.regions, shape.deformation, tools, shape.strip_mm);
  if (!moved.ok()) return Under("machining_model.paths[" + path->nominal.name + "].", moved.status());
  PathAdaptation adaptation;
  std::vector<metrology::ToolPose> adapted;
  for (std::size_t i = 0; i < tools.size(); ++i) {
    const metrology::ToolPoint& tool = moved->at(i).tool;
    adapted.push_back({tool.centre_mm, tool.axis});
    adaptation.template_tips_mm.push_back(tools[i].centre_mm);
    adaptation.greatest_shift_mm = std::max(adaptation.greatest_shift_mm, (tool.centre_mm - tools[i].centre_mm).norm());
    adaptation.greatest_turn_rad = std::max(
        adaptation.greatest_turn_rad, std::atan2(tool.axis.cross(tools[i].axis).norm(), tool.axis.dot(tools[i].axis)));
  }
  const auto cuts = CutsOf(shape, *path, adapted);
  if (!cuts.ok()) return cuts.status();
  const auto difference = metrology::CompareRemoval(
      (*cuts)[0], (*cuts)[1], {path->tool.diameter_mm / 2, path->tool.length_mm}, kDepth_mm, kTouch_mm, threads);
  if (!difference.ok()) return difference.status();
  adaptation.gouge_um = 1e3 * difference->deepest_mm;
  adaptation.rest_um = 1e3 * difference->most_rest_mm;
  path->nominal.poses = std::move(adapted);
  path->adaptation = std::move(adaptation);
  return absl::OkStatus();
}

}  // namespace

absl::Status AdaptToShape(const storage::ReconstructionStore& reconstructions, const clients::BladePeers& peers,
                          int threads, const runtime::Caller& caller, Inputs* inputs) {
  const std::string& name = inputs->asked.reconstruction();
  if (name.empty()) return absl::OkStatus();
  const auto row = runtime::GetResult<storage::ReconstructionRow>(
      reconstructions, caller.deadline, "reconstructions", name, errors::v1::RECONSTRUCTION_NOT_FOUND,
      [](const storage::ReconstructionRow& found) { return found; });
  if (!row.ok()) return row.status();
  if (absl::Status good = CheckRow(*row, *inputs); !good.ok()) return good;
  if (absl::Status good = CheckPaths(*inputs); !good.ok()) return good;
  const auto part =
      peers.plant.GetPart(inputs->registration.part(), inputs->registration.part_revision(), caller.make_context());
  if (!part.ok()) return part.status();
  const auto surface = peers.plant.GetSurface(*part, caller.make_context(), caller.keep_going);
  if (!surface.ok()) return surface.status();
  const auto shape = ShapeOf(reconstructions, *row, *surface, threads, caller);
  if (!shape.ok()) return shape.status();
  for (ModelPath& path : inputs->paths) {
    if (!caller.keep_going()) return absl::CancelledError("paths: the client went away");
    if (absl::Status adapted = AdaptOne(*shape, threads, &path); !adapted.ok()) return adapted;
  }
  if (inputs->surface == nullptr) return absl::OkStatus();  // nothing is kept clear of
  auto deformed = metrology::DeformedSurface(**surface, shape->deformation);
  if (!deformed.ok()) return deformed.status();
  inputs->surface = *std::move(deformed);
  return absl::OkStatus();
}

}  // namespace sixpoint::correction
