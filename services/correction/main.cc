// sixpoint-correction: the machining program moved onto the real blade.
#include "services/correction/correction_service.h"
#include "services/runtime/call.h"
#include "services/runtime/server.h"

namespace sixpoint::correction {
namespace {

// Corrections at once: each is some remote calls and milliseconds of computing.
constexpr int kGreatestCount = 16;

std::shared_ptr<grpc::Channel> PeerOf(const runtime::ServerOptions& options, const std::string& area,
                                      const std::string& usual) {
  const auto peer = options.peers.find(area);
  return runtime::ConnectTo(peer == options.peers.end() ? usual : peer->second);
}

std::vector<std::unique_ptr<grpc::Service>> MakeServices(const runtime::ServerOptions& options,
                                                         storage::Database* database) {
  auto peers = std::make_unique<Peers>(PeerOf(options, "plant", "127.0.0.1:7400"),
                                       PeerOf(options, "calibration", "127.0.0.1:7402"),
                                       PeerOf(options, "registration", "127.0.0.1:7403"));
  std::vector<std::unique_ptr<grpc::Service>> services;
  services.push_back(
      std::make_unique<CorrectionService>(storage::CorrectionsIn(database), std::move(peers), kGreatestCount));
  return services;
}

}  // namespace
}  // namespace sixpoint::correction

int main(int argc, char** argv) {
  return sixpoint::runtime::Serve(sixpoint::runtime::ParseServerOptions(argc, argv, "correction"),
                                  sixpoint::correction::MakeServices);
}
