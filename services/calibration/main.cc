// sixpoint-calibration: sensor to machine, and the rotary axes.
#include "services/calibration/calibration_service.h"
#include "services/calibration/metrics.h"
#include "services/calibration/study_service.h"
#include "services/runtime/peers.h"
#include "services/runtime/server.h"

namespace sixpoint::calibration {
namespace {

std::vector<runtime::ServedService> MakeServices(const runtime::ServerOptions& options, storage::Database* database) {
  const auto calibrations = storage::CalibrationsIn(database);
  const auto plant = runtime::ConnectToPeer(options, "plant");
  const auto ingest = runtime::ConnectToPeer(options, "ingest");
  const auto studies = storage::StudiesIn(database);
  std::vector<runtime::ServedService> services;
  services.push_back({v1::CalibrationService::service_full_name(),
                      std::make_unique<CalibrationService>(calibrations, studies, plant, ingest, options.threads),
                      CalibrationsSampled()});
  services.push_back(
      {v1::StudyService::service_full_name(), std::make_unique<StudyService>(studies, calibrations, plant, ingest)});
  return services;
}

}  // namespace
}  // namespace sixpoint::calibration

int main(int argc, char** argv) {
  return sixpoint::runtime::Serve(sixpoint::runtime::ParseServerOptions(argc, argv, "calibration"),
                                  sixpoint::calibration::MakeServices);
}
