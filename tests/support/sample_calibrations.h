// Results of calibrations that hold every constraint and say nothing of any machine: whose they are, since when and for how long, a test
// says itself.
#pragma once

#include "storage/calibrations.h"

namespace sixpoint::testing {

// Only what its kind has: method and result.
storage::CalibrationRow SampleSensorCalibration();
storage::CalibrationRow SampleRotationCalibration();

}  // namespace sixpoint::testing
