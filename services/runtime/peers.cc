#include "services/runtime/peers.h"

#include <map>

#include "services/runtime/call.h"

namespace sixpoint::runtime {

std::string PeerAddress(const ServerOptions& options, const std::string& area) {
  static const std::map<std::string, std::string> usual = {{"plant", "127.0.0.1:7400"},
                                                           {"ingest", "127.0.0.1:7401"},
                                                           {"calibration", "127.0.0.1:7402"},
                                                           {"registration", "127.0.0.1:7403"}};
  const auto peer = options.peers.find(area);
  return peer == options.peers.end() ? usual.at(area) : peer->second;
}

std::shared_ptr<grpc::Channel> ConnectToPeer(const ServerOptions& options, const std::string& area) {
  return ConnectTo(PeerAddress(options, area), options.credentials);
}

}  // namespace sixpoint::runtime
