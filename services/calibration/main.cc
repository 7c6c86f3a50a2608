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
  std::vector<std::unique_ptr<grpc::Service>> services;
  services.push_back(std::make_unique<CalibrationService>(
      database, runtime::ConnectTo(PeerOr(options, "plant", "127.0.0.1:7400")),
      runtime::ConnectTo(PeerOr(options, "ingest", "127.0.0.1:7401")), options.threads));
  services.push_back(std::make_unique<StudyService>(database,
                                                    runtime::ConnectTo(PeerOr(options, "plant", "127.0.0.1:7400")),
                                                    runtime::ConnectTo(PeerOr(options, "ingest", "127.0.0.1:7401"))));
  return services;
}

}  // namespace
}  // namespace sixpoint::calibration

int main(int argc, char** argv) {
  return sixpoint::runtime::Serve(sixpoint::runtime::ParseServerOptions(argc, argv, "calibration"),
                                  sixpoint::calibration::MakeServices);
}
