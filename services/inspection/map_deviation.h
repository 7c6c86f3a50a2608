// A registered blade's deviation map, computed: scan by scan, no more of one in memory than is looked at.
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <string>
#include <vector>

#include "metrology/cloud/deviation_cloud.h"
#include "metrology/inspection/deviation_map.h"
#include "metrology/inspection/profile.h"
#include "services/clients/registered_blade.h"
#include "services/clients/scans.h"
#include "services/inspection/deviation_order.h"
#include "services/runtime/call.h"

namespace sixpoint::inspection {

struct DeviationBlock {
  int scan = 0;  // of the registration's
  std::int64_t point_count = 0;
  metrology::EncodedDeviations encoded;
};

struct MappedDeviation {
  metrology::DeviationField field;
  std::vector<std::vector<std::uint32_t>> regions;  // patches: of the whole surface, then of the order's
  std::vector<metrology::ProfileFinding> profiles;  // of the order's
  std::vector<DeviationBlock> cloud;                // empty: not asked for
};

// set_aside: where pins stand. FAILED_PRECONDITION: nothing of the part was seen.
absl::StatusOr<MappedDeviation> MapDeviation(const clients::ScanClient& scans, const clients::RegisteredBlade& blade,
                                             std::vector<metrology::HoleRegion> set_aside, const DeviationOrder& order,
                                             int thread_count, const runtime::Caller& caller);

}  // namespace sixpoint::inspection
