// The point laser probe's documents and its report.
#pragma once

#include <absl/status/statusor.h>

#include <string>

#include "cli/command_line.h"
#include "cli/document.h"
#include "cli/session.h"
#include "sixpoint/calibration/v1/calibration.pb.h"

namespace sixpoint::cli {

// docs/examples/probe_readings.yaml; machine, method and request_id are left to the caller.
calibration::v1::CalibrateProbeRequest ReadProbeReadings(const Field& root);
absl::StatusOr<calibration::v1::CalibrateProbeRequest> LoadProbeReadings(const std::string& path);

std::string ProbeText(const calibration::v1::ProbeCalibration& probe);

// One of calibrate's.
void AddCalibrateProbeCommand(Command* calibrate, Session* session);

}  // namespace sixpoint::cli
