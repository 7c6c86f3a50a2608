#include "services/runtime/message_limits.h"

#include <map>
#include <string>

namespace sixpoint::runtime {
namespace {

constexpr std::size_t kKib = 1024, kMib = 1024 * kKib;
// Names, figures and lists of some hundreds of them.
constexpr std::size_t kUsual_bytes = 256 * kKib;

}  // namespace

std::size_t GreatestRequest_bytes(const google::protobuf::MethodDescriptor& method) {
  // Where the bounds of the fields (each service's validate.cc) let a request be greater.
  static const auto* const kGreater = new std::map<std::string, std::size_t>{
      {"sixpoint.plant.v1.PlantService.CreatePart", 56 * kMib},           // 48 MiB of CAD, 20,000 holes
      {"sixpoint.plant.v1.PlantService.CreateMachiningModel", 2 * kMib},  // a template of a program
      {"sixpoint.plant.v1.DrawingService.CreateDrawing",
       3 * kMib},  // 2000 characteristics, and an answer of them under 4 MiB
      {"sixpoint.ingest.v1.ScanService.UploadScan", 8 * kMib},                     // a block
      {"sixpoint.calibration.v1.CalibrationService.CharacteriseAxis", 8 * kMib},   // 200,000 readings
      {"sixpoint.calibration.v1.CalibrationService.CalibrateRotation", 2 * kMib},  // 5000 poses
      {"sixpoint.calibration.v1.CalibrationService.CalibrateProbe", 4 * kMib},     // 10,000 readings
      {"sixpoint.calibration.v1.StudyService.RunGaugeRr", 8 * kMib},               // 100,000 observations
      {"sixpoint.calibration.v1.StudyService.RunSphereCheck", 4 * kMib},           // 100,000 points
      {"sixpoint.correction.v1.CorrectionService.Correct", 2 * kMib},              // a template of a program
      {"sixpoint.correction.v1.CorrectionService.CorrectScans", 2 * kMib},         // the same
      {"sixpoint.inspection.v1.MeasurementService.ImportMeasurements", 5 * kMib},  // 4 MiB of a file
      {"sixpoint.registration.v1.RegistrationService.RegisterBatch", 8 * kMib},    // 1000 requests
  };
  const auto found = kGreater->find(method.full_name());
  return found == kGreater->end() ? kUsual_bytes : found->second;
}

}  // namespace sixpoint::runtime
