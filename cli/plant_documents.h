// What people write about a plant, as messages: machine, part, artefact (docs/examples/*.yaml, and the same words in a
// plant's dataset.json), touch data and sphere poses.
#pragma once

#include <absl/status/statusor.h>

#include <array>
#include <string>
#include <vector>

#include "cli/document.h"
#include "sixpoint/calibration/v1/calibration.pb.h"
#include "sixpoint/plant/v1/plant.pb.h"

namespace sixpoint::cli {

// Each notes what is missing or odd in the field's Problems; what it gives back is of use only when there are none.
plant::v1::Machine ReadMachine(const Field& machine);
plant::v1::Sensor ReadSensor(const Field& sensor);
// `plane: "..., 24 x 24 mm"` stands for side_mm where that is absent.
plant::v1::Artefact ReadArtefact(const Field& artefact);
// The CAD format follows from the file's name. unless_said: what the tolerances of groups without position_zone are;
// POSITION_ZONE_UNSPECIFIED: they must say it.
plant::v1::Part ReadPart(const Field& part, const std::string& cad_file,
                         plant::v1::PositionZone unless_said = plant::v1::POSITION_ZONE_UNSPECIFIED);
// {centres: {C1: [x, y, z], ...}, plane, side_x, side_y}, machine frame, mm.
calibration::v1::TouchData ReadTouchData(const Field& touch);
// [{a_deg, b_deg, centre_mm, use: fit | check}, ...], with the machine's letters of the axis on the bed and of the one that it
// carries.
using AxisPair = std::array<std::string, 2>;
std::vector<calibration::v1::SpherePose> ReadSpherePoses(const Field& poses, const AxisPair& axes = {"A", "B"});

// {translation_mm, rotation_deg, uncertainty_share, registration_age_h, keep_out_mm, interim_check_limit_um}: what is not there is left to the plant.
plant::v1::SafetyEnvelope ReadSafetyEnvelope(const Field& envelope);

// Whole requests from files; the request_id is left to the caller. The part's CAD file is read from beside its document.
absl::StatusOr<plant::v1::CreateMachineRequest> LoadMachine(const std::string& path);
absl::StatusOr<plant::v1::CreateArtefactRequest> LoadArtefact(const std::string& path);
absl::StatusOr<plant::v1::CreatePartRequest> LoadPart(const std::string& path);
// The document itself or, in a plant's dataset, its touch_probe / sphere_poses.
absl::StatusOr<calibration::v1::TouchData> LoadTouchData(const std::string& path);
absl::StatusOr<std::vector<calibration::v1::SpherePose>> LoadSpherePoses(const std::string& path,
                                                                         const AxisPair& axes = {"A", "B"});
// {commanded_deg, measured_deg or error_deg, direction (1 or -1; optional)}, lists; in a dataset, axis_runs of that axis.
calibration::v1::AxisRun ReadAxisRun(const Field& run);
absl::StatusOr<calibration::v1::AxisRun> LoadAxisRun(const std::string& path, const std::string& axis);
// {bore_mm, face_mm, face_above_centre_mm}.
absl::StatusOr<calibration::v1::StandardProbing> LoadStandardProbing(const std::string& path);

inline constexpr std::uint64_t kGreatestCadBytes = 48u << 20;

}  // namespace sixpoint::cli
