// The sections of a registered blade, by kernels alone: scans in, findings out.
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <string>
#include <vector>

#include "metrology/inspection/blade_inspection.h"
#include "metrology/sections/section_uncertainty.h"
#include "metrology/sections/span.h"
#include "services/clients/registered_blade.h"
#include "services/inspection/section_order.h"

namespace sixpoint::inspection {

// A value with the reason where there is none.
struct SpanFinding {
  std::optional<double> nominal, value;  // mm, rad
  double expanded = 0;
  std::string reason;
};

struct SectionFinding {
  metrology::SectionOutline nominal;
  metrology::SectionValues nominal_values;
  metrology::OutlineEvidence evidence;
  std::string reason;  // why there is no outline; else empty
  std::optional<metrology::SectionOutline> measured;
  metrology::MeasuredSection values;                       // of it
  std::optional<SpanFinding> twist, bow_x, bow_y, throat;  // of what was asked for
};

// set_aside: where pins stand. In the order's order. INVALID_ARGUMENT: a plane that misses the part, or cuts it several times. What points do not show is a finding.
absl::StatusOr<std::vector<SectionFinding>> MeasureSections(const clients::ScanClient& scans,
                                                            const clients::RegisteredBlade& blade,
                                                            std::vector<metrology::HoleRegion> set_aside,
                                                            const SectionOrder& order, int thread_count,
                                                            const runtime::Caller& caller);

}  // namespace sixpoint::inspection
