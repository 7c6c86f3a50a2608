// What a plant run found, and its file (docs/cli.md tells the fields).
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "sixpoint/calibration/v1/calibration.pb.h"
#include "sixpoint/correction/v1/correction.pb.h"
#include "sixpoint/inspection/v1/inspection.pb.h"
#include "sixpoint/registration/v1/registration.pb.h"

namespace sixpoint::cli {

// One blade by one method.
struct RegisteredBlade {
  std::string blade, method;  // serial; six-point, airfoil or local
  registration::v1::Registration registration;
  double seconds = 0;
};
struct CorrectedBlade {
  std::string blade, method;
  correction::v1::Correction correction;
  double seconds = 0;
};
struct InspectedBlade {
  std::string blade;
  inspection::v1::Inspection inspection;
  double seconds = 0;
};

// A step that gave nothing that may be used.
struct FailedStep {
  std::string step;  // ingest, calibration, registration, correction or inspection
  std::string subject, method;
  std::string outcome;  // a status code, or the registration's outcome
  std::string message;
};

struct PlantRunResult {
  std::optional<calibration::v1::Calibration> sensor, rotation;
  // Converged ones only.
  std::vector<RegisteredBlade> registrations;
  std::vector<CorrectedBlade> corrections;
  std::vector<InspectedBlade> inspections;
  std::vector<FailedStep> failures;
  double setup_s = 0, ingest_s = 0, calibration_s = 0, registration_s = 0, correction_s = 0, inspection_s = 0;
  std::int64_t scan_count = 0, already_stored_count = 0, point_count = 0;
  std::int64_t payload_bytes = 0, stored_bytes = 0;  // as sent, and as the service keeps them
  double proven_error_um = 0;                        // greatest that storing added
};

// Every double so that it reads back as the same double. Frames: table is the machine's; zero_from_part takes CAD
// millimetres to table coordinates at A = B = 0.
nlohmann::json ResultsToJson(const PlantRunResult& result);

// Tables for people.
std::string ResultsToText(const PlantRunResult& result);

}  // namespace sixpoint::cli
