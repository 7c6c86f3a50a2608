// What has become of a calibration, from its events and the clock (ADR 14).
#pragma once

#include <string>

#include "storage/calibrations.h"

namespace sixpoint::storage {

// in_force: the one of its subject at that moment; empty: none.
CalibrationState StateOf(const CalibrationRow& c, const std::string& in_force, Instant now);
// As the statements have it: "IN_FORCE".
const char* StateText(CalibrationState state);

}  // namespace sixpoint::storage
