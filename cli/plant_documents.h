// What people write about a plant, as messages: machine, part, artefact (docs/examples/*.yaml, and the same words in a
// plant's dataset.json).
#pragma once

#include <absl/status/statusor.h>

#include <cstdint>
#include <string>

#include "cli/document.h"
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

// {translation_mm, rotation_deg, uncertainty_share, registration_age_h, keep_out_mm, interim_check_limit_um}: what is not there is left to the plant.
plant::v1::SafetyEnvelope ReadSafetyEnvelope(const Field& envelope);

// Whole requests from files; the request_id is left to the caller. The part's CAD file is read from beside its document.
absl::StatusOr<plant::v1::CreateMachineRequest> LoadMachine(const std::string& path);
absl::StatusOr<plant::v1::CreateArtefactRequest> LoadArtefact(const std::string& path);
absl::StatusOr<plant::v1::CreatePartRequest> LoadPart(const std::string& path);

inline constexpr std::size_t kGreatestFeatureCount = 64;  // of an artefact
inline constexpr std::uint64_t kGreatestCadBytes = 48u << 20;

}  // namespace sixpoint::cli
