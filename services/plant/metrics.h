// What the plant service tells of the record to whoever watches (docs/observing.md).
#pragma once

#include <memory>

#include "services/runtime/sampler.h"

namespace sixpoint::plant {

std::unique_ptr<runtime::Sampled> RecordSampled();

}  // namespace sixpoint::plant
