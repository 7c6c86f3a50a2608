// What people write about a calibration, as messages: touch data, sphere poses, axis runs, a standard's probing (docs/examples/*.yaml, and the
// same words in a plant's dataset.json).
#pragma once

#include <absl/status/statusor.h>

#include <array>
#include <string>
#include <vector>

#include "cli/document.h"
#include "sixpoint/calibration/v1/calibration.pb.h"

namespace sixpoint::cli {

// {centres: {C1: [x, y, z], ...}, plane, side_x, side_y}, machine frame, mm.
calibration::v1::TouchData ReadTouchData(const Field& touch);
// [{a_deg, b_deg, centre_mm, use: fit | check}, ...], with the machine's letters of the axis on the bed and of the one that it
// carries.
using AxisPair = std::array<std::string, 2>;
std::vector<calibration::v1::SpherePose> ReadSpherePoses(const Field& poses, const AxisPair& axes = {"A", "B"});

// The document itself or, in a plant's dataset, its touch_probe / sphere_poses.
absl::StatusOr<calibration::v1::TouchData> LoadTouchData(const std::string& path);
absl::StatusOr<std::vector<calibration::v1::SpherePose>> LoadSpherePoses(const std::string& path,
                                                                         const AxisPair& axes = {"A", "B"});
// {commanded_deg, measured_deg or error_deg, direction (1 or -1; optional)}, lists; in a dataset, axis_runs of that axis.
calibration::v1::AxisRun ReadAxisRun(const Field& run);
absl::StatusOr<calibration::v1::AxisRun> LoadAxisRun(const std::string& path, const std::string& axis);
// {bore_mm, face_mm, face_above_centre_mm}.
absl::StatusOr<calibration::v1::StandardProbing> LoadStandardProbing(const std::string& path);

}  // namespace sixpoint::cli
