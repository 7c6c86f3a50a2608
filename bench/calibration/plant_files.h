// A plant's files in shared/data: its scans, its artefact, and what only its simulator knows.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "metrology/scanner/line_scanner.h"
#include "simulator/artefact.h"
#include "simulator/machine.h"

namespace sixpoint::bench {

Eigen::Vector3d VectorOf(const nlohmann::json& values);
// Ends the process where it cannot. `data`: dataset.json.
metrology::LineScan LoadScan(const std::string& folder, const nlohmann::json& data, const std::string& id);
simulator::ArtefactGeometry GeometryOf(const nlohmann::json& artefact);
// Of truth.json: the sensor and the artefact.
simulator::MachineTruth TruthOf(const nlohmann::json& known);

}  // namespace sixpoint::bench
