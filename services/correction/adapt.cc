#include "services/correction/adapt.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "metrology/milling/removal_difference.h"
#include "metrology/reconstruction/adapt_path.h"
#include "metrology/reconstruction/deformed_surface.h"
#include "services/correction/shape.h"
#include "services/runtime/errors.h"
#include "services/runtime/recorded_results.h"
#include "services/runtime/resource_name.h"

namespace sixpoint::correction {
namespace {

using Eigen::Vector3d;

// Of the dexels: stock above the surface in which a path is looked at, how far below it, and what counts as cutting to it.
constexpr double kStock_mm = 1, kDepth_mm = 2, kTouch_mm = 0.1;
// What a pass left is the mean of the patches so far about a place, in their widths.
constexpr double kReachOfPatch = 3;

absl::Status CheckRow(const storage::ReconstructionRow& row, const Inputs& inputs) {
  const std::string& name = inputs.asked.reconstruction();
  if (row.outcome != "RECONSTRUCTED")
    return runtime::Refuse("reconstruction", name + " is " + row.outcome, "one that found a shape");
  if (!row.of_part_limits)
    return runtime::Refuse("reconstruction", name + " is of other limits than the part's", "one of the part's limits");
  // A pass's registration is a later one of the same part: its own was looked at.
  if (inputs.asked.machining_pass().empty() && row.registration_id != runtime::LastSegment(inputs.registration.name()))
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

std::vector<metrology::ToolPlace> PlacesOf(const std::vector<metrology::ToolPose>& poses) {
  std::vector<metrology::ToolPlace> places;
  for (const metrology::ToolPose& pose : poses) {
    metrology::ToolPlace& place = places.emplace_back();
    place.centre_mm = pose.tip_in_part_mm;
    place.axis = pose.axis_in_part;
  }
  return places;
}

// How much deeper than the shape a place of it is commanded, by what a pass left; nothing without one.
double Deeper_mm(const metrology::PassCompensation* compensation, const Vector3d& place_mm, const Vector3d& normal,
                 const Vector3d& displacement_mm) {
  return compensation == nullptr ? 0 : compensation->At(place_mm, normal, displacement_mm.dot(normal));
}

// Dexels of the design and of what is commanded that the template's tool could come upon.
absl::StatusOr<std::array<metrology::CutBeside, 2>> CutsOf(const Shape& shape,
                                                           const metrology::PassCompensation* compensation,
                                                           const ModelPath& path,
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
    const Vector3d normal = metrology::DeformedNormal(local->Jacobian(), place.normal);
    const double deeper_mm = Deeper_mm(compensation, place.point_mm, place.normal, local->displacement_mm);
    cuts[1].dexels.push_back({place.point_mm + local->displacement_mm - deeper_mm * normal, normal, kStock_mm});
  }
  return cuts;
}

// The tool goes deeper where it touches, as far as its path goes with the shape there.
absl::StatusOr<double> Deepen(const Shape& shape, const metrology::PassCompensation& compensation,
                              metrology::AdaptedToolPoint* moved) {
  const auto local = shape.deformation.At("part.cad", moved->contact_mm);
  if (!local.ok()) return local.status();
  const double deeper_mm =
      moved->part * Deeper_mm(&compensation, moved->contact_mm, moved->normal, local->displacement_mm);
  moved->tool.centre_mm -= deeper_mm * metrology::DeformedNormal(local->Jacobian(), moved->normal);
  return deeper_mm;
}

absl::Status AdaptOne(const Shape& shape, const metrology::PassCompensation* compensation, int threads,
                      ModelPath* path) {
  std::vector<metrology::ToolPoint> tools;
  for (const metrology::ToolPose& pose : path->nominal.poses) tools.push_back({pose.tip_in_part_mm, pose.axis_in_part});
  auto moved = metrology::AdaptPath(shape.design, shape.regions, shape.deformation, tools, shape.method.blend_mm);
  if (!moved.ok()) return Under("machining_model.paths[" + path->nominal.name + "].", moved.status());
  PathAdaptation adaptation;
  std::vector<metrology::ToolPose> adapted;
  for (std::size_t i = 0; i < tools.size(); ++i) {
    if (compensation != nullptr) {
      const auto deeper_mm = Deepen(shape, *compensation, &moved->at(i));
      if (!deeper_mm.ok()) return deeper_mm.status();
      adaptation.deepest_compensation_um =
          std::max(adaptation.deepest_compensation_um.value_or(1e3 * *deeper_mm), 1e3 * *deeper_mm);
    }
    const metrology::ToolPoint& tool = moved->at(i).tool;
    adapted.push_back({tool.centre_mm, tool.axis});
    adaptation.template_tips_mm.push_back(tools[i].centre_mm);
    adaptation.greatest_shift_mm = std::max(adaptation.greatest_shift_mm, (tool.centre_mm - tools[i].centre_mm).norm());
    adaptation.greatest_turn_rad = std::max(
        adaptation.greatest_turn_rad, std::atan2(tool.axis.cross(tools[i].axis).norm(), tool.axis.dot(tools[i].axis)));
  }
  const auto cuts = CutsOf(shape, compensation, *path, adapted);
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

// The pass that the request names, if it does: then its reconstruction is the request's.
absl::Status FindPass(const ShapeStores& stores, const runtime::Caller& caller, Inputs* inputs,
                      std::optional<storage::MachiningPassRow>* pass) {
  const std::string& name = inputs->asked.machining_pass();
  if (name.empty()) return absl::OkStatus();
  auto row =
      runtime::FindRow(*stores.passes, caller.deadline, "machining_passes", name, errors::v1::MACHINING_PASS_NOT_FOUND);
  if (!row.ok()) return row.status();
  if (row->outcome != "ANOTHER_PASS")
    return runtime::Refuse("machining_pass", name + " is " + row->outcome, "one after which another pass is due");
  if (row->registration_id != runtime::LastSegment(inputs->registration.name()))
    return runtime::Refuse("machining_pass", name + " is of " + runtime::NameOf("registrations", row->registration_id),
                           "one of " + inputs->registration.name());
  inputs->asked.set_reconstruction(runtime::NameOf("reconstructions", row->reconstruction_id));
  inputs->looked_at_up_to = row->recorded.sequence;
  *pass = *std::move(row);
  return absl::OkStatus();
}

// By what the pass left.
absl::StatusOr<metrology::PassCompensation> CompensationOf(const ShapeStores& stores, const Shape& shape,
                                                           const storage::MachiningPassRow& pass, int threads,
                                                           const runtime::Caller& caller) {
  const auto patches = stores.passes->Patches(pass.pass_id, caller.deadline);
  if (!patches.ok()) return patches.status();
  if (!patches->has_value() || pass.regions.size() != shape.regions.size())
    return absl::DataLossError("machining pass " + pass.pass_id +
                               ": want its patches, and its reconstruction's regions");
  std::vector<metrology::PassRegion> found(pass.regions.size());
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (pass.regions[i].offset_um) found[i].offset_mm = 1e-3 * *pass.regions[i].offset_um;
    found[i].deflection_share = pass.regions[i].deflection_share;
  }
  return metrology::PassCompensation(shape.regions, found, AboveShape(shape, PatchesOf(**patches), threads),
                                     kReachOfPatch * shape.method.patch_mm);
}

}  // namespace

absl::Status AdaptToShape(const ShapeStores& stores, const clients::BladePeers& peers, int threads,
                          const runtime::Caller& caller, Inputs* inputs) {
  std::optional<storage::MachiningPassRow> pass;
  if (absl::Status found = FindPass(stores, caller, inputs, &pass); !found.ok()) return found;
  const std::string& name = inputs->asked.reconstruction();
  if (name.empty()) return absl::OkStatus();
  const auto row = runtime::FindRow(*stores.reconstructions, caller.deadline, "reconstructions", name,
                                    errors::v1::RECONSTRUCTION_NOT_FOUND);
  if (!row.ok()) return row.status();
  if (absl::Status good = CheckRow(*row, *inputs); !good.ok()) return good;
  if (absl::Status good = CheckPaths(*inputs); !good.ok()) return good;
  const auto surface = peers.plant.GetSurface(inputs->part, caller.make_context(), caller.keep_going);
  if (!surface.ok()) return surface.status();
  const auto shape = ShapeOf(*stores.reconstructions, *row, *surface, threads, caller);
  if (!shape.ok()) return shape.status();
  std::optional<metrology::PassCompensation> compensation;
  if (pass.has_value()) {
    auto made = CompensationOf(stores, *shape, *pass, threads, caller);
    if (!made.ok()) return made.status();
    compensation = *std::move(made);
  }
  for (ModelPath& path : inputs->paths) {
    if (!caller.keep_going()) return absl::CancelledError("paths: the client went away");
    const absl::Status adapted = AdaptOne(*shape, compensation ? &*compensation : nullptr, threads, &path);
    if (!adapted.ok()) return adapted;
  }
  if (inputs->surface == nullptr) return absl::OkStatus();  // nothing is kept clear of
  auto deformed = metrology::DeformedSurface(**surface, shape->deformation);
  if (!deformed.ok()) return deformed.status();
  inputs->surface = *std::move(deformed);
  return absl::OkStatus();
}

}  // namespace sixpoint::correction
