#include "services/correction/reconstruct.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "metrology/reconstruction/blank_stock.h"
#include "metrology/reconstruction/design_places.h"
#include "services/clients/error_sources.h"
#include "services/correction/blade_points.h"
#include "services/runtime/errors.h"

namespace sixpoint::correction {
namespace {

// What a casting's form does to the pose moves blank and shape alike: the shape is cut where this pose has it. The rest of what the pose is uncertain
// by does so too, but is small.
metrology::RegisteredPose WithoutForm(metrology::RegisteredPose pose) {
  const auto is_form = [](const metrology::ErrorSource& source) { return clients::IsFormOfBlade(source.name); };
  pose.sources.erase(std::remove_if(pose.sources.begin(), pose.sources.end(), is_form), pose.sources.end());
  return pose;
}

metrology::ReconstructionOptions OptionsOf(const storage::ReconstructionMethodRow& method,
                                           const std::vector<metrology::ShapeRegion>& regions, int threads,
                                           const runtime::Caller& caller) {
  metrology::ReconstructionOptions options;
  options.greatest_stock_mm = FarthestStock_mm(method, regions);
  options.threads = threads;
  options.keep_going = caller.keep_going;
  options.patch_mm = method.patch_mm;
  options.coarsest_spacing_mm = method.coarsest_spacing_mm;
  options.finest_spacing_mm = method.finest_spacing_mm;
  options.blend_mm = method.blend_mm;
  options.coverage_factor = method.coverage_factor;
  return options;
}

// What a kernel calls options.x is method.x here, its regions are the part's, and its spacing follows from patch_mm.
absl::Status AsAsked(const absl::Status& status) {
  std::vector<Violation> violations = ViolationsOf(status);
  if (violations.empty()) return status;
  for (Violation& violation : violations) {
    if (violation.field.rfind("options.", 0) == 0) violation.field.replace(0, 7, "method");
    if (violation.field.rfind("regions", 0) == 0) violation.field.insert(0, "part.shape_");
    if (violation.field == "spacing_mm" || violation.field == "patch_mm") violation.field = "method.patch_mm";
  }
  return Refuse(violations);
}

}  // namespace

double FarthestStock_mm(const storage::ReconstructionMethodRow& method,
                        const std::vector<metrology::ShapeRegion>& regions) {
  double farthest_mm = method.farthest_mm;
  for (const metrology::ShapeRegion& region : regions)
    farthest_mm =
        std::max(farthest_mm, method.farthest_mm + std::max(std::abs(region.lower_mm), std::abs(region.upper_mm)));
  return farthest_mm;
}

absl::StatusOr<MeasuredSurface> MeasureSurface(const clients::ScanClient& scans, const clients::RegisteredBlade& blade,
                                               const storage::ReconstructionMethodRow& method, int threads,
                                               const runtime::Caller& caller) {
  const auto patches = metrology::SurfacePatches::Make(*blade.surface, method.patch_mm);
  if (!patches.ok()) return AsAsked(patches.status());
  metrology::MeasuredBlankOptions options;
  options.threads = threads;
  options.keep_going = caller.keep_going;
  options.farthest_mm = method.farthest_mm;
  metrology::MeasuredBlank measured(
      blade.surface, metrology::PartMapping(WithoutForm(*blade.pose), blade.sensor, blade.axes), options);
  const absl::Status read = ReadBladePoints(
      scans, blade, caller, [&](const metrology::LineScan& scan) { return measured.Begin(scan); },
      [&](const metrology::Points& points_mm) { return measured.AddPoints(points_mm); });
  if (!read.ok()) return read;
  auto found = measured.Finish(*patches);
  if (!found.ok()) return found.status();
  return MeasuredSurface{*std::move(found), measured.counts()};
}

absl::StatusOr<ReconstructedBlank> ReconstructBlank(const clients::ScanClient& scans,
                                                    const clients::RegisteredBlade& blade,
                                                    const ReconstructionOrder& order, const AppliedRegions& regions,
                                                    int threads, const runtime::Caller& caller) {
  const storage::ReconstructionMethodRow& method = order.method;
  const metrology::ReconstructionOptions options = OptionsOf(method, regions.kernel, threads, caller);
  const absl::Status fits = CheckLatticeSize(blade.surface->minimum_mm(), blade.surface->maximum_mm(), options.reach_mm,
                                             options.finest_spacing_mm);
  if (!fits.ok()) return fits;
  const auto design = metrology::SampleDesign(blade.surface, kPlacesOfPatch * method.patch_mm, threads);
  if (!design.ok()) return AsAsked(design.status());
  // Before the scans are read.
  if (const auto assigned = metrology::AssignRegions(*design, regions.kernel); !assigned.ok())
    return AsAsked(assigned.status());
  auto measured = MeasureSurface(scans, blade, method, threads, caller);
  if (!measured.ok()) return measured.status();
  ReconstructedBlank made;
  made.blank = std::move(measured->patches);
  made.counts = measured->counts;
  auto found = metrology::ReconstructShape(*design, made.blank, regions.kernel, options);
  if (!found.ok()) return AsAsked(found.status());
  made.found = *std::move(found);
  const auto feet = metrology::FeetOfBlank(*blade.surface, made.found.deformation ? &*made.found.deformation : nullptr,
                                           made.blank, options.greatest_stock_mm, threads);
  for (std::size_t i = 0; i < feet.size(); ++i) {
    made.stock_mm.push_back(feet[i] ? std::optional<double>(feet[i]->distance_mm) : std::nullopt);
    // Where no wall looks alike, the nearest place's.
    const Eigen::Vector3d place_mm =
        feet[i] ? feet[i]->place_mm : blade.surface->Closest(made.blank[i].point_mm).point_mm;
    const Eigen::Vector3d normal = feet[i] ? feet[i]->design_normal : made.blank[i].normal;
    made.region_of.push_back(metrology::RegionAt(regions.kernel, place_mm, normal));
  }
  return made;
}

}  // namespace sixpoint::correction
