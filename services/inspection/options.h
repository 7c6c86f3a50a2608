// How much a service that computes from scans does at once.
#pragma once

#include "services/runtime/compute_pool.h"

namespace sixpoint::inspection {

struct InspectionServiceOptions {
  runtime::PoolLimits pool{2, runtime::kAllLetIn};  // inspections, or maps, at once; more are RESOURCE_EXHAUSTED
  int threads = 2;                                  // compute threads of each
};

}  // namespace sixpoint::inspection
