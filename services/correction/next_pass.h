// What a pass over a blank left, by kernels alone: scans in, a decision out.
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <vector>

#include "metrology/reconstruction/machined_pass.h"
#include "metrology/reconstruction/measured_blank.h"
#include "services/clients/registered_blade.h"
#include "services/correction/shape.h"
#include "services/runtime/call.h"

namespace sixpoint::correction {

struct LeftByPass {
  std::vector<metrology::BlankPatch> patches;
  std::vector<std::optional<double>> rest_mm;  // of each, above the shape; unset: no wall looks alike
  std::vector<std::size_t> region_of;          // of each; as many as there are regions where it has none
  metrology::BlankCounts counts;
  metrology::JudgedPass judged;
};

// before: what stood there before the pass, the blank's patches or those that the pass before left. INVALID_ARGUMENT, FAILED_PRECONDITION as
// MeasureSurface.
absl::StatusOr<LeftByPass> LookAtPass(const clients::ScanClient& scans, const clients::RegisteredBlade& blade,
                                      const Shape& shape, const std::vector<metrology::BlankPatch>& before,
                                      const std::optional<double>& greatest_rest_mm, int threads,
                                      const runtime::Caller& caller);

}  // namespace sixpoint::correction
