// sixpoint-registration: where every blade really stands.
#include "services/registration/registration_service.h"
#include "services/runtime/call.h"
#include "services/runtime/server.h"

namespace sixpoint::registration {
namespace {

std::shared_ptr<grpc::Channel> Peer(const runtime::ServerOptions& options, const std::string& area,
                                    const std::string& usual) {
  const auto peer = options.peers.find(area);
  return runtime::ConnectTo(peer == options.peers.end() ? usual : peer->second);
}

std::vector<std::unique_ptr<grpc::Service>> MakeServices(const runtime::ServerOptions& options,
                                                         storage::Database* database) {
  std::vector<std::unique_ptr<grpc::Service>> services;
  services.push_back(std::make_unique<RegistrationService>(
      database,
      Peers{Peer(options, "plant", "127.0.0.1:7400"), Peer(options, "ingest", "127.0.0.1:7401"),
            Peer(options, "calibration", "127.0.0.1:7402")},
      options.threads));
  return services;
}

}  // namespace
}  // namespace sixpoint::registration

int main(int argc, char** argv) {
  return sixpoint::runtime::Serve(sixpoint::runtime::ParseServerOptions(argc, argv, "registration"),
                                  sixpoint::registration::MakeServices);
}
