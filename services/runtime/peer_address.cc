#include "services/runtime/peer_address.h"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <algorithm>

namespace sixpoint::runtime {
namespace {

constexpr char kUnixPeer[] = "unix:";
// Of IPv6, whose brackets gRPC writes as in an address of the web.
constexpr char kOpen[] = "ipv6:%5B", kClose[] = "%5D";

}  // namespace

std::string PeerKey(const sockaddr_storage& peer) {
  if (peer.ss_family == AF_INET) {
    const auto& address = reinterpret_cast<const sockaddr_in&>(peer).sin_addr;
    return {reinterpret_cast<const char*>(&address), sizeof address};
  }
  if (peer.ss_family == AF_INET6) {
    const auto& address = reinterpret_cast<const sockaddr_in6&>(peer).sin6_addr;
    const char* bytes = reinterpret_cast<const char*>(&address);
    return IN6_IS_ADDR_V4MAPPED(&address) ? std::string(bytes + 12, 4) : std::string(bytes, 8);
  }
  return kUnixPeer;
}

std::string PeerKey(const std::string& grpc_peer) {
  if (grpc_peer.rfind(kUnixPeer, 0) == 0) return kUnixPeer;
  const std::string host = grpc_peer.substr(0, grpc_peer.rfind(':'));
  sockaddr_storage peer{};
  if (host.rfind("ipv4:", 0) == 0) {
    peer.ss_family = AF_INET;
    const std::string address = host.substr(sizeof "ipv4:" - 1);
    if (inet_pton(AF_INET, address.c_str(), &reinterpret_cast<sockaddr_in&>(peer).sin_addr) == 1) return PeerKey(peer);
  } else if (host.rfind(kOpen, 0) == 0) {
    peer.ss_family = AF_INET6;
    std::string address = host.substr(sizeof kOpen - 1);
    address.resize(std::min(address.find('%'), address.size()));  // the bracket, or a link's name before it
    if (inet_pton(AF_INET6, address.c_str(), &reinterpret_cast<sockaddr_in6&>(peer).sin6_addr) == 1)
      return PeerKey(peer);
  }
  return host;
}

std::string GrpcName(const sockaddr_storage& peer) {
  char text[INET6_ADDRSTRLEN] = "";
  if (peer.ss_family == AF_INET) {
    const auto& address = reinterpret_cast<const sockaddr_in&>(peer);
    inet_ntop(AF_INET, &address.sin_addr, text, sizeof text);
    return "ipv4:" + std::string(text) + ":" + std::to_string(ntohs(address.sin_port));
  }
  if (peer.ss_family != AF_INET6) return kUnixPeer;
  const auto& address = reinterpret_cast<const sockaddr_in6&>(peer);
  const std::string port = std::to_string(ntohs(address.sin6_port));
  if (IN6_IS_ADDR_V4MAPPED(&address.sin6_addr)) {
    inet_ntop(AF_INET, reinterpret_cast<const char*>(&address.sin6_addr) + 12, text, sizeof text);
    return "ipv4:" + std::string(text) + ":" + port;
  }
  inet_ntop(AF_INET6, &address.sin6_addr, text, sizeof text);
  return kOpen + std::string(text) + kClose + ":" + port;
}

}  // namespace sixpoint::runtime
