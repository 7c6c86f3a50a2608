// What the calibration service tells of the machines' calibrations to whoever watches (docs/observing.md).
#pragma once

#include <memory>

#include "services/runtime/sampler.h"

namespace sixpoint::calibration {

// A plant has a few hundred machines, each with some four; more are not told of.
inline constexpr int kMostAges = 1000;
std::unique_ptr<runtime::Sampled> CalibrationsSampled();

}  // namespace sixpoint::calibration
