// sixpoint-calibration: sensor to machine, and the rotary axes.
#include "services/calibration/calibration_service.h"
#include "services/calibration/study_service.h"
#include "services/runtime/call.h"
#include "services/runtime/server.h"

namespace sixpoint::calibration {
namespace {

std::string PeerOr(const runtime::ServerOptions& options, const std::string& area, const std::string& usual) {
  const auto peer = options.peers.find(area);
  return peer == options.peers.end() ? usual : peer->second;
}

std::vector<std::unique_ptr<grpc::Service>> MakeServices(const runtime::ServerOptions& options,
                                                         storage::Database* database) {
  const auto calibrations = storage::CalibrationsIn(database);
  const auto plant = runtime::ConnectTo(PeerOr(options, "plant", "127.0.0.1:7400"));
  const auto ingest = runtime::ConnectTo(PeerOr(options, "ingest", "127.0.0.1:7401"));
  std::vector<std::unique_ptr<grpc::Service>> services;
  services.push_back(std::make_unique<CalibrationService>(calibrations, plant, ingest, options.threads));
  services.push_back(std::make_unique<StudyService>(storage::StudiesIn(database), calibrations, plant, ingest));
  return services;
}

}  // namespace
}  // namespace sixpoint::calibration

int main(int argc, char** argv) {
  return sixpoint::runtime::Serve(sixpoint::runtime::ParseServerOptions(argc, argv, "calibration"),
                                  sixpoint::calibration::MakeServices);
}
