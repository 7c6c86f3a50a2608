// The shape that a registered blank contains, by kernels alone: scans in, a shape or a proof out.
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <vector>

#include "metrology/reconstruction/measured_blank.h"
#include "metrology/reconstruction/reconstruct_shape.h"
#include "services/clients/registered_blade.h"
#include "services/correction/reconstruction_order.h"
#include "services/runtime/call.h"

namespace sixpoint::correction {

// Places of the design stand nearer to each other than patches of the blank, so that no limit is asked between two of them.
inline constexpr double kPlacesOfPatch = 0.75;

// A patch farther from the design is of something else: points are no farther, and the shape no farther than its bands.
double FarthestStock_mm(const storage::ReconstructionMethodRow& method,
                        const std::vector<metrology::ShapeRegion>& regions);

// What the registration's scans show of the surface.
struct MeasuredSurface {
  std::vector<metrology::BlankPatch> patches;
  metrology::BlankCounts counts;
};
// FAILED_PRECONDITION: nothing of the part was seen; INVALID_ARGUMENT: pins stand in it.
absl::StatusOr<MeasuredSurface> MeasureSurface(const clients::ScanClient& scans, const clients::RegisteredBlade& blade,
                                               const storage::ReconstructionMethodRow& method, int threads,
                                               const runtime::Caller& caller);

struct ReconstructedBlank {
  std::vector<metrology::BlankPatch> blank;
  std::vector<std::size_t> region_of;           // of each patch, in AppliedRegions
  std::vector<std::optional<double>> stock_mm;  // of each patch, outside the shape or, where there is none, the design
  metrology::BlankCounts counts;
  metrology::Reconstruction found;
};

// INVALID_ARGUMENT under the request's names; FAILED_PRECONDITION: nothing of the part was seen, or pins stand in it.
absl::StatusOr<ReconstructedBlank> ReconstructBlank(const clients::ScanClient& scans,
                                                    const clients::RegisteredBlade& blade,
                                                    const ReconstructionOrder& order, const AppliedRegions& regions,
                                                    int threads, const runtime::Caller& caller);

}  // namespace sixpoint::correction
