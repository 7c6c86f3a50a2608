// What the demo's engineers register with the plant before the first scan.
#pragma once

#include <absl/status/statusor.h>

#include <string>

#include "simulator/artefact.h"
#include "simulator/blade.h"
#include "simulator/machine.h"
#include "simulator/plant_link.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"

namespace sixpoint::simulator {

plant::v1::Machine MachineRecord(const MachineDesign& design);
plant::v1::Artefact ArtefactRecord(const ArtefactGeometry& geometry);
plant::v1::Part PartRecord(const DesignedPart& part);

// Each returns the resource name. The part's CAD is its STL file.
absl::StatusOr<std::string> RegisterMachine(PlantLink& plant, const std::string& machine_id,
                                            const MachineDesign& design);
absl::StatusOr<std::string> RegisterArtefact(PlantLink& plant, const std::string& artefact_id,
                                             const ArtefactGeometry& geometry);
absl::StatusOr<std::string> RegisterPart(PlantLink& plant, const std::string& part_id, const DesignedPart& part);
absl::StatusOr<std::string> RegisterBlade(PlantLink& plant, const std::string& serial, const std::string& part);

}  // namespace sixpoint::simulator
