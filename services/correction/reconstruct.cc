#include "services/correction/reconstruct.h"

#include <string>
#include <utility>

#include "metrology/reconstruction/blank_stock.h"
#include "metrology/reconstruction/design_places.h"
#include "services/runtime/errors.h"

namespace sixpoint::correction {
namespace {

// Places of the design stand nearer to each other than patches of the blank, so that no limit is asked between two of them.
constexpr double kPlacesOfPatch = 0.75;

metrology::ReconstructionOptions OptionsOf(const storage::ReconstructionMethodRow& method, int threads,
                                           const runtime::Caller& caller) {
  metrology::ReconstructionOptions options;
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

absl::Status ReadScans(const clients::ScanClient& scans, const clients::RegisteredBlade& blade,
                       const runtime::Caller& caller, metrology::MeasuredBlank* blank) {
  return clients::ForEachScan(scans, blade, caller, [&](int index, const clients::StoredBlocks& scan) -> absl::Status {
    if (scan.record.header().kind() == ingest::v1::SCAN_KIND_PINS)
      return runtime::Refuse("registration.scans[" + std::to_string(index) + "]", "a scan with pins in the holes",
                             "scans of the blank alone");
    absl::Status status = blank->Begin(scan.scan);
    for (std::size_t i = 0; status.ok() && i < scan.blocks.size(); ++i) {
      const auto points_mm = scan.DecodeOne(i);
      if (!points_mm.ok()) return points_mm.status();
      status = blank->AddPoints(*points_mm);
    }
    return status;
  });
}

}  // namespace

absl::StatusOr<ReconstructedBlank> ReconstructBlank(const clients::ScanClient& scans,
                                                    const clients::RegisteredBlade& blade,
                                                    const ReconstructionOrder& order, const AppliedRegions& regions,
                                                    int threads, const runtime::Caller& caller) {
  const storage::ReconstructionMethodRow& method = order.method;
  const metrology::ReconstructionOptions options = OptionsOf(method, threads, caller);
  const absl::Status fits = CheckLatticeSize(blade.surface->minimum_mm(), blade.surface->maximum_mm(), options.reach_mm,
                                             options.finest_spacing_mm);
  if (!fits.ok()) return fits;
  const auto design = metrology::SampleDesign(blade.surface, kPlacesOfPatch * method.patch_mm, threads);
  if (!design.ok()) return AsAsked(design.status());
  const auto patches = metrology::SurfacePatches::Make(*blade.surface, method.patch_mm);
  if (!patches.ok()) return AsAsked(patches.status());
  // Before the scans are read.
  if (const auto assigned = metrology::AssignRegions(*design, regions.kernel); !assigned.ok())
    return AsAsked(assigned.status());
  metrology::MeasuredBlankOptions blank_options;
  blank_options.threads = threads;
  blank_options.keep_going = caller.keep_going;
  blank_options.farthest_mm = method.farthest_mm;
  metrology::MeasuredBlank measured(blade.surface, metrology::PartMapping(*blade.pose, blade.sensor, blade.axes),
                                    blank_options);
  if (absl::Status read = ReadScans(scans, blade, caller, &measured); !read.ok()) return read;
  auto blank = measured.Finish(*patches);
  if (!blank.ok()) return blank.status();
  ReconstructedBlank made;
  made.blank = *std::move(blank);
  made.counts = measured.counts();
  auto found = metrology::ReconstructShape(*design, made.blank, regions.kernel, options);
  if (!found.ok()) return AsAsked(found.status());
  made.found = *std::move(found);
  made.stock_mm = metrology::StockOver(*blade.surface, made.found.deformation ? &*made.found.deformation : nullptr,
                                       made.blank, options.greatest_stock_mm, threads);
  for (const metrology::BlankPatch& patch : made.blank) {
    const metrology::SurfacePoint on = blade.surface->Closest(patch.point_mm);
    made.region_of.push_back(metrology::RegionAt(regions.kernel, on.point_mm, patch.normal));
  }
  return made;
}

}  // namespace sixpoint::correction
