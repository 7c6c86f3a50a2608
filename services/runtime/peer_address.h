// Who a peer is: what counts connections and what counts uploads ask here.
#pragma once

#include <sys/socket.h>

#include <string>

namespace sixpoint::runtime {

// The same for all connections of one peer: an IPv4 address, mapped into IPv6 or not; the first 64 bits of an IPv6 address, for its
// network gives a host the rest to choose from; all of a unix socket, on which nobody has a name.
std::string PeerKey(const sockaddr_storage& peer);
// grpc_peer: as grpc::ServerContext::peer() names it. Of a name of another shape: all of it but its port.
std::string PeerKey(const std::string& grpc_peer);
// What grpc::ServerContext::peer() calls it.
std::string GrpcName(const sockaddr_storage& peer);

}  // namespace sixpoint::runtime
