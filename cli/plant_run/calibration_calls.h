// The calibrations of a data set's machine, each one call (axes: one each).
#pragma once

#include <absl/status/status.h>

#include <string>
#include <vector>

#include "cli/plant_run/dataset.h"
#include "cli/session.h"

namespace sixpoint::cli {

absl::Status CalibrateSensor(Session* session, const Dataset& dataset, const std::vector<std::string>& scans,
                             calibration::v1::Calibration* out);
// Of the axes that the data set has runs of, by which its tables are applied; nothing where it has none.
absl::Status CharacteriseAxes(Session* session, const Dataset& dataset);
absl::Status CalibrateRotation(Session* session, const Dataset& dataset, calibration::v1::Calibration* out);
// What the sensor's arm repeats, counted from that calibration.
absl::Status StudyArm(Session* session, const std::vector<std::string>& scans, const std::string& sensor_calibration);

}  // namespace sixpoint::cli
